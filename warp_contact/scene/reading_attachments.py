"""What holds the bodies of a USD stage: joints of rigid ones, attachments of those that deform."""

import numpy as np
from pxr import Gf, Usd

from warp_contact.scene.reading_stage import Reader, note, times

JOINTS = {
    "PhysicsFixedJoint": "weld",
    "PhysicsSphericalJoint": "ball",
    "PhysicsRevoluteJoint": "hinge",
    "PhysicsPrismaticJoint": "slider",
}
PINS = {"PhysicsAttachment", "PhysicsVtxXformAttachment", "OmniPhysicsVtxXformAttachment"}
ENDLESS = 1e18  # force [N] from which a joint is one that never breaks
APART = 1e-3  # how far places, of the size of a body, and directions of its two sides may differ


class Unheld(Exception):
    """Why an attachment cannot be read, in words."""


def held(reader: Reader, bodies: list[dict], arrays: dict, moving) -> list[dict]:
    """The attachments of a stage; ``bodies`` with their ``arrays`` are what it holds.

    ``moving`` says of a path whether a body that moves is there. Vertices that others hold where
    nothing moves are added to the ``held`` ones of their body.
    """
    found = []
    for prim in reader.prims:
        kind = str(prim.GetTypeName())
        if kind not in JOINTS and kind not in PINS:
            continue
        stage = Stage(reader, prim, bodies, arrays, moving)
        try:
            made = stage.joint(JOINTS[kind]) if kind in JOINTS else stage.attachment()
            if made and made["a"] is None:
                raise Unheld("which holds no body")
        except Unheld as reason:
            reader.said.append(f"{kind}: {prim.GetPath()}, {reason}")
            made = None
        if not made:  # nor any of its attributes
            reader.seen |= {p.GetPath() for p in prim.GetAuthoredProperties()}
        else:
            names = {"path": str(prim.GetPath()), "label": note(prim, "label", prim.GetName())}
            found.append(names | made)
    return found


