"""The prims of a USD file that do not change during a run: bodies, tets, materials, half-spaces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdShade, Vt

from warp_contact import checks
from warp_contact.usd.physics import Materials, add_body, add_frame, add_scene, note

PALETTE = ("4c86b8", "6fa868", "dfb84e", "9579b6", "48a39b", "c9a57d", "c487a6", "71849f")  # sRGB
FIXED, GROUND = "c4c4c0", "b9b9b5"  # sRGB
WARM, HOT = "f08a24", "c3241c"  # sRGB, at half and at full pressure
SHADES = 128  # colours of a body, from none to full pressure: their differences fit a byte
ROOM = 4.0  # half the width of a drawn half-space, in scene diagonals
FOV = 28.0  # vertical angle of view [degrees]
# Names of prims that are no body.
TAKEN = ("Looks", "view", "physics", "render", "sim", "contacts", "forces", "attachments")
FLAGS = ("velocities", "tets", "flatten", "animate_tets", "resume")  # of a UsdWriter


@dataclass(frozen=True)
class Part:
    """A body as it is written.

    Attributes:
        index: its number
        path: its prim
        ids: its surface vertices in the flat arrays, shape (n,)
        faces: triangles over ``ids``, shape (f, 3)
        verts: its first vertex and the one past its last
        fixed: whether none of its vertices moves freely
        color: linear base colour, shape (3,)
        rest: vertices of its mesh [m], float32 (n, 3), if it is rigid: they are written once, and
            its prim moves; None if it deforms
    """

    index: int
    path: str
    ids: np.ndarray
    faces: np.ndarray
    verts: tuple[int, int]
    fixed: bool
    color: np.ndarray
    rest: np.ndarray | None

    @cached_property
    def surface(self) -> str:
        """Its surface: Blender shows a Mesh by its own name, not by that of the Xform above."""
        return f"{self.path}/{Sdf.Path(self.path).name}"

    @property
    def is_rigid(self) -> bool:
        """Whether it keeps its shape."""
        return self.rest is not None


def check_options(sim, view, pressure_scale, flags: tuple) -> None:
    """Refuse options of a ``UsdWriter`` that cannot work, by ValueError; ``flags`` as ``FLAGS``."""
    if isinstance(sim, type) or not hasattr(sim, "contact_fields"):
        raise checks.refuse("sim", sim, "a wc.Simulation")
    if pressure_scale is not None:
        checks.positive(pressure_scale, "pressure_scale")
    if view is not None:
        if not isinstance(view, tuple | list) or len(view) != 2:
            raise checks.refuse("view", view, "eye and target, three numbers each")
        checks.sight(*view)
    for name, value in zip(FLAGS, flags, strict=True):
        checks.flag(value, name)


def linear(srgb: str) -> np.ndarray:
    """Linear colour of an sRGB hex code."""
    c = np.frombuffer(bytes.fromhex(srgb), dtype=np.uint8) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4).astype(np.float32)


WARM_COLOR, HOT_COLOR = linear(WARM), linear(HOT)


def shades(pressure: np.ndarray) -> np.ndarray:
    """Which of the ``heated`` colours shows a pressure of 0 ... 1, int32 (n,).

    The square root lets light contact show too.
    """
    s = np.sqrt(np.clip(pressure, 0.0, 1.0))
    return np.rint((SHADES - 1) * s).astype(np.int32)


def heated(base: np.ndarray) -> np.ndarray:
    """A base colour blended over orange to red, shape (SHADES, 3)."""
    s = np.linspace(0.0, 1.0, SHADES)[:, None]
    low, high = np.minimum(2.0 * s, 1.0), np.maximum(2.0 * s - 1.0, 0.0)
    color = base + low * (WARM_COLOR - base) + high * (HOT_COLOR - WARM_COLOR)
    return color.astype(np.float32)


def parts(model) -> list[Part]:
    """The bodies of a model with their prims, surface vertices and colours."""
    tris, inv_mass = model.tris.numpy().reshape(-1, 3), model.inv_mass.numpy()
    tri, vert = model.body_tri.numpy(), model.body_vert.numpy()
    taken, result = {*TAKEN}, []
    for b, label in enumerate(model.labels):
        ids, faces = np.unique(tris[tri[b] : tri[b + 1]], return_inverse=True)
        fixed = not bool(inv_mass[vert[b] : vert[b + 1]].any())
        rigid = model.materials[b].kernels is None
        result.append(
            Part(
                index=b,
                path=f"/World/{prim_name(label, taken)}",
                ids=ids,
                faces=faces.reshape(-1, 3).astype(np.int32),
                verts=(int(vert[b]), int(vert[b + 1])),
                fixed=fixed,
                color=linear(FIXED if fixed else PALETTE[b % len(PALETTE)]),
                rest=model.rest[vert[b] : vert[b + 1]].astype(np.float32) if rigid else None,
            )
        )
    return result


def prim_name(label: str, taken: set[str]) -> str:
    """A valid prim name that is not in ``taken``, and from now on is."""
    name = base = Tf.MakeValidIdentifier(label or "body")
    n = 1
    while name in taken:
        name, n = f"{base}_{n}", n + 1
    taken.add(name)
    return name


def topology(parts: list[Part], sim, tets: bool, view: tuple | None) -> Sdf.Layer:
    """The layer of everything that does not change; the same at any time of a run."""
    model = sim.model
    rubs = list(zip(*map(sim.scene.coefficients, ("friction", "restitution")), strict=True))
    x = np.concatenate([body.x for body in sim.scene.bodies]).astype(np.float32)
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    stage = Usd.Stage.Open(layer)
    stage.SetTimeCodesPerSecond(sim.fps)
    world = UsdGeom.Xform.Define(stage, "/World")
    Usd.ModelAPI(world).SetKind(Kind.Tokens.assembly)
    stage.SetDefaultPrim(world.GetPrim())
    UsdGeom.Scope.Define(stage, "/World/Looks")
    look = contact_look(stage)
    add_scene(stage, sim.scene)
    physics, local = Materials(stage, sim.scene.restitution > 0.0), x.copy()
    for part, label, body in zip(parts, model.labels, sim.scene.bodies, strict=True):
        xform = UsdGeom.Xform.Define(stage, part.path)
        Usd.ModelAPI(xform).SetKind(Kind.Tokens.component)
        note(xform, "label", Sdf.ValueTypeNames.String, label)
        note(xform, "body", Sdf.ValueTypeNames.Int, part.index)
        note(xform, "fixed", Sdf.ValueTypeNames.Bool, part.fixed)
        if part.is_rigid:
            local[slice(*part.verts)] = part.rest
            add_frame(xform, body, model.solids[part.index])
        add_surface(stage, part, local, look)
        if tets:
            mesh = add_tets(stage, part, model, local)
            add_body(xform, mesh, body, part.is_rigid)
            friction, bounce = rubs[part.index]
            physics.bind(mesh, friction, bounce, body.material)
    taken = {Sdf.Path(part.path).name for part in parts} | {*TAKEN}
    planes = zip(model.plane_n.numpy(), model.plane_h.numpy(), rubs[len(parts) :], strict=True)
    for n, h, both in planes:
        path = f"/World/{prim_name('ground', taken)}"
        physics.bind(add_plane(stage, path, n, float(h), x, look), *both)
    if view is not None:
        add_camera(stage, *view)
    return layer


def contact_look(stage) -> UsdShade.Material:
    """A material that shows displayColor."""
    material = UsdShade.Material.Define(stage, "/World/Looks/contact")
    reader = UsdShade.Shader.Define(stage, "/World/Looks/contact/color")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    surface = UsdShade.Shader.Define(stage, "/World/Looks/contact/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.6)
    color = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    color.ConnectToSource(reader.CreateOutput("result", Sdf.ValueTypeNames.Float3))
    out = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(out)
    return material


def add_mesh(stage, path: str, points: np.ndarray, faces: np.ndarray, look) -> UsdGeom.Mesh:
    """A polygon mesh without subdivision."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateFaceVertexCountsAttr(np.full(len(faces), faces.shape[1], dtype=np.int32))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel()))
    points = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, dtype=np.float32))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(look)
    return mesh


