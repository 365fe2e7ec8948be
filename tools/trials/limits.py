"""B10: what the method was not made for.

Bodies wholly inside others, edges on edges, coarse curved bodies, deep starts, facets larger than a
body, a vertex that touches two bodies, contacts that turn round.
"""

from collections.abc import Iterator

import numpy as np
from verification.setup import quaternion

import warp_contact as wc
from trials.setting import NONE, Case, Setting, body, case, setting

EDGE, YOUNG = 0.1, 1e5  # [m], that of ``soft()`` [Pa]
FINE = {"fps": 1000.0, "recovers": True}  # a wave crosses a body in ten frames
SMOOTH = {"gravity": NONE, "friction": 0.0}


def cases() -> Iterator[Case]:
    """B10."""
    yield from inside()
    for angle in (90, 60, 45, 30, 10, 5, 1):
        yield case(f"B10.2 cube edge on cube edge at {angle}", edges, angle)
        yield case(f"B10.2 beam across beam at {angle}", beams, angle)
    for count in (13, 41, 55, 147, 309, 561):
        yield case(f"B10.3 ball on ball of {count} vertices", balls, count)
    for part in (0.1, 0.3, 0.6, 0.9):
        yield case(f"B10.5 deep start, {part:.0%}", deep, part)
        yield case(f"B10.5 deep start, {part:.0%}, shifted", deep, part, 0.02)
    yield case("B10.7 cube on one large facet, falls", facet, 0.01)
    start = {"gravity": NONE, **FINE}
    yield case("B10.7 cube on one large facet, starts inside", facet, -0.3 * EDGE, **start)
    yield from many()


def inside() -> Iterator[Case]:
    """A small cube inside a large one; it has to leave by some side."""
    starts = {f"{z:g} from the middle": (z, 0.0) for z in (0.0, 0.01, 0.03)}
    for name, (z, v) in (starts | {"on its way in": (0.03, -1.0)}).items():
        small = body(wc.box(0.3 * EDGE, 1), at=(0.1 * z, 0.0, z), v=v)
        run = {"seconds": 1.0, "pairs": (), **FINE, **SMOOTH}
        yield case(f"B10.1 enclosed, {name}", setting, body(wc.box(EDGE, 3)), small, **run)


def many() -> Iterator[Case]:
    """Contact with several bodies, in turn or at once."""
    for gap in (0.0, 1e-3):
        yield case(f"B10.8 corner on the seam of two cubes, gap {gap:g}", seam, gap)
    corners = (-1.05, 0.0, 0.0), (2.05, -1.05, 0.0), (2.05, 2.05, -1.05)
    cubes = [body(wc.box(2.0 * EDGE, 2), at=EDGE * np.array(c), fixed=True) for c in corners]
    ball = body(wc.sphere(0.5 * EDGE, 41), at=(0.7 * EDGE, 0.7 * EDGE, 0.7 * EDGE))
    run = {"gravity": (-5.0, -5.0, -5.0), "seconds": 0.5, "pairs": ()}
    yield case("B10.8 ball between three cubes", setting, *cubes, ball, **run)
    yield case("B10.9 plate driven to and fro", driven)


def edges(angle: float) -> Setting:
    """Two cubes meet with an edge each."""
    return meet(wc.box(EDGE, 2), 45.0, angle, 0.5 * np.sqrt(2.0) * EDGE)


def beams(angle: float) -> Setting:
    """Two flat beams lie across each other: no vertex of one is inside the other."""
    return meet(wc.box((4.0 * EDGE, EDGE, 0.5 * EDGE), (4, 1, 1)), 0.0, angle, 0.25 * EDGE)


def meet(mesh: wc.TetMesh, tilt: float, angle: float, half: float) -> Setting:
    """Both are tilted about x; the second, turned about z, comes down on the first."""
    low = body(mesh, at=-(half + 0.002), turn=quaternion((tilt, 0.0, 0.0)), v=0.25)
    high = body(mesh, at=half + 0.002, turn=quaternion((tilt, 0.0, angle)), v=-0.25)
    return setting(low, high, gravity=NONE, seconds=0.2)


def balls(count: int) -> Setting:
    """Balls hit each other, turned so that facets do not match."""
    two = []
    for k, sign in enumerate((-1.0, 1.0)):
        back = quaternion((0.0, -25.0 * k, -40.0 * k))
        turn, ball = back * [-1.0, -1.0, -1.0, 1.0], wc.sphere(0.5 * EDGE, count)
        two.append(body(ball, at=sign * 0.52 * EDGE, turn=turn, v=-0.25 * sign))
    return setting(*two, seconds=0.1, **SMOOTH)


def deep(part: float, aside: float = 0.0) -> Setting:
    """Two cubes start in each other.

    Closed at once, before anything moves, the overlap would leave each cube shorter by half of it.
    Hooke's law for the columns that meet, cut free from the rest, bounds that energy from below.
    """
    cubes = body(wc.box(EDGE, 2)), body(wc.box(EDGE, 3), at=(aside, aside, (1.0 - part) * EDGE))
    pairs = None if part < 0.5 else ()  # beyond, no side is the right one
    held = YOUNG * (0.5 * part) ** 2 * (EDGE - aside) ** 2 * EDGE
    return setting(*cubes, seconds=1.0, pairs=pairs, held=held, **FINE, **SMOOTH)


def facet(gap: float, **start) -> Setting:
    """A small cube on the middle of a facet of a single large cell."""
    small = body(wc.box(EDGE, 1), at=(0.2, 0.2, 0.5 + 0.5 * EDGE + gap))
    return setting(body(wc.box(1.0, 1), fixed="base"), small, seconds=0.5, **start)


def seam(gap: float) -> Setting:
    """A corner comes down where two cubes meet: its vertex touches both."""
    cube = wc.box(EDGE, 2)
    low = [body(cube, at=(s * 0.5 * (EDGE + gap), 0.0, 0.0), fixed="base") for s in (-1.0, 1.0)]
    turn = quaternion((45.0, np.degrees(np.arctan(np.sqrt(0.5))), 0.0))
    s = setting(*low, body(cube, turn=turn), seconds=0.5, pairs=((0, 2), (1, 2)))
    x = s.scene.bodies[2].x
    x[:] += np.array([0.0, 0.0, 0.5 * EDGE + 0.002]) - x[x[:, 2].argmin()]
    return s


def driven() -> Setting:
    """A fixed plate between two cubes that lean on walls moves up and down: contacts turn round."""
    bodies = [body(wc.box((2.0 * EDGE, 2.0 * EDGE, 0.2 * EDGE), (3, 3, 1)), fixed=True)]
    for side in (-1.0, 1.0):
        cube = wc.box(EDGE, 2)
        bodies.append(body(cube, at=side * 0.61 * EDGE, fixed=side * cube.vertices[:, 2] > 0.049))

    def drive(sim: wc.Simulation) -> None:
        sim.set_velocity(0, (0.0, 0.0, 0.1 * np.cos(2.0 * np.pi * 2.0 * sim.time)))

    return setting(*bodies, gravity=NONE, seconds=1.0, pairs=((1, 0), (0, 2)), drive=drive)
