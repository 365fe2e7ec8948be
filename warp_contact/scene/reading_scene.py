"""The scene of a USD stage, and its bodies.

Names are those of UsdPhysics, of the proposal for deformable bodies (``PhysicsDeformableBodyAPI``
and its kin), of its forms by NVIDIA (``omniphysics:``, ``physxDeformableBody...:``), and what a
``UsdWriter`` adds under ``userProperties``.
"""

import json

import numpy as np
from pxr import Gf, Usd, UsdGeom

from warp_contact.scene.reading_attachments import held
from warp_contact.scene.reading_others import list_others
from warp_contact.scene.reading_stage import (
    COLLIDER,
    START,
    Reader,
    Unfit,
    material_of,
    note,
    schemas,
    tidy,
    times,
)
from warp_contact.scene.reading_surroundings import coefficients_of, half_spaces, surroundings

SOFT = {"PhysicsDeformableBodyAPI", "OmniPhysicsDeformableBodyAPI", "PhysxDeformableBodyAPI"}
SIM = {"PhysicsVolumeDeformableSimAPI", "OmniPhysicsVolumeDeformableSimAPI"}
RIGID = "PhysicsRigidBodyAPI"
NOTES = ("model", "damping", "distance", "area", "volume")  # of a material, by a UsdWriter
LAST = 1 << 30  # behind all bodies that a UsdWriter has numbered


def read(stage: Usd.Stage, at: str) -> dict[str, np.ndarray]:
    """The scene at ``start``, ``last`` or the time code of a frame.

    ``scene`` is a JSON text. Body k has arrays ``k.vertices`` (n, 3) [m] at rest, ``k.tets`` (m, 4)
    and, where they are there, ``k.start`` and ``k.v`` (n, 3) [m], [m/s], ``k.held`` (ids).
    """
    reader, bodies = Reader(stage, at), []
    arrays: dict[str, np.ndarray] = {}
    for k, (owner, tets) in enumerate(grouped(reader)):
        kind = rigid if is_rigid(reader, owner) else soft
        info, own = kind(reader, owner, tets)
        bodies.append(info)
        arrays |= {f"{k}.{name}": value for name, value in own.items() if value is not None}
    found = held(reader, bodies, arrays, lambda path: is_body(reader, path))
    scene: dict = {"attachments": found}
    scene |= {"bodies": bodies, "planes": half_spaces(reader)} | surroundings(reader)
    bare = [b["path"] for b in [*bodies, *scene["planes"]] if b["friction"] is None]
    if bare and scene["friction"] is None:
        reader.said.append(f"no friction of {named(bare)}: that of the scene")
    scene["only_seen"] = list_others(reader, [b["tets"] for b in bodies])
    scene["not_read"] = reader.said
    return arrays | {"scene": np.array(json.dumps(scene))}


def named(paths: list[str]) -> str:
    """Some prims in short."""
    return paths[0] if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"


def grouped(reader: Reader) -> list[tuple]:
    """Bodies with their TetMeshes: as numbered by a UsdWriter, or else as the stage has them."""
    groups: dict = {}
    for prim in reader.prims:
        if prim.IsA(UsdGeom.TetMesh):
            above = prim
            while above and not above.IsPseudoRoot() and not {RIGID, *SOFT} & schemas(above):
                above = above.GetParent()
            owner = prim if not above or above.IsPseudoRoot() else above
            if reader.physics(owner, "deformableBodyEnabled", True):
                groups.setdefault(owner.GetPath(), (owner, []))[1].append(prim)
            else:
                reader.said.append(f"{owner.GetPath()} is not enabled")
    if not groups:
        raise Unfit("holds no TetMesh: bodies are of tets")
    return sorted(groups.values(), key=lambda group: note(group[0], "body", LAST))


