"""Methods with their knobs: as many settings of each as the budget of the chart allows."""

from dataclasses import dataclass

import warp_contact as wc
from engines.task import Task

STIFFNESSES = 0.01, 0.1, 1.0, 10.0, 100.0  # of that of the task


@dataclass(frozen=True)
class Own:
    """A response of this package at one setting."""

    method: str
    search: str = ""  # of a contact surface; empty for other responses
    iterations: int = 4  # of that search
    factor: int = 1  # substeps over those that the simulation takes by itself; 1 leaves it to it
    times: float = 0.0  # stiffness of a penalty over that of the task; 0 for other responses
    surfaces: bool = True  # are moved; False leaves the contact to the impulses

    def __str__(self):
        """The knobs."""
        if self.times:
            return f"stiffness x{self.times:g}, steps x{self.factor}"
        if self.search and self.surfaces:
            return f"iterations {self.iterations}, steps x{self.factor}"
        return f"steps x{self.factor}"

    def response(self, task: Task):
        """For a task; the damping of a penalty keeps its ratio."""
        if self.times:
            return wc.Penalty(self.times * task.stiffness, self.times**0.5 * task.damping)
        if not self.search:
            return wc.PredictedForce()
        return wc.ContactSurface(self.search, self.iterations)


DEFAULT = Own("default", "balanced")


def own(quick: bool) -> list[Own]:
    """Settings of ``ContactSurface()``, its impulses, its literal search, and other forces."""
    out = [Own("default", "balanced", 4, f) for f in (1, 2, 4)]
    out += [Own("default", "balanced", n) for n in (2, 8)]
    out += [Own("impulses alone", "balanced", factor=f, surfaces=False) for f in (1, 2, 4)]
    out += [Own("predicted", factor=f) for f in (1, 2, 4)]
    out += [Own("literal", "literal", n) for n in (4, 8, 16)]
    out += [Own("penalty", times=k) for k in STIFFNESSES]
    if quick:
        return out
    out += [Own("default", "balanced", n, f) for n in (2, 8, 16) for f in (2, 4)]
    out += [Own("literal", "literal", n, f) for n in (4, 8, 16) for f in (2, 4)]
    return out + [Own("penalty", times=k, factor=2) for k in STIFFNESSES]


FEW = 5  # settings of each engine in the quick run
SWEEPS = {  # the knobs of each engine outside, then its settings
    "Newton VBD": (
        ("steps", "iterations", "contact", "margin"),
        ((2, 5, 1, 0.1), (5, 5, 1, 0.1), (2, 5, 10, 0.002), (5, 5, 10, 0.02), (5, 5, 10, 0.002))
        + ((10, 10, 1, 0.1), (10, 10, 10, 0.02), (10, 10, 10, 0.002), (20, 20, 10, 0.002))
        + ((5, 5, 1, 0.02),),
    ),
    "Newton XPBD": (
        ("steps", "iterations", "relaxation", "radius"),
        ((5, 10, 0.2, 0.3), (10, 2, 0.2, 0.3), (10, 10, 0.2, 0.3), (5, 10, 0.2, 0.43))
        + ((10, 10, 0.2, 0.43), (10, 20, 0.1, 0.3), (32, 2, 0.2, 0.3), (32, 10, 0.4, 0.3))
        + ((10, 2, 0.2, 0.43), (20, 10, 0.1, 0.43)),
    ),
    "MuJoCo flex": (
        ("steps", "iterations", "time_constant", "radius"),
        ((1, 20, 2, 0.01), (2, 20, 2, 0.01), (4, 20, 2, 0.01), (2, 20, 2, 1e-4), (4, 20, 2, 1e-4))
        + ((8, 20, 2, 0.01), (16, 20, 2, 0.01), (8, 20, 2, 1e-4), (16, 20, 2, 1e-4))
        + ((16, 100, 10, 0.01),),
    ),
}


def outside(engine: str, quick: bool) -> list[dict]:
    """Settings of an engine outside: five in the quick run, ten in all."""
    knobs, rows = SWEEPS[engine]
    return [dict(zip(knobs, row, strict=True)) for row in (rows[:FEW] if quick else rows)]
