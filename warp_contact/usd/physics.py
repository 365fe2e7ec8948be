"""The physics of a scene in its USD file: what other engines and ``wc.Scene.from_usd`` read of it.

Names are those of UsdPhysics, and as bare tokens those of the proposal for deformable bodies. What
has no name there is a constant under ``userProperties``. All of it is written once.
"""

import numpy as np
from pxr import Gf, Sdf, UsdGeom, UsdPhysics, UsdShade, Vt

NOTES = ("damping", "distance", "area", "volume")  # of a material, without a standard name


def note(prim, name: str, kind, value) -> None:
    """Set a constant under ``userProperties``."""
    path = f"userProperties:{name}"
    prim.GetPrim().CreateAttribute(path, kind, True, Sdf.VariabilityUniform).Set(value)


def add_scene(stage, scene) -> None:
    """Gravity, and the friction and restitution of all that has none of its own."""
    prim = UsdPhysics.Scene.Define(stage, "/World/physics")
    g = np.array(scene.gravity)
    size = float(np.linalg.norm(g))
    down = (g / size).tolist() if size else (0.0, 0.0, -1.0)
    prim.CreateGravityDirectionAttr(Gf.Vec3f(*down))
    prim.CreateGravityMagnitudeAttr(size)
    note(prim, "friction", Sdf.ValueTypeNames.Double, scene.friction)
    if scene.restitution:
        note(prim, "restitution", Sdf.ValueTypeNames.Double, scene.restitution)


def add_frame(xform: UsdGeom.Xform, body, solid) -> None:
    """Let the prim of a rigid body be moved from where it starts.

    ``solid`` is what it weighs, None if it is fixed.
    """
    fixed = bool(body.fixed.all())
    translation, turn = placement(*body.pose)
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(translation)
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(turn)
    moves = UsdPhysics.RigidBodyAPI.Apply(xform.GetPrim())
    moves.CreateKinematicEnabledAttr(fixed)
    solid = solid or body.material.solid(body.mesh.vertices, body.mesh.tets)
    if body.v.any():
        centre = np.array(Gf.Matrix3d(turn)).T @ solid.centre + translation
        v, w = rigid_motion(body.x, body.v, centre)
        moves.CreateVelocityAttr(v)
        moves.CreateAngularVelocityAttr(w)
    weighs = UsdPhysics.MassAPI.Apply(xform.GetPrim())
    moments, axes = np.linalg.eigh(solid.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    turn = Gf.Matrix3d(axes.T.tolist()).ExtractRotation().GetQuat()
    weighs.CreateMassAttr(solid.mass)
    weighs.CreateCenterOfMassAttr(Gf.Vec3f(*solid.centre.tolist()))
    weighs.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
    weighs.CreatePrincipalAxesAttr(Gf.Quatf(turn))


def placement(place: np.ndarray, quaternion: np.ndarray) -> tuple[Gf.Vec3d, Gf.Quatd]:
    """A position [m] and a quaternion (x, y, z, w) as USD has them."""
    i, j, k, real = quaternion
    return Gf.Vec3d(*place.tolist()), Gf.Quatd(real, i, j, k)


def rigid_motion(x: np.ndarray, v: np.ndarray, at) -> tuple[Gf.Vec3f, Gf.Vec3f]:
    """Velocity [m/s] at a point and angular velocity [degrees/s] of vertices at ``x``, (n, 3)."""
    arms, mean = x - x.mean(axis=0), v.mean(axis=0)
    second = arms.T @ arms
    inertia = np.trace(second) * np.eye(3) - second
    w = np.linalg.solve(inertia, np.cross(arms, v - mean).sum(axis=0))
    here = mean + np.cross(w, np.array(at) - x.mean(axis=0))
    return Gf.Vec3f(*here.tolist()), Gf.Vec3f(*np.degrees(w).tolist())


def add_body(xform: UsdGeom.Xform, mesh: UsdGeom.TetMesh, body, is_rigid: bool) -> None:
    """What the prims of a body say of it; its materials are bound elsewhere."""
    types, prim = Sdf.ValueTypeNames, mesh.GetPrim()
    prim.AddAppliedSchema("PhysicsCollisionAPI")
    if body.world:
        note(xform, "world", types.Int, body.world)
    if is_rigid:
        return
    xform.GetPrim().AddAppliedSchema("PhysicsDeformableBodyAPI")
    prim.AddAppliedSchema("PhysicsVolumeDeformableSimAPI")
    if body.fixed.any() and not body.fixed.all():
        ids = np.flatnonzero(body.fixed).astype(np.int32)
        note(mesh, "fixedVertices", types.IntArray, Vt.IntArray.FromNumpy(ids))
    if body.v.any():
        mesh.CreateVelocitiesAttr(vectors(body.v))
    if body.start is not None:
        rest = prim.CreateAttribute("physics:restShapePoints", types.Point3fArray)
        rest.Set(mesh.GetPointsAttr().Get())
        mesh.GetPointsAttr().Set(vectors(body.start))
        mesh.GetExtentAttr().Set(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))


def vectors(values: np.ndarray) -> Vt.Vec3fArray:
    """Vectors, shape (n, 3), as USD has them."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))


class Materials:
    """Materials of a stage: each that bodies and planes share is written once."""

    def __init__(self, stage, bounces: bool):
        """Of a stage that has a scope ``/World/Looks``; ``bounces`` where 0 has to be said."""
        self._stage, self._bounces = stage, bounces
        self._known: dict[tuple, UsdShade.Material] = {}

    def bind(self, prim, friction: float, restitution: float, material=None) -> None:
        """Give a prim both coefficients, and what else a material says."""
        key = friction, restitution, repr(material)
        if key not in self._known:
            given = friction, restitution, material
            self._known[key] = self._define(f"physics_{len(self._known)}", *given)
        api = UsdShade.MaterialBindingAPI.Apply(prim.GetPrim())
        api.Bind(self._known[key], materialPurpose="physics")

    def _define(
        self, name: str, friction: float, restitution: float, material
    ) -> UsdShade.Material:
        types = Sdf.ValueTypeNames
        made = UsdShade.Material.Define(self._stage, f"/World/Looks/{name}")
        prim = made.GetPrim()
        api = UsdPhysics.MaterialAPI.Apply(prim)
        api.CreateStaticFrictionAttr(friction)
        api.CreateDynamicFrictionAttr(friction)
        if restitution or self._bounces:
            api.CreateRestitutionAttr(restitution)
        if material is None:
            return made
        note(prim, "model", types.String, type(material).__name__)
        if getattr(material, "density", None):
            api.CreateDensityAttr(float(material.density))
        for key in NOTES:
            if hasattr(material, key):
                note(prim, key, types.Double, float(getattr(material, key)))
        if hasattr(material, "youngs_modulus"):
            prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
            elastic = {"youngsModulus": material.youngs_modulus}
            elastic["poissonsRatio"] = material.poisson_ratio
            for key, value in elastic.items():
                prim.CreateAttribute(f"physics:{key}", types.Float).Set(float(value))
        return made
