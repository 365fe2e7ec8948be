"""A7m: a light cube carries an equal one R times as dense, R from 1 to 10000.

    force on the light cube's top = R rho l^3 G,  E = 20 R rho G l: 5 % of strain in it

Poisson ratio 0. It starts in the static state of a column, the wave speeds differ by sqrt(R).
"""

from collections.abc import Iterator

import numpy as np
from measure.figure import Figure, relative, zero

import warp_contact as wc
from verification.columns import Column, Pile
from verification.relax import rest
from verification.setup import Ask, G, forces

EDGE, DENSITY = 0.1, 1000.0  # of the light cube [m], [kg/m^3]
RATIOS = 1.0, 10.0, 100.0, 1e3, 1e4
CELLS = 2, 3  # of the light and the heavy cube
GAP = 3e-5  # at the start [m]: about a thousandth of an edge
FRICTION = 0.3
FORCE = 0.02, 0.001, 1e-5
RIPPLE = 0.05, 0.005, 1e-5
SETTLE, LEAST = 10.0, 200  # 1 / (slowest frequency), frames
SAMPLE = 0.5  # part of the frames at the end over which forces are averaged
BLOCK = 10  # frames in a force of the ripple: one alone is a step or two


def run(ask: Ask) -> Iterator[Figure]:
    """Every ratio; the quick run leaves out every second one."""
    for ratio in RATIOS[:: 2 if ask.quick else 1]:
        yield from carry(ask, ratio)


def pile(ratio: float, young: float) -> Pile:
    """Both cubes, the centre of the light one at the origin."""
    cubes = [
        Column(young, EDGE, density, (n, n, n), (EDGE, EDGE))
        for density, n in zip((DENSITY, ratio * DENSITY), CELLS, strict=True)
    ]
    return Pile(cubes, GAP, -0.5 * EDGE, gravity=G, friction=FRICTION)


def static(scene: wc.Scene, young: float, ratio: float) -> list[np.ndarray]:
    """Positions [m] of both cubes under the weights, as bars."""
    return pile(ratio, young).static(scene)


def carry(ask: Ask, ratio: float) -> Iterator[Figure]:
    """Mean and ripple of the force on the light cube's top, and its height."""
    label = f"A7m heavy on light, mass ratio {ratio:g}"
    young = 20.0 * ratio * DENSITY * G * EDGE
    both = pile(ratio, young)
    sim = both.start(both.simulate(ask))
    omega = float(np.sqrt(young * EDGE / (ratio * DENSITY * EDGE**3)))
    force = rest(sim, omega, SETTLE, lambda: forces(sim, ("body0", "body1")), SAMPLE, LEAST)[:, 0]
    weight = ratio * DENSITY * EDGE**3 * G
    yield relative(label, "mean force [N]", force.mean(), weight, FORCE)
    blocks = force[: len(force) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1)
    ripple = np.std(blocks) / max(force.mean(), 1e-9)
    yield zero(label, "ripple of the force [of the mean]", ripple, RIPPLE)
    yield zero(label, "deepest overlap [of an edge]", sim.measure().overlap * CELLS[1] / EDGE)
