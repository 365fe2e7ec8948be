"""Render surfaces in USD: a Mesh ``<body>_render`` beside the surface of the tets, which is hidden.

It has texture coordinates, normals and a material of its own. Of a rigid body all of it is written
once, in the frame of its mesh.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from warp_contact.files import replacing
from warp_contact.usd.prims import Part, add_mesh


@dataclass(frozen=True)
class Render:
    """The render surface of a body.

    Attributes:
        part: the body
        surface: what the user gave
        texture: name of its picture in the folder of the run, "" for none
    """

    part: Part
    surface: Any
    texture: str

    @property
    def path(self) -> str:
        """Its prim, by the name of which Blender shows the body."""
        return f"{self.part.surface}_render"


def renders(parts: list[Part], sim) -> list[Render]:
    """All of a simulation; pictures that bodies share have one name."""
    found: list[Render] = []
    names: dict[Path, str] = {}
    for part in parts:
        surface = getattr(sim.scene.bodies[part.index], "render", None)
        if surface is not None:
            path, name = surface.texture, ""
            if path is not None:
                name = names.setdefault(path, f"texture_{len(names)}{path.suffix}")
            found.append(Render(part, surface, name))
    return found


def copy_textures(chosen: list[Render], folder: Path) -> None:
    """Put their pictures into a folder; raises OSError where one cannot be read."""
    for name, path in {r.texture: r.surface.texture for r in chosen if r.texture}.items():
        picture = path.read_bytes()
        with replacing(folder / name) as part:
            part.write_bytes(picture)


def add_renders(topology: Sdf.Layer, chosen: list[Render]) -> None:
    """Add their prims to the layer of what does not change."""
    if not chosen:
        return
    stage = Usd.Stage.Open(topology)
    looks = {"": UsdShade.Material.Get(stage, "/World/Looks/contact")}  # shows displayColor
    for render in chosen:
        surface, part = render.surface, render.part
        if render.texture not in looks:
            looks[render.texture] = textured(stage, render.texture)
        hidden = UsdGeom.Imageable(stage.GetPrimAtPath(part.surface))
        hidden.CreatePurposeAttr(UsdGeom.Tokens.guide)
        points = surface.vertices.astype(np.float32)
        mesh = add_mesh(stage, render.path, points, surface.triangles, looks[render.texture])
        api, types = UsdGeom.PrimvarsAPI(mesh), Sdf.ValueTypeNames
        if surface.uv is not None:
            uv = Vt.Vec2fArray.FromNumpy(surface.uv.reshape(-1, 2).astype(np.float32))
            api.CreatePrimvar("st", types.TexCoord2fArray, UsdGeom.Tokens.faceVarying).Set(uv)
        colors = part.color if surface.colors is None else surface.colors
        where = UsdGeom.Tokens.constant if colors.ndim == 1 else UsdGeom.Tokens.vertex
        colors = np.ascontiguousarray(colors.reshape(-1, 3), dtype=np.float32)
        color = api.CreatePrimvar("displayColor", types.Color3fArray, where)
        color.Set(Vt.Vec3fArray.FromNumpy(colors))
        by_corner = surface.normals is not None
        mesh.SetNormalsInterpolation("faceVarying" if by_corner else "vertex")
        mesh.CreateNormalsAttr(array_of(at_rest(surface)))


def textured(stage, name: str) -> UsdShade.Material:
    """A material of a picture."""
    path = f"/World/Looks/{Path(name).stem}"
    material, types = UsdShade.Material.Define(stage, path), Sdf.ValueTypeNames
    reader = UsdShade.Shader.Define(stage, f"{path}/st")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", types.String).Set("st")
    picture = UsdShade.Shader.Define(stage, f"{path}/picture")
    picture.CreateIdAttr("UsdUVTexture")
    picture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(f"./{name}"))
    for key in "wrapS", "wrapT":
        picture.CreateInput(key, types.Token).Set("repeat")
    at = reader.CreateOutput("result", types.Float2)
    picture.CreateInput("st", types.Float2).ConnectToSource(at)
    surface = UsdShade.Shader.Define(stage, f"{path}/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", types.Float).Set(0.5)
    rgb = picture.CreateOutput("rgb", types.Float3)
    surface.CreateInput("diffuseColor", types.Color3f).ConnectToSource(rgb)
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", types.Token))
    return material


def at_rest(surface) -> np.ndarray:
    """Unit normals of the corners where it has them, else of the vertices, by areas."""
    if surface.normals is not None:
        return surface.normals
    n = np.zeros(surface.vertices.shape)
    for k in range(3):
        np.add.at(n, surface.triangles[:, k], surface.areas)
    return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), np.finfo(float).tiny)


def render_types(render: Render) -> dict[str, Sdf.ValueTypeName]:
    """The attributes that change, by their paths."""
    if render.part.is_rigid:
        return {}
    types = Sdf.ValueTypeNames
    kinds = {"points": types.Point3fArray, "extent": types.Float3Array}
    kinds["normals"] = types.Normal3fArray
    return {f"{render.path}.{name}": kind for name, kind in kinds.items()}


def render_values(render: Render, sim) -> tuple:
    """Their values now."""
    if render.part.is_rigid:
        return ()
    x, normals = sim.rendered(render.part.index)
    points = array_of(x)
    return points, UsdGeom.PointBased.ComputeExtent(points), array_of(normals)


def array_of(vectors: np.ndarray) -> Vt.Vec3fArray:
    """Vectors, shape (..., 3), as USD takes them."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(vectors.reshape(-1, 3), dtype=np.float32))