class Stage:
    """A prim that holds bodies, among all that it may hold."""

    def __init__(self, reader: Reader, prim: Usd.Prim, bodies: list[dict], arrays: dict, moving):
        """See ``held``."""
        self.reader, self.prim, self.bodies, self.arrays = reader, prim, bodies, arrays
        self.moving = moving
        self.is_own = note(prim, "label") is not None  # of a UsdWriter

    def joint(self, kind: str) -> dict | None:
        """A joint between rigid bodies, or at the world; None where it does not hold any more."""
        if not self._is_enabled("jointEnabled"):
            return None
        if self.reader.physics(self.prim, "collisionEnabled", False):
            raise Unheld("whose bodies touch each other: here they do not")
        ends = [self._end(f"body{k}") for k in (0, 1)]
        if any(k is not None and not self.bodies[k]["rigid"] for k, _ in ends):
            raise Unheld("which names a body that deforms: attachments hold such")
        axis = "XYZ".index(self.reader.physics(self.prim, "axis", "X"))
        frames = [self._frame(k, ends[k][1]) for k in (0, 1)]
        force = times(self.reader.physics(self.prim, "breakForce"), self._force)
        made = {"kind": kind, "stiffness": note(self.prim, "stiffness"), "breaking_force": force}
        if force is not None and not force < ENDLESS:
            made["breaking_force"] = None
        if self.is_own and None not in (note(self.prim, f"points{k}") for k in (0, 1)):
            return made | self._own(ends)
        if ends[1][0] is None:
            ends, frames = ends[::-1], frames[::-1]
        (b, _), (a, _) = ends
        if a is None:
            raise Unheld("which holds no body")
        self._check_frames(kind, frames, axis, np.ptp(self.arrays[f"{a}.vertices"], axis=0).max())
        place, turn = frames[1]
        line = turn[axis].tolist() if kind in ("hinge", "slider") else None
        at = None if kind == "weld" else place.tolist()
        return made | {"a": a, "b": b, "at": at, "axis": line}

    def _own(self, ends: list) -> dict:
        """Sites and direction of a joint of a ``UsdWriter``, as its notes say."""
        sites, line = [], note(self.prim, "axis")
        for k in (0, 1):
            a, t = ends[k][1]
            sites.append({"points": (np.array(note(self.prim, f"points{k}")) @ a + t).tolist()})
        if note(self.prim, "vertices"):
            sites[1] = {"vertices": list(map(int, note(self.prim, "vertices")))}
        if line is not None:
            line = line @ ends[0][1][0]
            line = (line / np.linalg.norm(line)).tolist()
        sides = {"a": ends[1][0], "b": ends[0][0], "first": sites[1], "second": sites[0]}
        return sides | {"axis": line}

    def attachment(self) -> dict | None:
        """One of a body that deforms; None where it does not hold any more, or holds vertices."""
        if not self._is_enabled("attachmentEnabled"):
            return None
        (a, _), (b, frame) = (self._end(f"src{k}") for k in (0, 1))
        if a is None or self.bodies[a]["rigid"]:
            raise Unheld("which holds no body that deforms")
        first, second = self._site(0, a, None), self._site(1, b, frame)
        if b is None and not self.is_own:
            self._pin(a, first)
            return None
        n = len(first.get("vertices", first.get("tets", ())))
        if "points" in second and len(second["points"]) != n:
            raise Unheld("which does not say where its vertices are held")
        if n == 2 or not n:
            raise Unheld(f"which holds {n} points: here it is one, or three and more")
        if not self.is_own:
            self._check_places(a, first, second)
        stiffness = note(self.prim, "stiffness")
        each = self.reader.physics(self.prim, "stiffness")
        if stiffness is None and each is not None and np.isfinite(each):
            stiffness = n * times(each, self._force / self.reader.length)
        if note(self.prim, "isSwapped"):
            a, b, first, second = b, a, second, first
        sides = {"a": a, "b": b, "first": first, "second": second, "axis": None}
        limits = {"stiffness": stiffness, "breaking_force": note(self.prim, "breakForce")}
        return sides | limits | {"kind": "ball" if n == 1 else "weld"}

    @property
    def _force(self) -> float:
        """Newtons per unit."""
        return self.reader.kilograms * self.reader.length

    def _is_enabled(self, name: str) -> bool:
        """Whether it holds at the time; says so where it never did."""
        attribute = self.reader.attribute(self.prim, name)
        enabled = attribute is None or self.reader.now(attribute)
        if not enabled and not attribute.GetNumTimeSamples():
            raise Unheld("which is not enabled")
        return bool(enabled)

    def _end(self, name: str) -> tuple:
        """The body that a relationship names, None for the world, and its frame, as ``matrix``."""
        paths = self.reader.targets(self.prim, name)
        prim = self.reader.stage.GetPrimAtPath(paths[0]) if paths else None
        if not paths:
            return None, (self.reader.length * self.reader.turn, np.zeros(3))
        if not prim:
            raise Unheld(f"which names {paths[0]}: there is none")
        for path in reversed(prim.GetPath().GetPrefixes()):
            for k, body in enumerate(self.bodies):
                if str(path) in (body["path"], *body["tets"]):
                    owner = self.reader.stage.GetPrimAtPath(body["path"])
                    return k, self.reader.matrix(owner if body["rigid"] else prim)
            if self.moving(path):
                raise Unheld(f"which names {path}: it was not read")
        return None, self.reader.matrix(prim)

    def _frame(self, k: int, frame: tuple) -> tuple[np.ndarray, np.ndarray]:
        """Place [m] and axes, as rows, of a side of a joint in the world."""
        a, t = frame
        place = np.array(self.reader.physics(self.prim, f"localPos{k}", (0.0, 0.0, 0.0)))
        rotation = self.reader.attribute(self.prim, f"localRot{k}")
        turn = Gf.Quatd(rotation.Get()) if rotation else Gf.Quatd(1.0)
        axes = np.array(Gf.Matrix3d(turn)) @ a
        return place @ a + t, axes / np.linalg.norm(axes, axis=1)[:, None]

    def _check_frames(self, kind: str, frames: list, axis: int, size: float) -> None:
        """Raise Unheld where a joint would have to pull its bodies into another place."""
        (p, r), (q, s) = frames
        off = q - p
        if kind == "slider":
            off = off - (off @ s[axis]) * s[axis]
        rows = {"ball": [], "hinge": [axis]}.get(kind, [0, 1, 2])
        if np.linalg.norm(off) > APART * size or np.abs(r - s)[rows].max(initial=0.0) > APART:
            raise Unheld("whose two frames are not in the same place")

    def _site(self, k: int, body: int | None, frame: tuple | None) -> dict:
        """Points on one side: numbers of vertices, weights in tets, or places in the world [m]."""
        read = self.reader.physics
        kind = read(self.prim, f"type{k}", "xform" if k else "point")
        indices = read(self.prim, f"indices{k}") or read(self.prim, f"vtxIndicesSrc{k}")
        coords = read(self.prim, f"coords{k}") or read(self.prim, f"localPositionsSrc{k}") or []
        ids = list(map(int, indices or ()))
        deforms = body is not None and not self.bodies[body]["rigid"]
        if deforms and kind in ("point", "vertex") and ids:
            return {"vertices": ids}
        if deforms and kind == "tetrahedron" and ids and self.is_own:
            return {"tets": ids, "coords": coords}
        if k and not deforms and kind == "xform":
            a, t = frame
            return {"points": (np.array(coords).reshape(-1, 3) @ a + t).tolist()}
        raise Unheld(f"whose side {k} is not understood")

    def _pin(self, body: int, site: dict) -> None:
        """Vertices of a body are held where nothing moves."""
        key, chosen = f"{body}.held", np.array(site["vertices"], dtype=np.int64)
        self.arrays[key] = np.unique(np.concatenate([self.arrays.get(key, chosen), chosen]))

    def _check_places(self, body: int, first: dict, second: dict) -> None:
        """Raise Unheld where vertices are not where they would be held."""
        x = self.arrays.get(f"{body}.start", self.arrays[f"{body}.vertices"])
        ids = np.array(first["vertices"])
        if ids.max() >= len(x) or ids.min() < 0:
            raise Unheld("which names vertices that there are not")
        off = np.abs(x[ids] - np.array(second["points"])).max()
        if off > APART * np.ptp(x, axis=0).max():
            raise Unheld("whose vertices are not where they are held")