def add_surface(stage, part: Part, x: np.ndarray, look) -> None:
    """The surface of a body, with its primvars declared."""
    mesh = add_mesh(stage, part.surface, x[part.ids], part.faces, look)
    api, types = UsdGeom.PrimvarsAPI(mesh), Sdf.ValueTypeNames
    n = len(part.ids)
    colors = api.CreatePrimvar("displayColor", types.Color3fArray, UsdGeom.Tokens.vertex)
    colors.Set(Vt.Vec3fArray.FromNumpy(heated(part.color)))
    colors.SetIndices(Vt.IntArray(n))
    defaults = (
        ("contact:pressure", types.FloatArray, np.zeros(n, dtype=np.float32)),
        ("contact:penetration", types.FloatArray, np.zeros(n, dtype=np.float32)),
        ("contact:partner", types.IntArray, np.full(n, -1, dtype=np.int32)),
    )
    for name, kind, value in defaults:
        api.CreatePrimvar(name, kind, UsdGeom.Tokens.vertex).Set(value)


def add_tets(stage, part: Part, model, rest: np.ndarray) -> UsdGeom.TetMesh:
    """The TetMesh of a body."""
    b, (first, end) = part.index, part.verts
    tet, tri = model.body_tet.numpy(), model.body_tri.numpy()
    tets = model.tets.numpy().reshape(-1, 4)[tet[b] : tet[b + 1]] - first
    tris = model.tris.numpy().reshape(-1, 3)[tri[b] : tri[b + 1]] - first
    mesh = UsdGeom.TetMesh.Define(stage, f"{part.path}/sim")
    mesh.CreatePurposeAttr(UsdGeom.Tokens.guide)
    points = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rest[first:end]))
    mesh.CreatePointsAttr(points)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(np.ascontiguousarray(tets, np.int32)))
    mesh.CreateSurfaceFaceVertexIndicesAttr(
        Vt.Vec3iArray.FromNumpy(np.ascontiguousarray(tris, np.int32))
    )
    return mesh


