"""Reads surfaces from files, as a program of its own, in the way of ``reading.py``.

    python reading_faces.py faces|usd_faces PATH ARGUMENT BYTES

Each gives ``points`` (n, 3) and polygons, one after the other: ``counts`` (f,) of the corners of
each, ``corners``, their points, and as far as they are there ``uv`` and ``normals`` of corners,
linear ``colors`` of all points (3,) or of each (n, 3), and the path of a ``texture``.
"""

import importlib.util
import io
import re
import sys
from contextlib import suppress
from pathlib import Path

# The package itself is not imported, as there.
_SPEC = importlib.util.spec_from_file_location("reading", Path(__file__).with_name("reading.py"))
reading = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(reading)
Unfit, packed = reading.Unfit, reading.packed

FACES = {"triangle": 3, "quad": 4, "polygon": 0}  # corners that count, 0: all
UV = ("s", "t"), ("u", "v"), ("texture_u", "texture_v")  # names in PLY files
NORMALS = (("nx", "ny", "nz"),)
COLORS = "red", "green", "blue"


def read_faces(path: str, _) -> bytes:
    """``points`` and polygons: ``counts`` of their ``corners``, ``uv`` and ``normals`` of these."""
    import numpy as np

    if path.lower().endswith(".obj"):
        return read_obj(path)
    mesh = polygons_of(path)
    counts: list[int] = []
    corners, others = [], []
    for block in mesh.cells:
        kind = block.type.rstrip("0123456789")
        if kind not in FACES:
            others.append(f"{len(block.data)} {block.type}")
            continue
        rows = [np.asarray(row)[: FACES[kind] or None].astype(int) for row in block.data]
        counts += map(len, rows)
        corners += rows
    corners = np.concatenate([np.zeros(0, dtype=int), *corners])
    arrays = {"points": np.asarray(mesh.points), "counts": np.array(counts, dtype=int)}
    arrays |= {"corners": corners, "others": np.array(", ".join(others))}
    for name, choices in ("uv", UV), ("normals", NORMALS):
        for keys in choices:
            inside = corners.size and 0 <= corners.min() and corners.max() < len(mesh.points)
            if inside and all(key in mesh.point_data for key in keys):
                values = np.stack([mesh.point_data[key] for key in keys], axis=1)
                arrays[name] = values[corners].astype(float)
    if all(key in mesh.point_data for key in COLORS):
        rgb = np.stack([mesh.point_data[key] for key in COLORS], axis=1)
        whole = rgb.dtype.kind in "iu"
        rgb = rgb.astype(np.uint8) / 255.0 if whole else np.clip(rgb, 0.0, 1.0)
        arrays["colors"] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return packed(**arrays)


def polygons_of(path: str):
    """A mesh; of PLY also one whose faces are called as in older files."""
    if not path.lower().endswith(".ply"):
        return reading.by_meshio(path)
    from meshio.ply import _ply

    with open(path, "rb") as file:
        head, end, rest = file.read().partition(b"end_header")
    head = re.sub(rb"vertex_index\b", b"vertex_indices", head)
    return _ply.read_buffer(io.BytesIO(head + end + rest))


def read_obj(path: str) -> bytes:
    """The same of an OBJ, whose corners have numbers of their own for uv and normals."""
    import numpy as np

    found: dict[str, list] = {"v": [], "vt": [], "vn": []}
    counts, corners, names, library = [], [], set(), ""
    with open(path, encoding="utf-8", errors="replace") as file:
        text = file.read().replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), 1):
        key, *words = line.partition("#")[0].split() or [""]
        try:
            if key in found:
                found[key].append([float(word) for word in words[: 2 if key == "vt" else 3]])
            elif key == "mtllib":
                library = line.split(None, 1)[1].strip()
            elif key == "usemtl":
                names.add(" ".join(words))
            elif key == "f":
                if len(words) < 3:
                    raise ValueError
                counts.append(len(words))
                for word in words:
                    ids = [int(part) if part else 0 for part in word.split("/")]
                    sizes = map(len, found.values())
                    corners.append(
                        [i + n if i < 0 else i - 1 for i, n in zip(ids, sizes, strict=False)]
                    )
                    corners[-1] += [-1] * (3 - len(ids))
        except ValueError:
            raise Unfit(f"line {number} cannot be read: {reading.in_short(line)!r}") from None
    if any(len(row) < (2 if key == "vt" else 3) for key in found for row in found[key]):
        raise Unfit("a vertex, texture coordinate or normal lacks a number")
    corners = np.array(corners, dtype=int).reshape(-1, 3)
    points = np.array(found["v"], dtype=float).reshape(-1, 3)
    arrays = {"points": points, "counts": np.array(counts, dtype=int), "corners": corners[:, 0]}
    for name, key, ids in ("uv", "vt", corners[:, 1]), ("normals", "vn", corners[:, 2]):
        if found[key] and len(ids) and 0 <= ids.min() and ids.max() < len(found[key]):
            arrays[name] = np.array(found[key])[ids]
    if len(names) == 1 and library:
        arrays |= look_of(Path(path).parent / library, names.pop())
    return packed(**arrays, others=np.array(""))


def look_of(library: Path, name: str) -> dict:
    """``colors`` and ``texture`` of a material in an MTL file, as far as they are there."""
    import numpy as np

    look: dict[str, np.ndarray] = {}
    own = False
    if not library.is_file():
        return look
    for line in library.read_text(encoding="utf-8", errors="replace").splitlines():
        key, *words = line.split() or [""]
        if key == "newmtl":
            own = " ".join(words) == name
        elif own and key == "Kd":
            with suppress(ValueError):
                look["colors"] = np.clip([float(word) for word in words[:3]], 0.0, 1.0)
        elif own and key == "map_Kd" and words:  # options come before the name
            picture = line.split(None, 1)[1].strip() if words[0][0] != "-" else words[-1]
            look["texture"] = np.array(str(library.parent / picture.replace("\\", "/")))
    return {k: v for k, v in look.items() if k != "colors" or v.shape == (3,)}


