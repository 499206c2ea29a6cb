"""Reconstructs a camera's drive from its pictures alone with COLMAP (pycolmap), and compares it with
the truth. The focal length to begin with is that of the pictures' Exif data.

    python reconstruct_pictures.py DATASET [SEQUENCE]
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import pycolmap


def similarity(a, b):
    """Scale, rotation and shift that take points a to b (Umeyama 1991)."""
    ma, mb = a.mean(0), b.mean(0)
    u, s, vt = np.linalg.svd((b - mb).T @ (a - ma))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = u @ sign @ vt
    scale = (s * np.diag(sign)).sum() / ((a - ma) ** 2).sum()
    return scale, turn, mb - scale * turn @ ma


def main(dataset, sequence="00"):
    folder = Path(dataset) / "sequences" / sequence
    rows = np.loadtxt(folder / "poses.txt", ndmin=2).reshape(-1, 3, 4)
    header = json.loads((Path(dataset) / "dataset.json").read_text())
    spec = header["sequences"][int(sequence)]["cameras"][0]["intrinsics"]
    with tempfile.TemporaryDirectory() as work:
        database = Path(work) / "database.db"
        pycolmap.set_random_seed(1)
        pycolmap.extract_features(
            database, folder / "image_2", camera_mode=pycolmap.CameraMode.SINGLE
        )
        begun = next(iter(pycolmap.Database.open(database).read_all_cameras()))
        pycolmap.match_exhaustive(database)
        models = pycolmap.incremental_mapping(database, folder / "image_2", work)
    model = max(models.values(), key=lambda m: m.num_reg_images())
    images = sorted(model.images.values(), key=lambda i: i.name)
    images = [image for image in images if image.has_pose]
    found = np.array([image.projection_center() for image in images])
    truth = np.array([rows[int(Path(image.name).stem)][:, 3] for image in images])
    scale, turn, shift = similarity(found, truth)
    off_m = np.linalg.norm(scale * found @ turn.T + shift - truth, axis=1)
    length_m = np.linalg.norm(np.diff(truth, axis=0), axis=1).sum()
    camera = next(iter(model.cameras.values()))
    pictures = len(list((folder / "image_2").glob("*.png")))
    print(
        f"{len(images)} of {pictures} pictures over {length_m:.1f} m, {model.num_points3D()} points: "
        f"off by {np.sqrt((off_m**2).mean()) * 100:.1f} cm (RMS), {off_m.max() * 100:.1f} cm at most"
    )
    print(
        f"focal length {camera.mean_focal_length():.1f} px, begun with "
        f"{begun.mean_focal_length():.1f} (prior: {begun.has_prior_focal_length}); "
        f"it is {spec['fx']:.1f}; reprojection error "
        f"{model.compute_mean_reprojection_error():.2f} px"
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
