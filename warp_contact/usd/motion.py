"""How the motion of a body is written: by its points, or by where its frame is if it is rigid."""

import numpy as np
from pxr import Gf, Sdf, UsdGeom, Vt

from warp_contact.usd.physics import placement, rigid_motion, vectors
from warp_contact.usd.prims import Part

TRANSLATE, ORIENT = "xformOp:translate", "xformOp:orient"
VELOCITIES = ("physics:velocity", "physics:angularVelocity")  # [m/s], [degrees/s]
BENT = 1e-3  # of the size of a rigid body: how far its vertices may be from its shape


def motion_types(part: Part) -> dict[str, Sdf.ValueTypeName]:
    """The attributes that hold the motion of a body, by their paths."""
    types, surface = Sdf.ValueTypeNames, f"{part.surface}."
    if part.is_rigid:
        return {f"{part.path}.{TRANSLATE}": types.Double3, f"{part.path}.{ORIENT}": types.Quatd}
    return {surface + "points": types.Point3fArray, surface + "extent": types.Float3Array}


def motion(part: Part, sim, x: np.ndarray) -> tuple:
    """Their values at the positions ``x`` [m] of all vertices, float32 (n_vert, 3).

    Raises:
        ValueError: a body that is rigid, and fixed, was driven out of its shape
    """
    if part.is_rigid:
        return pose(part, sim, x)
    points = Vt.Vec3fArray.FromNumpy(x[part.ids])
    return points, UsdGeom.PointBased.ComputeExtent(points)


def velocity_types(part: Part, model, tets: bool) -> dict[str, Sdf.ValueTypeName]:
    """The attributes that hold the velocities of a body, of its ``tets`` too, by their paths."""
    types = Sdf.ValueTypeNames
    if part.is_rigid:
        names = VELOCITIES if model.solids[part.index] else ()
        return {f"{part.path}.{name}": types.Vector3f for name in names}
    meshes = (part.surface, f"{part.path}/sim")[: 1 + tets]
    return {f"{mesh}.velocities": types.Vector3fArray for mesh in meshes}


def velocities(part: Part, sim, x: np.ndarray, v: np.ndarray, tets: bool) -> tuple:
    """Their values, of positions ``x`` [m] and velocities ``v`` [m/s], (n_vert, 3)."""
    own = slice(*part.verts)
    if not part.is_rigid:
        return vectors(v[part.ids]), *((vectors(v[own]),) if tets else ())
    if solid := sim.model.solids[part.index]:
        translation, turn = placement(*sim.pose(part.index))
        centre = np.array(Gf.Matrix3d(turn)).T @ solid.centre + translation
        return rigid_motion(x[own].astype(float), v[own].astype(float), centre)
    return ()


def pose(part: Part, sim, x: np.ndarray) -> tuple[Gf.Vec3d, Gf.Quatd]:
    """Where the frame of a rigid body is: x = R rest + translation."""
    place, quaternion = sim.pose(part.index)
    translation, turn = placement(place, quaternion)
    turned = part.rest @ np.array(Gf.Matrix3d(turn))  # which acts on row vectors
    off = np.abs(turned + place - x[slice(*part.verts)]).max()
    if off > BENT * np.ptp(part.rest, axis=0).max():
        name, frame = sim.model.labels[part.index], sim.frame
        raise ValueError(
            f"body '{name}' is rigid, but what drives it has moved vertices by {off:.3g} m out of "
            f"its shape at frame {frame}: let its targets turn it, or choose another material"
        )
    return translation, turn


def numbers(value) -> np.ndarray:
    """The numbers of a value as it is written."""
    if isinstance(value, Gf.Quatd):
        return np.array([value.GetReal(), *value.GetImaginary()])
    return np.atleast_1d(value)
