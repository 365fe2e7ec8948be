"""A8: orders of convergence: log2 of the ratio of errors when the step or the elements are halved.

    bar on a wall, h and dt together     1 - e, 1 - energy   0.70, 1.0 for symplectic Euler with
                                                             projection, 0.50 for implicit Euler
    block that slides down a slope, dt   place               1, that of symplectic Euler
    Hertz, elements across the contact   pressure, L2        0.5 to 1.0 with linear elements

The last are the orders of linear and quadratic elements against a curved master surface (code_aster
V6.03.150); linear triangles with an exact active set have 0.7 to 0.8 in plane strain.
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from verification import bars, friction, hertz
from verification.figure import Figure
from verification.setup import Ask, Pose

ELEMENTS = 10, 20, 40, 80  # along the bar
# Of the sliding block. The first is about the stable step; finer ones differ by less than
# the block trembles, 2e-5 m.
FPS, SUBSTEPS = 240, (8, 16, 32)
MU, START, SLIDES = 0.25, 1.0, 0.5  # friction on the slope of 1/2, speed [m/s], duration [s]

# Least orders that are good, excellent, best, as what may be missing to the order named first.
IMPACT = 1.0, (0.55, 0.3, 0.0)
SMOOTH = 1.0, (0.1, 0.05, 0.01)
PRESSURE = 1.0, (0.6, 0.2, 0.0)


def run(ask: Ask) -> Iterator[Figure]:
    """Impact, sliding and Hertz; the quick run leaves out the finest of each."""
    last = -1 if ask.quick else None
    yield from impact(ask, ELEMENTS[:last])
    yield from sliding(ask)
    yield from pressure(ask, hertz.COUNTS[:last])


def order(label: str, name: str, sizes, errors, target: tuple[float, tuple]) -> Figure:
    """Slope of log error over log size by least squares; none unless the errors fall throughout."""
    errors = np.abs(np.asarray(errors, dtype=float))
    slope = float(np.polyfit(np.log(sizes), np.log(np.maximum(errors, 1e-300)), 1)[0])
    falling = bool((np.diff(errors) < 0.0).all()) and len(errors) > 1
    ideal, limits = target
    missing = max(ideal - slope, 0.0) if falling else float("inf")
    return Figure(label, name, slope, ideal, missing, limits)


def impact(ask: Ask, counts) -> Iterator[Figure]:
    """Restitution and energy of a bar on a wall; the step follows the elements."""
    found = [bars.record(bars.IMPACTS["on a wall"], ask, n) for n in counts]
    label = f"A8 bar on a wall, N = {', '.join(map(str, counts))}"
    sizes = 1.0 / np.array(counts)
    yield order(label, "order of 1 - e", sizes, [1.0 - h.e for h in found], IMPACT)
    lost = [1.0 - h.energy[-1] for h in found]
    yield order(label, "order of the energy lost", sizes, lost, IMPACT)


def sliding(ask: Ask) -> Iterator[Figure]:
    """Place of a block on a slope; differences of successive steps, as it is not rigid.

    It is in motion from the start: letting go is not smooth.
    """
    scene = friction.build(friction.SLOPE, MU, (START, 0.0, 0.0))
    at_rest = friction.begin(ask, scene).positions()
    places = []
    for n in SUBSTEPS:
        sim = wc.Simulation(scene, ask.respond(*friction.PENALTY), FPS, substeps=n)
        sim.state.x.assign(at_rest)
        for _ in sim.frames(round(SLIDES * FPS)):
            pass
        places.append(friction.centre(sim)[0][0])
    label = f"A8 sliding block, {', '.join(map(str, SUBSTEPS))} steps a frame"
    sizes = 1.0 / np.array(SUBSTEPS[:-1])
    yield order(label, "order of the place in dt", sizes, np.diff(places), SMOOTH)


def pressure(ask: Ask, counts) -> Iterator[Figure]:
    """L2 error of the pressure below a sphere."""
    e_star = hertz.modulus(hertz.YOUNG)
    a = hertz.contact_radius(hertz.LOADS[1], hertz.RADIUS, e_star)
    errors = []
    for n in counts:
        sim, p = hertz.press(ask, n, a**2 / hertz.RADIUS, a, Pose())
        found = hertz.profile("", sim, p, hertz.RADIUS, e_star, n, Pose())
        errors.append(next((f.value for f in found if f.name == "pressure, L2 error"), np.nan))
    label = f"A8 sphere on plane, N = {', '.join(map(str, counts))}"
    yield order(label, "order of the pressure, L2", 1.0 / np.array(counts), errors, PRESSURE)
