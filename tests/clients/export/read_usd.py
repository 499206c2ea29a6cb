"""Reads both OpenUSD stages by Pixar's library, and compares all triangles with the truth:
read_usd.py OUT

Needs usd-core, numpy, scipy.
"""

import sys
from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade

from common import classes, compare, truth


def labels_of(prim, taxonomy):
    values = prim.GetAttribute(f"semantics:labels:{taxonomy}").Get()
    return list(values) if values else []


def triangles(mesh, matrix):
    points = np.array(mesh.GetPointsAttr().Get(), dtype=np.float64)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get())
    assert (counts == 3).all()
    matrix = np.array(matrix)
    points = points @ matrix[:3, :3] + matrix[3, :3]
    return points[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)]


def check_mesh(prim, class_of, seen):
    """The semantic of a mesh, whose labels and material agree."""
    [semantic], [name] = labels_of(prim, "semantic"), labels_of(prim, "class")
    assert class_of[semantic] == name
    assert prim.GetAttribute("semantic:class:params:semanticData").Get() == name
    assert prim.GetAttribute("semantic:class:params:semanticType").Get() == "class"
    for api in ("SemanticsLabelsAPI:class", "SemanticsAPI:class", "MaterialBindingAPI"):
        assert api in prim.GetPrimTypeInfo().GetAppliedAPISchemas() + list(
            prim.GetMetadata("apiSchemas").GetAddedOrExplicitItems()), api
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    assert material, prim.GetPath()
    if material.GetPath() not in seen:
        seen.add(material.GetPath())
        picture = UsdShade.Shader(material.GetPrim().GetChild("Picture"))
        file = picture.GetInput("file").Get()
        assert file.resolvedPath and Path(file.resolvedPath).is_file(), file
        assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"
        own = material.GetPrim().GetAttribute("nemoral:semantic").Get()
        assert own == semantic, (own, semantic)
    return semantic


def read(path, class_of):
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    rows, labels, seen, instancers = [], [], set(), 0
    cache = UsdGeom.XformCache()

    def visit(prim, above, object_id):
        """All meshes below a prim, placed."""
        for mesh in Usd.PrimRange(prim, Usd.TraverseInstanceProxies()):
            if not mesh.IsA(UsdGeom.Mesh):
                continue
            here = cache.GetLocalToWorldTransform(mesh) if above is None else above
            faces = triangles(UsdGeom.Mesh(mesh), here)
            rows.append(faces)
            labels.extend([(object_id, check_mesh(mesh, class_of, seen))] * len(faces))

    for prim in stage.GetDefaultPrim().GetChildren():
        if prim.IsA(UsdGeom.PointInstancer):
            instancers += 1
            instancer = UsdGeom.PointInstancer(prim)
            [shape] = instancer.GetPrototypesRel().GetForwardedTargets()
            ids = instancer.GetIdsAttr().Get()
            transforms = instancer.ComputeInstanceTransformsAtTime(
                Usd.TimeCode.Default(), Usd.TimeCode.Default())
            for i, matrix in enumerate(transforms):
                visit(stage.GetPrimAtPath(shape), Gf.Matrix4d(matrix), int(ids[i]) if ids else 0)
        elif prim.IsA(UsdGeom.Xform):
            attribute = prim.GetAttribute("nemoral:object")
            object_id = int(attribute.Get()) if attribute.HasValue() else 0
            if object_id:
                assert labels_of(prim, "object") == [str(object_id)] and labels_of(prim, "kind")
            visit(prim, None, object_id)
    return (np.concatenate(rows), labels), instancers, len(seen)


def main(out):
    class_of, _ = classes(out)
    expected = truth(out)
    for name in ("instanced", "nodes"):
        found, instancers, materials = read(Path(out) / f"usd-{name}" / "forest.usda", class_of)
        worst = compare(f"usd {name}", found, expected)
        assert (instancers > 0) == (name == "instanced")
        version = ".".join(map(str, Usd.GetVersion()))
        print(f"usd-core {version}, {name}: {len(found[1])} triangles, {instancers} instancers, "
              f"{materials} materials, {worst * 1000:.3f} mm off at most")


main(sys.argv[1])
