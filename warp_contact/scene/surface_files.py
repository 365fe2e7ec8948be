"""Surface files: polygons of STL, OBJ, PLY, USD and what meshio knows, as triangles."""

import warnings
from pathlib import Path

import numpy as np

from warp_contact import checks
from warp_contact.scene import files
from warp_contact.scene.topology import MeshError

PICTURES = ".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".tif", ".tiff", ".exr", ".hdr"


def load(path, prim: str | None, unit: float | None) -> dict:
    """``vertices`` [m], ``triangles``, ``uv`` and ``normals``; as ``Surface.load``."""
    path, found, scale = _read(path, prim, unit, "")
    points = scale * found["points"].astype(np.float64)
    if unit is None and not found.get("has_unit", False):
        files.ask_for_unit(path, points)
    kept, tris, corners = _triangles(path, points, found)
    out = {"vertices": points[kept], "triangles": tris, "uv": None, "normals": None}
    if "uv" in found and np.isfinite(found["uv"]).all():
        out["uv"] = found["uv"][corners]
    if "normals" in found and np.linalg.norm(found["normals"], axis=1).min() > checks.SMALLEST:
        out["normals"] = found["normals"][corners]  # false too for what is no number
    if "colors" in found:
        colors = found["colors"]
        out["colors"] = colors[kept] if colors.ndim == 2 else colors
    picture = Path(str(found.get("texture", "")))
    if picture.suffix.lower() in PICTURES and picture.is_file():
        out["texture"] = picture
    elif picture.name:
        warnings.warn(f"{path}: its texture {picture} is left out: no such picture", stacklevel=3)
    return out


def load_frames(path, prim: str | None, unit: float | None, fps: float) -> np.ndarray:
    """Positions [m] of the same vertices at each frame, (k, n, 3); as ``Surface.load_frames``."""
    if checks.path(path, "path").suffix.lower() not in files.USD:
        raise ValueError(f"{path}: only a USD file holds frames")
    path, found, scale = _read(path, prim, unit, f"{fps!r}")
    frames = scale * found["points"]
    return frames[:, _triangles(path, frames[0], found)[0]]


def _read(path, prim: str | None, unit: float | None, fps: str) -> tuple[Path, dict, float]:
    """The path, what ``reading_faces.py`` finds in the file, and metres per unit."""
    path = files.regular(path)
    suffix = path.suffix.lower()
    if prim is not None and (not isinstance(prim, str) or suffix not in files.USD):
        raise checks.refuse("prim", prim, "the path of a Mesh, and only for a USD file")
    scale = 1.0 if unit is None else checks.positive(unit, "unit", most=1e9)
    if suffix in files.USD:
        found = files.arrays_of(files.in_child("usd_faces", path, f"{fps}|{prim or ''}"))
        if found["has_unit"] and unit is not None:
            raise ValueError(f"{path}: says its unit itself; leave unit={unit} out")
    else:
        if suffix == ".npz":
            raise MeshError(f"{path}: an .npz holds no surface: give the arrays to wc.Surface")
        if suffix != ".obj":
            files.needed_meshio(path)
        found = files.arrays_of(files.in_child("faces", path))
    if not len(found["counts"]):
        others = str(found["others"])
        tets = "; wc.TetMesh.load reads tets, whose mesh has a surface" if others else ""
        raise MeshError(f"{path}: holds no faces, only {others or 'points'}{tets}")
    return path, found, scale


def _triangles(path: Path, x: np.ndarray, found: dict) -> tuple[np.ndarray, ...]:
    """Which points are vertices, triangles over these, and the three corners of each triangle.

    Polygons are fans from their first corner. Points in the same place become one vertex; those
    without a triangle are dropped, and so are triangles that repeat one.
    """
    counts, corners = found["counts"], found["corners"]
    if x.ndim != 2 or x.shape[1] != 3 or x.dtype.kind not in "fiu":
        raise MeshError(f"{path}: its vertices are of shape {x.shape}, not (n, 3)")
    if corners.dtype.kind not in "iu" or counts.sum() != len(corners) or counts.min() < 0:
        raise MeshError(f"{path}: its faces are not as long as it says: it is damaged")
    bad = corners[(corners < 0) | (corners >= len(x))]
    if len(bad):
        raise MeshError(f"{path}: a face names vertex {bad[0]} of {len(x)}")
    start = np.cumsum(counts) - counts
    face = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    k = np.arange(len(face)) - np.searchsorted(face, face)
    fans = start[face][:, None] + np.stack([0 * k, k + 1, k + 2], axis=1)
    if found.get("turned", False):
        fans = fans[:, ::-1]
    _, first, same = np.unique(x, axis=0, return_index=True, return_inverse=True)
    tris = first[same.ravel()][corners[fans]]
    whole = (tris != np.roll(tris, 1, axis=1)).all(axis=1)
    if not whole.any():
        raise MeshError(f"{path}: each of its faces repeats a vertex")
    kept, tris = np.unique(tris[whole], return_inverse=True)
    return kept, tris.reshape(-1, 3), fans[whole]
