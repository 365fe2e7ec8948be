"""Values of a USD stage in SI units with z up, and what of them nobody has read.

Runs in the program of ``reading.py``, as do the other files whose names begin so.
"""

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

SPACES = ("physics", "omniphysics", "physxDeformableBody", "physxDeformableBodyMaterial")
START = Usd.TimeCode.Default()
COLLIDER = "PhysicsCollisionAPI"


class Unfit(Exception):
    """What is wrong with a stage, in words for its user."""


class Reader:
    """A stage at one time.

    Attributes:
        stage: the stage
        prims: all of it, those of instances included
        time: the time code, None for the start
        length, kilograms: metres and kilograms per unit
        turn: to z up; it acts on row vectors, shape (3, 3)
        said: what was not read, or had to be assumed, in words
        seen: paths of the attributes and relationships that were read
    """

    def __init__(self, stage: Usd.Stage, at: str):
        """At ``start``, ``last`` or the time code of a frame."""
        self.stage = stage
        self.said: list[str] = []
        self.seen: set = set()
        self.time = None if at == "start" else self._frame(at)
        self.length, self.kilograms = self._unit("metersPerUnit"), self._unit("kilogramsPerUnit")
        self.turn = np.eye(3)
        if not stage.HasAuthoredMetadata("upAxis"):
            self.said.append("the stage does not say its upAxis: taken as Z")
        elif UsdGeom.GetStageUpAxis(stage) == "Y":
            self.turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        self.prims = list(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))

    def _frame(self, at: str) -> float:
        """The time code of the last frame, or of one that is given by its number."""
        if not self.stage.HasAuthoredTimeCodeRange():
            raise Unfit("does not say its startTimeCode and endTimeCode: only at='start' is known")
        first, last = self.stage.GetStartTimeCode(), self.stage.GetEndTimeCode()
        time = last if at == "last" else float(at)
        if not first <= time <= last:
            raise Unfit(f"has frames {first:g} to {last:g}, not {time:g}")
        return time

    def _unit(self, key: str) -> float:
        """Metres or kilograms per unit; a kilogram is usual."""
        if not self.stage.HasAuthoredMetadata(key):
            if key == "metersPerUnit":
                self.said.append("the stage does not say its metersPerUnit: taken as 1")
            return 1.0
        unit = self.stage.GetMetadata(key)
        if not (np.isfinite(unit) and unit > 0.0):
            raise Unfit(f"its {key} is {unit}: write a number above zero into it")
        return unit

    def rest(self, attribute):
        """The value that does not change with time, or else the earliest."""
        value = attribute.Get(START)
        return attribute.Get(Usd.TimeCode.EarliestTime()) if value is None else value

    def now(self, attribute):
        """The value at the time."""
        return self.rest(attribute) if self.time is None else attribute.Get(self.time)

    def rate(self, attribute, when):
        """The velocity that belongs to what was read at ``when``; None where it has none then."""
        own = attribute and (when == START or attribute.GetNumTimeSamples())
        return attribute.Get(when) if own else None

    def attribute(self, prim, name: str):
        """The authored attribute of a name in one of the name spaces, if there is one."""
        for space in SPACES:
            attribute = prim.GetAttribute(f"{space}:{name}") if prim else None
            if attribute and attribute.HasAuthoredValue():
                self.seen.add(attribute.GetPath())
                return attribute
        return None

    def physics(self, prim, name: str, usual=None):
        """The value of a constant; ``usual`` where none is given."""
        attribute = self.attribute(prim, name)
        value = None if attribute is None else self.rest(attribute)
        return usual if value is None else tidy(value)

    def targets(self, prim, name: str) -> list:
        """Paths that a relationship names."""
        for space in SPACES:
            relationship = prim.GetRelationship(f"{space}:{name}")
            if relationship:
                self.seen.add(relationship.GetPath())
                return relationship.GetTargets()
        return []

    def matrix(self, prim) -> tuple[np.ndarray, np.ndarray]:
        """From a prim to the world: x -> x @ A + t, in metres, shapes (3, 3) and (3,)."""
        place = np.eye(4)
        if prim.IsA(UsdGeom.Imageable):
            place = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(self.when(prim)))
        if not (place[:, 3] == (0.0, 0.0, 0.0, 1.0)).all() or not np.isfinite(place).all():
            raise Unfit(f"the transform of {prim.GetPath()} is not affine and finite")
        return self.length * place[:3, :3] @ self.turn, self.length * place[3, :3] @ self.turn

    def when(self, prim):
        """The time of its transform: at the start the earliest, if that has no constant value."""
        while self.time is None and prim.IsA(UsdGeom.Xformable):
            ops = UsdGeom.Xformable(prim).GetOrderedXformOps()
            if any(op.GetAttr().Get(START) is None for op in ops):
                return Usd.TimeCode.EarliestTime()
            prim = prim.GetParent()
        return START if self.time is None else self.time


def note(prim, name: str, usual=None):
    """What a ``UsdWriter`` says of a prim under ``userProperties``."""
    value = prim.GetAttribute(f"userProperties:{name}").Get() if prim else None
    return usual if value is None else tidy(value)


def tidy(value):
    """A value in Python's types; of a float32 the shortest number that rounds to it."""
    if isinstance(value, float):
        single = np.float32(value)  # compared as a float: NumPy would round the other one
        return float(str(single)) if float(single) == value else value
    if isinstance(value, str | bool | int):
        return value
    return [tidy(number) for number in np.array(value, dtype=float).tolist()]


def schemas(prim) -> set[str]:
    """Names of the schemas that are applied to a prim, those that USD does not know included."""
    listed = prim.GetMetadata("apiSchemas")
    return {*prim.GetAppliedSchemas(), *(listed.GetAppliedItems() if listed else ())}


def material_of(prim):
    """The prim of the material that is bound for physics, invalid where there is none."""
    return UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0].GetPrim()


def times(value, unit: float):
    """A value in SI units."""
    return value if value is None or unit == 1.0 else value * unit
