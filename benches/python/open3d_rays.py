"""Rays at meshes beside Open3D's RaycastingScene: opaque, and with alpha masks.

    pip install ./python open3d==0.20.0 && python benches/python/open3d_rays.py [RAYS]

The same float32 arrays go to both. Opaque: ground and 64 beeches, as many as in a forest, with all
triangles in one mesh; rays of a tripod in the middle. With alpha: the same, and the cards of leaves
have a mask of two leaves, which covers half of them.
Open3D has no masks, so what people do is looped: cast, look the hit's texture coordinates up, and
cast again from behind the hit what was transparent there, up to 32 times. Its answers must be ours.

Start and memory are those of each program alone in a process, which has imported it and cast at a
triangle before: the start is until a first ray is cast, the memory is what stays after all rays and
apart from it what was needed for a while during them. Speed is of both in one process, whose order
changes from round to round.
"""

import resource
import statistics
import subprocess
import sys
import time

import numpy as np

import nemoral

from common import forget_peak, host, peak_mb, resident_mb

ROUNDS = 6
SIDE = 64
FIRST_RAY = np.array([[0, 0, 500, 0, 0, 1]], np.float32)
"""It meets nothing. The trees over triangles are made by the first cast."""
TRIANGLE = [(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32), None, None)]


def forest():
    """Wood and ground, and the cards' corners, of 64 beeches on 60 m by 60 m."""
    tree = nemoral.grow_tree("beech", dbh_m=0.3, wood_triangles_max=8_000, cards_max=6_000)
    chance = np.random.default_rng(7)
    vertices, triangles, cards, first = [], [], [], 0
    for i in range(64):
        at = 7.5 * np.array([i % 8 - 3.5, i // 8 - 3.5]) + chance.uniform(-2, 2, 2)
        angle = chance.uniform(0, 2 * np.pi)
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        place = np.append(at, 0.0)
        vertices.append(tree.vertices @ turn.T + place)
        triangles.append(tree.triangles + first)
        first += len(tree.vertices)
        cards.append(tree.leaf_corners @ turn.T + place)
    ground = np.array([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]])
    vertices.append(ground)
    triangles.append(np.array([[0, 1, 2], [0, 2, 3]]) + first)
    return (
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
        np.concatenate(cards).astype(np.float32),
    )


def as_mesh(cards):
    """Two triangles and texture coordinates for each card."""
    first = 4 * np.arange(len(cards), dtype=np.uint32)[:, None, None]
    quads = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (len(cards), 1))
    return cards.reshape(-1, 3), quads.reshape(-1, 3), uv


def mask():
    """Two pointed leaves on a card."""
    y, x = (np.mgrid[0:SIDE, 0:SIDE] + 0.5) / SIDE
    leaf = lambda cx: np.abs(x - cx) < 0.2 * np.sin(np.pi * y)
    return leaf(0.27) | leaf(0.73)


def rays(count):
    """A tripod's rays, row by row, as a scanner fires them."""
    rows = int((count / 3.6) ** 0.5)
    columns = count // rows
    polar = np.radians(np.linspace(30, 130, rows))[None, :]
    azimuth = np.linspace(0, 2 * np.pi, columns, endpoint=False)[:, None]
    z = np.broadcast_to(np.cos(polar), (columns, rows))
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    directions = np.stack([x, y, z], -1).reshape(-1, 3)
    origins = np.broadcast_to([0.0, 0.0, 1.7], directions.shape)
    return np.concatenate([origins, directions], 1).astype(np.float32)


class Ours:
    name = "nemoral"

    def __init__(self, parts):
        self.scene = nemoral.RayScene()
        for vertices, triangles, uv, alpha in parts:
            self.scene.add_mesh(vertices, triangles, uv=uv, alpha=alpha)
        self.cast(FIRST_RAY)

    def cast(self, rays):
        return self.scene.cast(rays)["t_hit"]

    cast_alpha = cast


