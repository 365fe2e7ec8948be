"""The attachments of a scene in its USD file, and which of them hold in a frame.

Between rigid bodies, or one and the world, they are joints of UsdPhysics: ``body0`` is what holds,
``body1`` what is held. Where a body deforms they are attachments of the proposal for deformable
bodies: sites are vertices (``point``), weights in tets (``tetrahedron``), or places (``xform``).
What has no name there is a constant under ``userProperties``.
"""

from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, Vt

from warp_contact.usd.physics import note, vectors
from warp_contact.usd.prims import Part, prim_name

SCOPE = "/World/attachments"
JOINTS = {
    "weld": UsdPhysics.FixedJoint,
    "ball": UsdPhysics.SphericalJoint,
    "hinge": UsdPhysics.RevoluteJoint,
    "slider": UsdPhysics.PrismaticJoint,
}


class Attachments:
    """Some of a simulation, by the paths of the attributes that say whether they hold."""

    def __init__(self, parts: list[Part], attachments):
        """Name the prims."""
        self.parts, self.flags = parts, dict[str, Any]()
        taken: set[str] = set()
        for attachment in attachments:
            path = f"{SCOPE}/{prim_name(attachment.label, taken)}"
            name = "jointEnabled" if self._is_joint(attachment) else "attachmentEnabled"
            self.flags[f"{path}.physics:{name}"] = attachment

    def types(self) -> dict[str, Sdf.ValueTypeName]:
        """The attributes of a frame."""
        return dict.fromkeys(self.flags, Sdf.ValueTypeNames.Bool)

    def values(self, sim) -> list[bool]:
        """Their values: what broke or was let go is not enabled."""
        return [sim.is_attached(attachment) for attachment in self.flags.values()]

    def define(self, layer: Sdf.Layer) -> None:
        """Write all that does not change."""
        if not self.flags:
            return
        stage = Usd.Stage.Open(layer)
        UsdGeom.Scope.Define(stage, SCOPE)
        for flag, attachment in self.flags.items():
            path = Sdf.Path(flag).GetPrimPath()
            add = self._add_joint if self._is_joint(attachment) else self._add_attachment
            prim = add(stage, path, attachment)
            prim.CreateAttribute(Sdf.Path(flag).name, Sdf.ValueTypeNames.Bool, False).Set(True)
            note(prim, "label", Sdf.ValueTypeNames.String, attachment.label)
            if attachment.stiffness is not None:
                note(prim, "stiffness", Sdf.ValueTypeNames.Double, attachment.stiffness)

    def _is_joint(self, attachment) -> bool:
        """Whether none of its bodies deforms."""
        both = [body for body in (attachment.a, attachment.b) if body is not None]
        return all(self.parts[body.index].is_rigid for body in both)

    def _add_joint(self, stage, path, attachment):
        types, a, b = Sdf.ValueTypeNames, attachment.a, attachment.b
        joint = JOINTS[attachment.kind].Define(stage, path)
        joint.CreateBody1Rel().SetTargets([self.parts[a.index].path])
        if b is not None:
            joint.CreateBody0Rel().SetTargets([self.parts[b.index].path])
        joint.CreateBreakForceAttr(attachment.breaking_force or np.inf)
        points, line = attachment.points, line_of(attachment)
        turn = Gf.Rotation(Gf.Vec3d.XAxis(), Gf.Vec3d(*line.tolist())).GetQuat()
        ways = (joint.CreateLocalPos0Attr, joint.CreateLocalRot0Attr, "points0", b)
        others = (joint.CreateLocalPos1Attr, joint.CreateLocalRot1Attr, "points1", a)
        for place, rotation, name, body in (ways, others):
            own = local(points, body)
            place(Gf.Vec3f(*own.mean(axis=0).tolist()))
            rotation(Gf.Quatf(frame_of(body)[1].GetInverse() * turn))
            note(joint, name, types.Double3Array, Vt.Vec3dArray.FromNumpy(own))
        if attachment.kind in ("hinge", "slider"):
            joint.CreateAxisAttr(UsdPhysics.Tokens.x)
            own = local(line[None], b, direction=True)[0]
            note(joint, "axis", types.Vector3d, Gf.Vec3d(*own.tolist()))
        ids = vertices_of(attachment.verts[:, :4], attachment.weights[:, :4])
        if ids is not None:
            note(joint, "vertices", types.IntArray, Vt.IntArray.FromNumpy(ids))
        return joint.GetPrim()

    def _add_attachment(self, stage, path, attachment):
        """Its first source is a body that deforms: b, if a does not."""
        types, prim = Sdf.ValueTypeNames, stage.DefinePrim(path, "PhysicsAttachment")
        ends = [(attachment.a, slice(0, 4)), (attachment.b, slice(4, 8))]
        if self.parts[attachment.a.index].is_rigid:
            note(prim, "isSwapped", types.Bool, True)
            ends.reverse()
        for k, (body, columns) in enumerate(ends):
            part = self.parts[body.index] if body is not None else None
            verts = attachment.verts[:, columns], np.abs(attachment.weights[:, columns])
            site = self._site(part, body, *verts, attachment.points)
            if part:
                source = f"{part.path}/sim" if not part.is_rigid else part.path
                prim.CreateRelationship(f"physics:src{k}", False).SetTargets([source])
            for name, kind, value in zip(("type", "indices", "coords"), SITE, site, strict=True):
                if value is not None:
                    prim.CreateAttribute(f"physics:{name}{k}", kind, False).Set(value)
        if attachment.stiffness is not None:
            each = attachment.stiffness / len(attachment.points)
            prim.CreateAttribute("physics:stiffness", types.Float, False).Set(each)
        if attachment.breaking_force is not None:
            note(prim, "breakForce", types.Double, attachment.breaking_force)
        return prim

    def _site(self, part, body, verts, weights, points) -> tuple:
        """Type, indices and coordinates of the points on one body, or in the world."""
        if part is None or part.is_rigid:
            return "xform", None, vectors(local(points, body))
        ids = vertices_of(verts, weights)
        if ids is not None:
            return "point", Vt.IntArray.FromNumpy(ids), None
        tets = [int((body.mesh.tets == row).all(axis=1).argmax()) for row in verts]
        return "tetrahedron", Vt.IntArray(tets), vectors(weights[:, :3])


