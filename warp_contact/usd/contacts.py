"""Contacts in USD: points and arrows of force, of which each frame has another number.

/World/contacts  Points       where the last step had contacts; their forces as a primvar
/World/forces    BasisCurves  from each of them along its force
"""

import numpy as np
from pxr import Sdf, Usd, UsdGeom, Vt

from warp_contact import checks
from warp_contact.usd.physics import note, vectors

POINTS, ARROWS = "/World/contacts", "/World/forces"
WIDTH = 0.02  # of a point and an arrow, in sizes of a body
NOWHERE = Vt.Vec3fArray(2)  # extent of no points


class ContactArrows:
    """Contact points and arrows of a run.

    Attributes:
        scale: length of an arrow [m/N]; 0 before the first contact of a scene without gravity
    """

    def __init__(self, sim, scale: bool | float):
        """With a scale, or if True with one by which a body's weight has the size of a body."""
        first, free = sim.model.body_vert.numpy()[:-1], sim.model.inv_mass.numpy() > 0.0
        self.size = float(np.median([np.ptp(body.x, axis=0).max() for body in sim.scene.bodies]))
        self.scale = 0.0
        if scale is not True:
            self.scale = checks.positive(scale, "contacts, which may be True or False too,")
            return
        mass = np.add.reduceat(sim.model.mass.numpy() * free, first)
        weight = np.linalg.norm(sim.scene.gravity) * np.median(mass[mass > 0.0]) if any(mass) else 0
        if weight > 0.0:
            self.scale = float(self.size / weight)

    def define(self, topology: Sdf.Layer) -> None:
        """Add their prims to the layer of what does not change."""
        stage = Usd.Stage.Open(topology)
        points, arrows = (
            UsdGeom.Points.Define(stage, POINTS),
            UsdGeom.BasisCurves.Define(stage, ARROWS),
        )
        arrows.CreateTypeAttr(UsdGeom.Tokens.linear)
        arrows.CreateWrapAttr(UsdGeom.Tokens.nonperiodic)
        arrows.CreateCurveVertexCountsAttr(Vt.IntArray())
        for prim in points, arrows:
            note(prim, "contacts", Sdf.ValueTypeNames.Bool, True)
            prim.CreatePointsAttr(Vt.Vec3fArray())
            prim.CreateExtentAttr(NOWHERE)
            prim.CreateWidthsAttr([WIDTH * self.size])
            prim.SetWidthsInterpolation(UsdGeom.Tokens.constant)
            prim.CreateDisplayColorAttr([(0.05, 0.05, 0.05)])
        api, types = UsdGeom.PrimvarsAPI(points), Sdf.ValueTypeNames
        kinds = {"force": types.Vector3fArray, "body": types.IntArray, "partner": types.IntArray}
        for name, kind in kinds.items():
            api.CreatePrimvar(f"contact:{name}", kind, UsdGeom.Tokens.vertex)

    def types(self) -> dict[str, Sdf.ValueTypeName]:
        """The attributes that change, by their paths."""
        types = Sdf.ValueTypeNames
        return {
            f"{POINTS}.points": types.Point3fArray,
            f"{POINTS}.extent": types.Float3Array,
            f"{POINTS}.primvars:contact:force": types.Vector3fArray,
            f"{POINTS}.primvars:contact:body": types.IntArray,
            f"{POINTS}.primvars:contact:partner": types.IntArray,
            f"{ARROWS}.points": types.Point3fArray,
            f"{ARROWS}.extent": types.Float3Array,
            f"{ARROWS}.curveVertexCounts": types.IntArray,
        }

    def values(self, sim) -> tuple:
        """Their values now."""
        found = sim.contacts()
        force = found.normal_force[:, None] * found.normal + found.friction_force
        if self.scale == 0.0 and force.any():
            self.scale = self.size / float(np.linalg.norm(force, axis=1).max())
        ends = np.stack([found.point, found.point + self.scale * force], axis=1)
        at, line = vectors(found.point), vectors(ends.reshape(-1, 3))
        pair = (Vt.IntArray.FromNumpy(b.astype(np.int32, order="C")) for b in found.bodies.T)
        counts = Vt.IntArray(len(found), 2)
        return at, extent(at), vectors(force), *pair, line, extent(line), counts


def extent(points: Vt.Vec3fArray) -> Vt.Vec3fArray:
    """The box of points; a point at the origin for none."""
    return UsdGeom.PointBased.ComputeExtent(points) if points else NOWHERE
