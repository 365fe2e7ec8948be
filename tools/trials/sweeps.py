"""Sweeps of two numbers to the point of failure, on scenes of two small bodies."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from trials.outcome import classify
from trials.setting import NONE, Setting, body, setting, soft
from trials.watch import attempt

CELLS = 11  # along each side
EDGE = 0.1  # of a block [m]
FRAMES = 60
FIGURES = {  # of a cell: its columns, and the fields of its record
    "overlap": "overlap",
    "energy_gained": "gained",
    "lowest_volume": "lowest",
    "end_volume": "volume",
    **{name: name for name in ("tunnelled", "touched", "steps", "time", "asked", "reason")},
}
CUT = {"most_steps": 6000, "limit": 30.0}  # steps and seconds that a cell may take
Axis = tuple[str, float, float]  # its name with its unit, first and last value: by equal factors


class Sweep(NamedTuple):
    """What is swept, and how."""

    title: str
    x: Axis
    y: Axis
    build: Callable[[float, float], Setting]  # of a cell

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """The values of both."""
        return np.geomspace(*self.x[1:], CELLS), np.geomspace(*self.y[1:], CELLS)


def step_stiffness(step: float, young: float) -> Setting:
    """Two blocks collide at 1 m/s with a fixed step."""
    blocks = []
    for k, sign in enumerate((-1.0, 1.0)):
        place = 0.004 * k, 0.003 * k, sign * (0.5 * EDGE + 0.002)
        blocks.append(body(wc.box(EDGE, 2 + k), soft(young), place, v=-0.5 * sign))
    return fixed_steps(*blocks, seconds=0.06, step=step)


def mass_stiffness(mass: float, young: float) -> Setting:
    """A block falls on one that is held; mass and stiffness of the upper over that of the lower.

    At the largest mass ratio the pressure at rest is as large as the lower block's modulus. The
    weight of the upper block over its section is mass / (1e4 young) of its own moduli: beyond
    16 it may turn inside out, from 40 on also held at its base with nothing to touch.
    """
    base = 1e4 * 1000.0 * 9.81 * EDGE
    low = body(wc.box(EDGE, 2), soft(base), fixed="base")
    high = body(wc.box(EDGE, 3), soft(base * young, 1000.0 * mass), (0.004, 0.003, EDGE + 2e-3))
    return setting(low, high, seconds=0.1, fps=FRAMES / 0.1)


def overlap_thickness(overlap: float, thick: float) -> Setting:
    """A block starts in a plate; both lengths as parts of its edge."""
    plate = body(wc.box((2.0 * EDGE, 2.0 * EDGE, thick * EDGE), (4, 4, 1)))
    block = body(wc.box(EDGE, 3), at=(0.004, 0.003, (0.5 * thick + 0.5 - overlap) * EDGE))
    run = {"seconds": 0.3, "fps": FRAMES / 0.3, "recovers": True}
    return setting(plate, block, gravity=NONE, friction=0.0, **run)


def speed_step(speed: float, step: float) -> Setting:
    """A block hits a thin plate that is held, with a fixed step."""
    thick, length = 0.004, 0.04
    plate = body(wc.box((EDGE, EDGE, thick), (3, 3, 1)), soft(1e4), fixed=True)
    place = 0.003, 0.002, 0.5 * (thick + length) + 0.6 * thick
    block = body(wc.box(length, 2), soft(1e4), place, v=-speed)
    seconds = min(max(3.0 * length / speed, 10.0 * step), 600.0 * step)
    return fixed_steps(plate, block, seconds=seconds, step=step)


def fixed_steps(*bodies: dict, seconds: float, step: float) -> Setting:
    """About ``FRAMES`` frames of equal steps of ``step`` [s], without gravity."""
    substeps = max(1, round(seconds / FRAMES / step))
    run = {"seconds": seconds, "fps": 1.0 / (step * substeps), "substeps": substeps}
    return setting(*bodies, gravity=NONE, **run)


SWEEPS = {
    "step": Sweep(
        "two blocks collide at 1 m/s, fixed step",
        ("step [s]", 1e-4, 1e-2),
        ("Young's modulus [Pa]", 1e3, 1e7),
        step_stiffness,
    ),
    "ratio": Sweep(
        "a block falls on another, step left to the solver",
        ("mass ratio", 1.0, 1e4),
        ("stiffness ratio", 1e-4, 1e4),
        mass_stiffness,
    ),
    "depth": Sweep(
        "a block starts in a plate",
        ("overlap at the start [of an edge]", 0.01, 0.5),
        ("thickness [of an edge]", 0.03, 1.0),
        overlap_thickness,
    ),
    "speed": Sweep(
        "a block hits a plate of 0.004 m, fixed step",
        ("speed [m/s]", 0.1, 100.0),
        ("step [s]", 1e-4, 1e-2),
        speed_step,
    ),
}


def cases(name: str, method: str) -> Iterator[dict]:
    """The cells of a sweep, by rows of equal y."""
    xs, ys = (axis.tolist() for axis in SWEEPS[name].axes())
    yield from ({"sweep": name, "method": method, "x": x, "y": y} for y in ys for x in xs)


def cell(sweep: str, method: str, x: float, y: float) -> dict:
    """What becomes of a cell: its outcome and its figures."""
    r = attempt(partial(SWEEPS[sweep].build, x, y), method, **CUT)
    figures = {column: getattr(r, field) for column, field in FIGURES.items()}
    return {"outcome": classify(r)} | figures