class Open3d:
    name = "Open3D"

    def __init__(self, parts):
        import open3d

        self.tensor = open3d.core.Tensor
        self.scene = open3d.t.geometry.RaycastingScene()
        self.parts = []
        for vertices, triangles, uv, alpha in parts:
            self.scene.add_triangles(self.tensor(vertices), self.tensor(triangles))
            self.parts.append((triangles, uv, alpha))
        self.cast(FIRST_RAY)

    def cast(self, rays):
        return self.scene.cast_rays(self.tensor(rays))["t_hit"].numpy()

    def cast_alpha(self, rays):
        found = np.full(len(rays), np.inf, np.float32)
        at = np.arange(len(rays))
        on, travelled = rays.copy(), np.zeros(len(rays), np.float32)
        for _ in range(32):
            hits = self.scene.cast_rays(self.tensor(on))
            t, part = hits["t_hit"].numpy(), hits["geometry_ids"].numpy()
            triangle, weights = hits["primitive_ids"].numpy(), hits["primitive_uvs"].numpy()
            is_open = np.zeros(len(on), bool)
            for number, (triangles, uv, alpha) in enumerate(self.parts):
                of = np.flatnonzero(part == number) if alpha is not None else []
                if not len(of):
                    continue
                corner = uv[triangles[triangle[of]]]
                u, v = weights[of, :1], weights[of, 1:]
                place = corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v
                column, row = np.clip((place * SIDE).astype(int), 0, SIDE - 1).T
                is_open[of] = ~alpha[row, column]
            done = ~is_open
            found[at[done]] = travelled[done] + t[done]
            if not is_open.any():
                break
            step = t[is_open] + np.float32(1e-4)
            at, travelled = at[is_open], travelled[is_open] + step
            on = on[is_open]
            on[:, :3] += on[:, 3:] * step[:, None]
        return found


def scene(kind):
    vertices, triangles, cards = forest()
    card_vertices, card_triangles, uv = as_mesh(cards)
    if kind == "opaque":
        both = np.concatenate([vertices, card_vertices])
        return [(both, np.concatenate([triangles, card_triangles + len(vertices)]), None, None)]
    return [(vertices, triangles, None, None), (card_vertices, card_triangles, uv, mask())]


def one(program, kind, count):
    """One program alone in a process: its start, its memory."""
    parts, some = scene(kind), rays(count)
    program(TRIANGLE)
    before, start = resident_mb(), time.perf_counter()
    caster = program(parts)
    start = time.perf_counter() - start
    cast = caster.cast if kind == "opaque" else caster.cast_alpha
    forget_peak()
    cast(some)
    stays = resident_mb()
    print(
        f"{kind}, {program.name}: start {start:.2f} s, memory {stays - before:.0f} MB more, "
        f"and {peak_mb() - stays:.0f} MB while casting"
    )


def processor_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main():
    if len(sys.argv) == 4:
        program = Ours if sys.argv[1] == "nemoral" else Open3d
        return one(program, sys.argv[2], int(sys.argv[3]))
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
    print(host())
    some = rays(count)
    for kind in ("opaque", "alpha"):
        for program in ("nemoral", "open3d"):
            subprocess.check_call([sys.executable, __file__, program, kind, str(count)])
        parts = scene(kind)
        print(f"{kind}: {sum(len(p[1]) for p in parts)} triangles, {len(some)} rays")
        casters = [Ours(parts), Open3d(parts)]
        speed = {caster.name: [] for caster in casters}
        for number in range(ROUNDS + 1):
            answers = {}
            for caster in casters[:: 1 if number % 2 else -1]:
                cast = caster.cast if kind == "opaque" else caster.cast_alpha
                start, used = time.perf_counter(), processor_s()
                answers[caster.name] = cast(some)
                wall, used = time.perf_counter() - start, processor_s() - used
                if number:  # the first round warms both
                    speed[caster.name].append((len(some) / wall / 1e6, len(some) / used / 1e6))
            answers = [answers[caster.name] for caster in casters]
            met = [np.isfinite(found) for found in answers]
            apart = met[0] != met[1]
            both = met[0] & met[1]
            apart[both] = np.abs(answers[0][both] - answers[1][both]) > 1e-3
            assert apart.mean() < 1e-3, apart.mean()
        for i, clock in enumerate(["by the wall", "a second of processor"]):
            middle = {n: statistics.median(s[i] for s in found) for n, found in speed.items()}
            ratios = [a[i] / b[i] for a, b in zip(*speed.values())]
            texts = ", ".join(f"{name} {m:.2f}" for name, m in middle.items())
            print(
                f"  million rays {clock}: {texts}; ratio {statistics.median(ratios):.2f} "
                f"({min(ratios):.2f} to {max(ratios):.2f})"
            )
        print(f"  answers that differ: {apart.mean():.1e} of the rays")


if __name__ == "__main__":
    main()
