"""A7m: a light cube carries an equal one R times as dense, R from 1 to 10000.

    force on the light cube's top = R rho l^3 G,  E = 20 R rho G l: 5 % of strain in it

Poisson ratio 0. It starts in the static state of a column, the wave speeds differ by sqrt(R).
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from verification.figure import Figure, relative, zero
from verification.relax import relax, step_rate
from verification.setup import Ask, G, on_face

EDGE, DENSITY = 0.1, 1000.0  # of the light cube [m], [kg/m^3]
RATIOS = 1.0, 10.0, 100.0, 1e3, 1e4
CELLS = 2, 3  # of the light and the heavy cube
GAP = 3e-5  # at the start [m]: about a thousandth of an edge
FORCE = 0.02, 0.001, 1e-5
RIPPLE = 0.05, 0.005, 1e-5
LEAST = 200  # frames
SAMPLE = 0.5  # part of the frames at the end over which forces are averaged
BLOCK = 10  # frames in a force of the ripple: one alone is a step or two


def run(ask: Ask) -> Iterator[Figure]:
    """Every ratio; the quick run leaves out every second one."""
    for ratio in RATIOS[:: 2 if ask.quick else 1]:
        yield from carry(ask, ratio)


def carry(ask: Ask, ratio: float) -> Iterator[Figure]:
    """Mean and ripple of the force on the light cube's top, and its height."""
    label = f"A7m heavy on light, mass ratio {ratio:g}"
    young = 20.0 * ratio * DENSITY * G * EDGE
    scene = wc.Scene(gravity=(0.0, 0.0, -G))
    light, heavy = wc.box(EDGE, CELLS[0]), wc.box(EDGE, CELLS[1])
    scene.add_body(light, wc.Corotated(young, 0.0, DENSITY), fixed=on_face(light, 2, -1))
    scene.add_body(heavy, wc.Corotated(young, 0.0, ratio * DENSITY), (0.0, 0.0, EDGE + GAP))
    speed = float(np.sqrt(young / DENSITY))
    contacts = sum((n + 1) ** 2 for n in CELLS)
    respond = ask.respond(100.0 * young * EDGE / 2.0 / contacts)
    sim = wc.Simulation(scene, respond, fps=step_rate(EDGE / CELLS[1], speed))
    sim.state.x.assign(np.concatenate(static(scene, young, ratio)).astype(np.float32))
    omega = float(np.sqrt(young * EDGE / (ratio * DENSITY * EDGE**3)))
    frames = max(LEAST, int(np.ceil(10.0 / omega * sim.fps)))
    forces = []
    for frame in relax(sim, omega, frames):
        if frame > (1.0 - SAMPLE) * frames:
            forces.append(sim.measure().forces.get(("body0", "body1"), 0.0))
    mean = float(np.mean(forces))
    yield relative(label, "mean force [N]", mean, ratio * DENSITY * EDGE**3 * G, FORCE)
    blocks = np.array(forces)[: len(forces) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1)
    ripple = float(np.std(blocks)) / max(mean, 1e-9)
    yield zero(label, "ripple of the force [of the mean]", ripple, RIPPLE)
    yield zero(label, "deepest overlap [of an edge]", sim.measure().overlap * CELLS[1] / EDGE)


def static(scene: wc.Scene, young: float, ratio: float) -> list[np.ndarray]:
    """Positions [m] under the weights, both cubes as bars."""
    unit = DENSITY * G / young
    positions = []
    carried, sunk = ratio, 0.0
    for body, density in zip(scene.bodies, (1.0, ratio), strict=True):
        x = body.x.copy()
        s = x[:, 2] - x[:, 2].min()
        above = carried * EDGE if density == 1.0 else 0.0
        x[:, 2] -= sunk + unit * (above * s + density * (EDGE * s - 0.5 * s**2))
        sunk += unit * (above * EDGE + 0.5 * density * EDGE**2)
        positions.append(x)
    return positions