def is_rigid(reader: Reader, owner) -> bool:
    """Whether a body is rigid, as is a TetMesh that only collides: it has no elasticity."""
    found = schemas(owner)
    if RIGID in found:
        return True
    elastic = reader.attribute(material_of(owner), "youngsModulus")
    return COLLIDER in found and not (SOFT | SIM) & found and elastic is None


def common(reader: Reader, owner, prim) -> dict:
    """What bodies of any kind have; ``prim`` is the TetMesh."""
    look, m, d = material_of(prim), reader.kilograms, reader.length
    values = {
        "path": str(owner.GetPath()),
        "tets": [str(prim.GetPath())],
        "label": note(owner, "label", owner.GetName()),
        "world": note(owner, "world", 0),
        "fixed": bool(reader.physics(owner, "kinematicEnabled") or note(owner, "fixed")),
        "density": times(given(reader, (owner, prim, look), "density"), m / d**3),
        "mass": times(given(reader, (owner, prim), "mass"), m),
        "youngs_modulus": times(reader.physics(look, "youngsModulus"), m / d),
        "poisson_ratio": reader.physics(look, "poissonsRatio"),
    }
    return values | coefficients_of(reader, look) | {name: note(look, name) for name in NOTES}


def given(reader: Reader, prims: tuple, name: str):
    """The first number that is not zero, by which USD means none."""
    found = [reader.physics(prim, name) for prim in dict.fromkeys(prims)]
    return next((value for value in found if value), None)


def soft(reader: Reader, owner, tets: list) -> tuple[dict, dict]:
    """A body that deforms, with its shape at rest where it is placed."""
    prim = next((p for p in tets if SIM & schemas(p)), tets[0])
    for other in tets:
        if other != prim:
            line = (
                f"TetMesh {other.GetPath()}: {prim.GetPath()} is simulated, and its surface touches"
            )
            reader.said.append(line)
    info, mesh = common(reader, owner, prim) | {"rigid": False}, UsdGeom.TetMesh(prim)
    points, surface = mesh.GetPointsAttr(), owner.GetChild(owner.GetName())
    frames = surface and surface.GetAttribute("points").GetNumTimeSamples()
    if reader.time is not None and frames and not points.GetNumTimeSamples():
        wanted = "UsdWriter(animate_tets=True, velocities=True) writes them; at='start' needs none"
        raise Unfit(f"{info['path']} has no frames of its inner vertices: {wanted}")
    shape, (a, t) = reader.attribute(prim, "restShapePoints"), reader.matrix(prim)
    x, start = (placed(y, a, t, prim) for y in (reader.rest(shape or points), reader.now(points)))
    if x.shape != start.shape:
        raise Unfit(f"{prim.GetPath()} has {len(start)} points and {len(x)} at rest")
    when = START if points.Get(START) else Usd.TimeCode.EarliestTime()
    v = reader.rate(mesh.GetVelocitiesAttr(), when if reader.time is None else reader.time)
    tell_of_motion(reader, info, v is not None, points.Get)
    return info, {
        "vertices": x,
        "tets": ids_of(reader, prim),
        "start": start if (x != start).any() else None,
        "v": np.array(v, dtype=float) @ a if v else None,
        "held": ids(prim.GetAttribute("userProperties:fixedVertices").Get()),
    }


