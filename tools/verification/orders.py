"""A8: orders of convergence: log2 of the ratio of errors when the step or the elements are halved.

    bar on a wall, h and dt together     1 - e, 1 - energy   0.70, 1.0 for symplectic Euler with
                                                             projection, 0.50 for implicit Euler
    block that slides down a slope, dt   place               none: exact for a constant force
    Hertz, elements across the contact   pressure, L2        0.5 to 1.0 with linear elements
                                         displacement, L2    2 with linear elements

Those of Hertz are the orders of linear and quadratic elements against a curved master surface
(code_aster V6.03.150). Linear triangles with an exact active set in plane strain have 0.7 to 0.8
for the pressure.
"""

from itertools import pairwise

import numpy as np
from measure.figure import Figure, Figures, zero

import warp_contact as wc
from verification import bars, friction, hertz
from verification.setup import ALIGNED, masses, watch

ELEMENTS = 10, 20, 40, 80  # along the bar
# Of the sliding block; the first is about the stable step.
FPS, SUBSTEPS = 240, (8, 16, 32)
MU, START, SLIDES = 0.25, 1.0, 0.5  # friction on the slope of 1/2, speed [m/s], duration [s]

# Least orders that are good, excellent, best, as what may be missing to the order named first.
IMPACT = 1.0, (0.55, 0.3, 0.0)
PLACE = 1e-2, 1e-3, 1e-4  # of the way
PRESSURE = 1.0, (0.6, 0.2, 0.0)
SHAPE = 2.0, (1.0, 0.2, 0.0)

RINGS = 4, 8, 16  # of nested meshes, 1, 2 and 4 elements across the contact


def run(quick: bool) -> Figures:
    """Impact, sliding, Hertz; the quick run leaves out what is finest."""
    last = -1 if quick else None
    yield from impact(ELEMENTS[:last])
    yield from sliding()
    yield from pressure(hertz.COUNTS[:last])
    yield from shape(0.5 if quick else 1.0)


def order(label: str, name: str, counts, errors, target: tuple[float, tuple]) -> Figure:
    """Slope of log error over log 1 / count by least squares; none unless all errors fall."""
    errors = np.abs(np.asarray(errors, dtype=float))
    sizes = np.log(1.0 / np.array(counts))
    slope = float(np.polyfit(sizes, np.log(np.maximum(errors, 1e-300)), 1)[0])
    ideal, limits = target
    missing = max(ideal - slope, 0.0) if (np.diff(errors) < 0.0).all() else float("inf")
    return Figure(label, name, slope, ideal, missing, limits)


def listed(counts) -> str:
    """Numbers in a label."""
    return ", ".join(map(str, counts))


def impact(counts) -> Figures:
    """Restitution and energy of a bar on a wall; the step follows the elements."""
    found = [bars.record(bars.IMPACTS["on a wall"], n) for n in counts]
    _, energy, _, _, e = zip(*found, strict=True)
    label = f"A8 bar on a wall, N = {listed(counts)}"
    yield order(label, "order of 1 - e", counts, 1.0 - np.array(e), IMPACT)
    lost = [1.0 - left[-1] for left in energy]
    yield order(label, "order of the energy lost", counts, lost, IMPACT)


def sliding() -> Figures:
    """Place of a block on a slope, which no step may change: its acceleration is constant.

    It is in motion from the start: letting go is not smooth.
    """
    x, found = friction.begin(friction.SLOPE, MU).positions(), []
    scene = friction.build(friction.SLOPE, MU, (START, 0.0, 0.0))
    for n in SUBSTEPS:
        sim = wc.Simulation(scene, fps=FPS, substeps=n)
        sim.state.x.assign(x)
        watch(sim, SLIDES)
        found.append(friction.centre(sim)[0, 0])
    label = f"A8 sliding block, {listed(SUBSTEPS)} steps a frame"
    yield zero(label, "spread of the place [of the way]", np.ptp(found) / np.mean(found), PLACE)


def pressure(counts) -> Figures:
    """L2 error of the pressure below a sphere and a cylinder."""
    for body, case in (("sphere", hertz.on_plane), ("cylinder", hertz.line_on_plane)):
        found = (case(n, ALIGNED) for n in counts)
        errors = [next(f.value for f in figures if f.name == hertz.OVERALL) for figures in found]
        label = f"A8 {body} on plane, N = {listed(counts)}"
        yield order(label, "order of the pressure, L2", counts, errors, PRESSURE)


def shape(across: float) -> Figures:
    """L2 norm of the displacement below a sphere; differences of successive, nested meshes.

    ``across`` elements are in the contact of the first.
    """
    depth, found = hertz.CONTACT**2 / hertz.RADIUS, []
    for rings in RINGS:
        sim, _ = hertz.press(across * rings / RINGS[0], depth, ALIGNED, rings)
        start = sim.scene.bodies[0].x
        if not found:
            first, weight = start, masses(sim)
        at = np.linalg.norm(first[:, None] - start, axis=2).argmin(axis=1)
        found.append((sim.positions().astype(float) - start)[at])
    errors = [np.sqrt(weight @ ((v - u) ** 2).sum(axis=1)) for u, v in pairwise(found)]
    label = f"A8 sphere on plane, {listed(RINGS)} rings"
    yield order(label, "order of the displacement, L2", RINGS[:-1], errors, SHAPE)