def add_plane(stage, path: str, n: np.ndarray, h: float, x: np.ndarray, look) -> UsdGeom.Mesh:
    """A square on the boundary of the half-space n . x >= h, below the scene."""
    n = n / np.linalg.norm(n)
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    u /= np.linalg.norm(u)
    v = np.cross(n, u)
    low, high = x.min(0), x.max(0)
    middle, size = 0.5 * (low + high), ROOM * float(np.linalg.norm(high - low))
    middle = middle - (n @ middle - h) * n
    points = [middle + size * (s * u + t * v) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = add_mesh(stage, path, np.array(points), np.array([[0, 1, 2, 3]], dtype=np.int32), look)
    note(mesh, "normal", Sdf.ValueTypeNames.Vector3f, tuple(map(float, n)))
    note(mesh, "offset", Sdf.ValueTypeNames.Float, h)
    api = UsdGeom.PrimvarsAPI(mesh)
    color = api.CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.constant
    )
    color.Set([tuple(map(float, linear(GROUND)))])
    return mesh


def add_camera(stage, eye, target) -> None:
    """A camera at ``eye`` that looks at ``target``."""
    camera = UsdGeom.Camera.Define(stage, "/World/view")
    note(camera, "eye", Sdf.ValueTypeNames.Point3d, tuple(map(float, eye)))
    note(camera, "target", Sdf.ValueTypeNames.Point3d, tuple(map(float, target)))
    back = np.subtract(eye, target).astype(float)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.eye(3)[0]
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([[right, np.cross(back, right), back], np.zeros(3)])
    matrix[3, :3] = eye
    height = 2.0 * np.tan(np.radians(FOV) / 2.0) * 50.0
    camera.CreateFocalLengthAttr(50.0)
    camera.CreateVerticalApertureAttr(height)
    camera.CreateHorizontalApertureAttr(height * 16.0 / 9.0)
    camera.AddTransformOp().Set(Gf.Matrix4d(matrix.tolist()))
