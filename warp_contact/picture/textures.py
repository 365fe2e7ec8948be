"""Colours of vertices from the texture of their mesh: all that the ray caster draws of it."""

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from warp_contact.picture.files import read_picture


def vertex_colors(mesh: UsdGeom.Mesh, n: int) -> np.ndarray | None:
    """Linear colours of ``n`` points, (n, 3), each the mean of its corners; None without texture.

    A texture finer than the mesh is not resolved: take more triangles.
    """
    file, st = texture_of(mesh), UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    if not file or not st:
        return None
    time = Usd.TimeCode.EarliestTime()
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(time), dtype=np.int64)
    uv = np.asarray(st.ComputeFlattened(time) or (), dtype=float).reshape(-1, 2)
    if st.GetInterpolation() != UsdGeom.Tokens.faceVarying and len(uv) == n:
        uv = uv[corners]
    picture = read_picture(file) if len(uv) == len(corners) and np.isfinite(uv).all() else None
    if picture is None:
        return None
    height, width, _ = picture.shape
    u, v = (uv % 1.0).T
    column = np.minimum((u * width).astype(int), width - 1)
    row = np.minimum(((1.0 - v) * height).astype(int), height - 1)
    total, count = np.zeros((n, 3)), np.bincount(corners, minlength=n)
    np.add.at(total, corners, picture[row, column])
    return total / np.maximum(count, 1)[:, None]


def texture_of(mesh: UsdGeom.Mesh) -> str:
    """The file of its diffuse colour, "" if it has none."""
    material = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()[0]
    shader = material.ComputeSurfaceSource()[0] if material else None
    diffuse = shader.GetInput("diffuseColor") if shader else None
    for source in diffuse.GetValueProducingAttributes() if diffuse else ():
        picture = UsdShade.Shader(source.GetPrim())
        file = picture.GetInput("file") if picture else None
        if file and file.Get():
            return file.Get().resolvedPath
    return ""