def rigid(reader: Reader, owner, tets: list) -> tuple[dict, dict]:
    """A body that keeps its shape, of one TetMesh or more, in its own frame."""
    info = common(reader, owner, tets[0]) | {
        "rigid": True,
        "tets": [str(p.GetPath()) for p in tets],
    }
    free = RIGID in schemas(owner) and reader.physics(owner, "rigidBodyEnabled", True)
    info["fixed"] = info["fixed"] or not free
    a, t = reader.matrix(owner)
    stretch, turn = split(a)
    cache, x, cells, n = UsdGeom.XformCache(), [], [], 0
    for prim in tets:
        own = np.array(cache.ComputeRelativeTransform(prim, owner)[0])
        points = reader.rest(UsdGeom.TetMesh(prim).GetPointsAttr())
        x.append(placed(points, own[:3, :3], own[3, :3], prim) @ stretch)
        cells.append(ids_of(reader, prim) + n)
        n += len(x[-1])
    info |= {"position": t.tolist(), "rotation": turn.T.tolist()}
    centre = reader.physics(owner, "centerOfMass")
    if centre is not None and np.isfinite(centre).all():
        info["centre"] = (np.array(centre) @ stretch).tolist()
    info["inertia"] = inertia_of(reader, owner)
    parent = reader.matrix(owner.GetParent())[0]
    spin = np.radians(split(parent)[1])
    for name, frame in ("velocity", parent), ("angularVelocity", spin):
        attribute = reader.attribute(owner, name)
        value = reader.rate(attribute, reader.when(owner))
        info[name] = None if value is None else (np.array(value, dtype=float) @ frame).tolist()
    known, place = info["velocity"] is not None, UsdGeom.Xformable(owner).GetLocalTransformation
    tell_of_motion(reader, info, known, place)
    return info, {"vertices": np.concatenate(x), "tets": np.concatenate(cells)}


def tell_of_motion(reader: Reader, info: dict, known: bool, place) -> None:
    """Say which motion is not read: velocities at a frame, and that of what follows no forces."""
    first, last = reader.stage.GetStartTimeCode(), reader.stage.GetEndTimeCode()
    if first == last or np.array_equal(place(first), place(last)):
        return
    if info["fixed"]:
        reader.said.append(f"the motion of {info['path']}, which is driven: it stands still")
    elif reader.time is not None and not known:
        reader.said.append(f"no velocities of {info['path']} at {reader.time:g}: it is at rest")


def split(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A matrix that acts on row vectors as a stretch, mirrored or not, and a rotation after it."""
    u, _, vt = np.linalg.svd(a)
    turn = u @ vt
    turn *= np.sign(np.linalg.det(turn))
    stretch = a @ turn.T
    # Rounding is taken out of a matrix that only turns.
    return (np.eye(3) if np.abs(stretch - np.eye(3)).max() < 1e-12 else stretch), turn


def inertia_of(reader: Reader, owner) -> list | None:
    """Moments about the centre in the frame of the body [kg m^2], shape (3, 3)."""
    moments, axes = (reader.attribute(owner, k) for k in ("diagonalInertia", "principalAxes"))
    if moments is None or not any(reader.rest(moments)):
        return None
    turn, quaternion = np.eye(3), axes and reader.rest(axes)
    if quaternion and quaternion.GetLength() > 0.0:
        turn = np.array(Gf.Matrix3d(Gf.Quatd(quaternion.GetNormalized())))
    size = reader.kilograms * reader.length**2
    return (size * turn.T @ np.diag(tidy(reader.rest(moments))) @ turn).tolist()


def placed(points, a: np.ndarray, t: np.ndarray, prim) -> np.ndarray:
    """Points moved by a matrix and a translation, shape (n, 3)."""
    x = np.array(points, dtype=float)
    if x.ndim != 2 or not x.size:
        raise Unfit(f"the TetMesh {prim.GetPath()} has no points")
    with np.errstate(over="ignore", invalid="ignore"):
        return x @ a + t


def ids_of(reader: Reader, prim) -> np.ndarray:
    """The tets of a TetMesh, shape (m, 4)."""
    tets = np.array(reader.rest(UsdGeom.TetMesh(prim).GetTetVertexIndicesAttr()))
    if tets.ndim != 2 or not tets.size:
        raise Unfit(f"the TetMesh {prim.GetPath()} has no tets")
    return tets


def ids(value) -> np.ndarray | None:
    """Numbers of vertices, None for none."""
    return np.array(value, dtype=np.int64) if value else None


def is_body(reader: Reader, path) -> bool:
    """Whether a prim is a body that moves."""
    return bool({RIGID, *SOFT} & schemas(reader.stage.GetPrimAtPath(path)))