def read_usd_faces(path: str, argument: str) -> bytes:
    """The same of a Mesh, [m] and with z up, at the earliest time, or ``points`` (k, n, 3).

    The ``argument`` is ``<frames a second>|<path of the prim>``; without frames the first counts.
    """
    import numpy as np
    from pxr import Usd, UsdGeom

    stage, (fps, _, wanted) = reading.opened(path), argument.partition("|")
    found = [p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    found = [p for p in found if not wanted or str(p.GetPath()) == wanted]
    if not found:
        raise Unfit(f"holds no Mesh{f' at {wanted}' if wanted else ''}")
    mesh, first = UsdGeom.Mesh(found[0]), Usd.TimeCode.EarliestTime()
    faces = mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
    if fps and any(len(attribute.GetTimeSamples()) > 1 for attribute in faces):
        raise Unfit(f"the faces of {mesh.GetPath()} change: only its points may")
    counts, corners = (np.array(a.Get(first) or (), dtype=int) for a in faces)
    unit, has_unit = reading.unit_of(stage)
    frames: list[np.ndarray] = []
    for time in frame_times(stage, mesh, float(fps)) if fps else [first]:
        points, place = (
            np.array(mesh.GetPointsAttr().Get(time), dtype=float),
            reading.placement(mesh, time),
        )
        if points.ndim != 2 or not points.size or (frames and points.shape != frames[0].shape):
            raise Unfit(f"{mesh.GetPath()} has no points, or not always as many")
        with np.errstate(over="ignore", invalid="ignore"):
            frames.append(reading.upright(stage, unit * (points @ place[:3, :3] + place[3, :3])))
    turned = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    turned ^= bool(np.linalg.det(place[:3, :3]) < 0.0)
    arrays = corner_values(stage, mesh, first, corners, place) | usd_look(mesh, first, len(points))
    arrays |= {"points": np.stack(frames) if fps else frames[0], "counts": counts}
    arrays |= {"corners": corners, "turned": np.array(turned), "has_unit": np.array(has_unit)}
    return packed(**arrays, others=np.array(""))


def frame_times(stage, mesh, fps: float):
    """Time codes of frames from the first sample of a mesh, or of what moves it, to the last."""
    import numpy as np
    from pxr import UsdGeom

    samples, prim = list(mesh.GetPointsAttr().GetTimeSamples()), mesh.GetPrim()
    while prim:
        samples += UsdGeom.Xformable(prim).GetTimeSamples() if prim.IsA(UsdGeom.Xformable) else []
        prim = prim.GetParent()
    rate = stage.GetTimeCodesPerSecond()
    if not samples or not rate > 0.0:
        raise Unfit(f"{mesh.GetPath()} does not move: it has no time samples")
    # A part of a frame that rounding leaves is none.
    n = int((max(samples) - min(samples)) / rate * fps + 1e-6)
    return min(samples) + np.arange(n + 1) * rate / fps


def corner_values(stage, mesh, time, corners, place) -> dict:
    """``uv`` and ``normals`` of the corners of a mesh, as far as it has them."""
    import numpy as np
    from pxr import UsdGeom

    api, arrays, given = UsdGeom.PrimvarsAPI(mesh), {}, {}
    found = api.GetPrimvarsWithAuthoredValues()
    found = [p for p in found if str(p.GetTypeName()).startswith("texCoord2")]
    found = [p for p in found if p.GetPrimvarName() == "st"] or found
    for uv in found[:1]:
        given["uv"] = uv.ComputeFlattened(time), uv.GetInterpolation()
    normals = api.GetPrimvar("normals")
    if normals:
        given["normals"] = normals.ComputeFlattened(time), normals.GetInterpolation()
    else:
        given["normals"] = mesh.GetNormalsAttr().Get(time), mesh.GetNormalsInterpolation()
    for name, (values, where) in given.items():
        values = np.array(values if values else (), dtype=float)
        if where in ("vertex", "varying") and len(values) > corners.max(initial=0):
            arrays[name] = values[corners]
        elif where == "faceVarying" and len(values) == len(corners):
            arrays[name] = values
    if "normals" in arrays:
        arrays["normals"] = reading.upright(
            stage, arrays["normals"] @ np.linalg.inv(place[:3, :3]).T
        )
    return arrays


def usd_look(mesh, time, n: int) -> dict:
    """``colors`` and ``texture`` of a mesh of ``n`` points, as far as it has them."""
    import numpy as np
    from pxr import UsdShade

    look, color = {}, mesh.GetDisplayColorPrimvar()
    values = np.array(color.ComputeFlattened(time) or (), dtype=float)
    material = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()[0]
    shader = material.ComputeSurfaceSource()[0] if material else None
    diffuse = shader.GetInput("diffuseColor") if shader else None
    if diffuse:
        for source in diffuse.GetValueProducingAttributes():
            picture = UsdShade.Shader(source.GetPrim())
            file = picture.GetInput("file") if picture else None
            if file and file.Get():
                look["texture"] = np.array(file.Get().resolvedPath)
            elif not picture and not len(values):
                values = np.array([diffuse.Get(time) or ()], dtype=float)
    if values.shape in ((1, 3), (n, 3)) and np.isfinite(values).all():
        look["colors"] = np.clip(values if len(values) == n else values[0], 0.0, 1.0)
    return look


reading.READERS.update(faces=read_faces, usd_faces=read_usd_faces)

if __name__ == "__main__":
    sys.exit(reading.main(*sys.argv[1:]))