SITE = Sdf.ValueTypeNames.Token, Sdf.ValueTypeNames.IntArray, Sdf.ValueTypeNames.Vector3fArray


def vertices_of(verts: np.ndarray, weights: np.ndarray) -> np.ndarray | None:
    """Ids of points that are vertices themselves, int32 (n,); None for those within tets."""
    alone = (weights == (1.0, 0.0, 0.0, 0.0)).all() and (verts == verts[:, :1]).all()
    return verts[:, 0].astype(np.int32) if alone else None


def line_of(attachment) -> np.ndarray:
    """Direction of a hinge or a slider, where it starts; of others that of x, shape (3,)."""
    p = attachment.points
    line = p[1] - p[0] if attachment.kind in ("hinge", "slider") else np.array([1.0, 0.0, 0.0])
    return line / np.linalg.norm(line)


def frame_of(body) -> tuple[np.ndarray, Gf.Quatd]:
    """Where the mesh of a body starts [m], and how it is turned; the world for None."""
    if body is None:
        return np.zeros(3), Gf.Quatd(1.0)
    place, (i, j, k, real) = body.pose
    return place, Gf.Quatd(float(real), float(i), float(j), float(k))


def local(points: np.ndarray, body, direction: bool = False) -> np.ndarray:
    """Points [m] of the world, or directions, in the frame of a body, shape (n, 3)."""
    place, turn = frame_of(body)
    return (points - (0.0 if direction else place)) @ np.array(Gf.Matrix3d(turn)).T
