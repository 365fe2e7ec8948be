"""B10: what the method was not made for.

Bodies wholly inside others, edges on edges, coarse curved bodies, deep starts, plates thinner than
the overlap, facets larger than a body, a vertex that touches two bodies, contacts that turn round.
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from trials.outcome import REFUSED
from trials.pieces import about, both
from trials.setting import NONE, Case, Setting, body, case, setting

EDGE, YOUNG = 0.1, 1e5  # [m], that of ``soft()`` [Pa]
FINE = {"fps": 1000.0, "recovers": True}  # a wave crosses a body in ten frames


def cases(quick: bool) -> Iterator[Case]:
    """Every one; the quick run takes fewer angles, depths and balls."""
    for place in (0.0, 0.01, 0.03):
        yield case(f"B10.1 enclosed, {place:g} from the middle", enclosed, place)
    yield case("B10.1 enclosed, on its way in", enclosed, 0.03, -1.0)
    for angle in (90, 30) if quick else (90, 60, 45, 30, 10, 5, 1):
        yield case(f"B10.2 cube edge on cube edge at {angle}", edges, angle)
        yield case(f"B10.2 beam across beam at {angle}", beams, angle)
    for count in (13, 55, 147) if quick else (13, 41, 55, 147, 309, 561):
        yield case(f"B10.3 ball on ball of {count} vertices", balls, count)
    for part in (0.1, 0.3, 0.6, 0.9):
        yield case(f"B10.5 deep start, {part:.0%}", deep, part)
        if not quick:
            yield case(f"B10.5 deep start, {part:.0%}, shifted", deep, part, 0.02)
    for overlap in (0.5, 0.9, 1.5, 3.0):
        yield case(f"B10.6 plate, overlap {overlap:g} of it", plate, overlap)
    yield case("B10.7 cube on one large facet, falls", facet, False)
    yield case("B10.7 cube on one large facet, starts inside", facet, True)
    for gap in (0.0, 1e-3):
        yield case(f"B10.8 corner on the seam of two cubes, gap {gap:g}", seam, gap)
    yield case("B10.8 ball between three cubes", three)
    yield case("B10.9 ball between two walls, to and fro", to_and_fro)
    yield case("B10.9 plate driven to and fro", driven)
    yield case("B10.10 two tets that share an edge only", not_manifold, expect=REFUSED)


def enclosed(place: float, speed: float = 0.0) -> Setting:
    """A small cube inside a large one; it has to leave by some side."""
    large, at = body(wc.box(EDGE, 3), label="large"), (0.1 * place, 0.0, place)
    small = body(wc.box(0.3 * EDGE, 1), at=at, v=speed, label="small")
    return setting(large, small, gravity=NONE, friction=0.0, seconds=1.0, pairs=(), **FINE)


def edges(angle: float) -> Setting:
    """Two cubes meet with an edge each."""
    return meet(wc.box(EDGE, 2), about("x", 45.0), angle, 0.5 * np.sqrt(2.0) * EDGE)


def beams(angle: float) -> Setting:
    """Two flat beams lie across each other: no vertex of one is inside the other."""
    flat = wc.box((4.0 * EDGE, EDGE, 0.5 * EDGE), (4, 1, 1))
    return meet(flat, about("x", 0.0), angle, 0.25 * EDGE)


def meet(mesh: wc.TetMesh, turn, angle: float, half: float) -> Setting:
    """The second, turned about z, comes down on the first."""
    low = body(mesh, at=-(half + 0.002), turn=turn, v=0.25, label="low")
    turn = both(about("z", angle), turn)
    high = body(mesh, at=half + 0.002, turn=turn, v=-0.25, label="high")
    return setting(low, high, gravity=NONE, seconds=0.2)


def balls(count: int) -> Setting:
    """Balls hit each other, turned so that facets do not match."""
    two = []
    for k, sign in enumerate((-1.0, 1.0)):
        turn = both(about("y", 25.0 * k), about("z", 40.0 * k))
        ball = wc.sphere(0.5 * EDGE, count)
        two.append(body(ball, at=sign * 0.52 * EDGE, turn=turn, v=-0.25 * sign))
    return setting(*two, gravity=NONE, friction=0.0, seconds=0.1)


def deep(part: float, aside: float = 0.0) -> Setting:
    """Two cubes start in each other.

    Closed at once, before anything moves, the overlap would leave each cube shorter by half of it.
    Hooke's law for the columns that meet, cut free from the rest, bounds that energy from below.
    """
    upper = aside, aside, (1.0 - part) * EDGE
    cubes = body(wc.box(EDGE, 2)), body(wc.box(EDGE, 3), at=upper)
    pairs = None if part < 0.5 else ()  # beyond, no side is the right one
    held = YOUNG * (0.5 * part) ** 2 * (EDGE - aside) ** 2 * EDGE
    watched = {"pairs": pairs, "held": held, **FINE}
    return setting(*cubes, gravity=NONE, friction=0.0, seconds=1.0, **watched)


def plate(overlap: float) -> Setting:
    """A cube starts in a plate, and beyond its far face where the overlap is above 1."""
    thick = 0.1 * EDGE
    low = body(wc.box((2.0 * EDGE, 2.0 * EDGE, thick), (6, 6, 1)), label="plate")
    place = 0.003, 0.002, 0.5 * thick + 0.3 * EDGE - overlap * thick
    cube = body(wc.box(0.6 * EDGE, 2), at=place, label="cube")
    return setting(low, cube, gravity=NONE, friction=0.0, seconds=0.5, **FINE)


def facet(inside: bool) -> Setting:
    """A small cube on the middle of a facet of a single large cell."""
    large = body(wc.box(1.0, 1), fixed="base", label="large")
    place = 0.2, 0.2, 0.5 + 0.5 * EDGE + (-0.3 * EDGE if inside else 0.01)
    small = body(wc.box(EDGE, 1), at=place, label="small")
    if inside:
        return setting(large, small, gravity=NONE, seconds=0.5, **FINE)
    return setting(large, small, seconds=0.5)


def seam(gap: float) -> Setting:
    """A corner comes down where two cubes meet: its vertex touches both."""
    cube = wc.box(EDGE, 2)
    low = [body(cube, at=(s * 0.5 * (EDGE + gap), 0.0, 0.0), fixed="base") for s in (-1.0, 1.0)]
    turn = both(about("y", float(np.degrees(np.arctan(np.sqrt(0.5))))), about("x", 45.0))
    s = setting(*low, body(cube, turn=turn), seconds=0.5, pairs=((0, 2), (1, 2)))
    x = s.scene.bodies[2].x
    x[:] += np.array([0.0, 0.0, 0.5 * EDGE + 0.002]) - x[x[:, 2].argmin()]
    return s


def three() -> Setting:
    """A ball falls into the corner of three cubes, each a body."""
    cubes = [body(wc.box(2.0 * EDGE, 2), at=-1.05 * EDGE * a, fixed=True) for a in np.eye(3)]
    ball = body(wc.sphere(0.5 * EDGE, 41), at=(0.7 * EDGE, 0.7 * EDGE, 0.7 * EDGE))
    s = setting(*cubes, ball, gravity=(-5.0, -5.0, -5.0), seconds=0.5, pairs=())
    s.scene.bodies[1].x[:, 0] += 2.05 * EDGE  # side by side rather than in each other
    s.scene.bodies[2].x[:, :2] += 2.05 * EDGE
    return s


def to_and_fro() -> Setting:
    """A ball bounces between two fixed walls."""
    mesh = wc.box((2.0 * EDGE, 2.0 * EDGE, 0.3 * EDGE), (2, 2, 1))
    walls = [body(mesh, at=side * 0.7 * EDGE, fixed=True) for side in (-1.0, 1.0)]
    ball = body(wc.sphere(0.5 * EDGE, 55), v=1.0)
    return setting(*walls, ball, gravity=NONE, seconds=0.6, pairs=((0, 2), (2, 1)))


def driven() -> Setting:
    """A fixed plate between two cubes that lean on walls moves up and down: contacts turn round."""
    mesh = wc.box((2.0 * EDGE, 2.0 * EDGE, 0.2 * EDGE), (3, 3, 1))
    bodies = [body(mesh, fixed=True, label="plate")]
    for side in (-1.0, 1.0):
        cube = wc.box(EDGE, 2)
        held = side * cube.vertices[:, 2] > 0.049
        bodies.append(body(cube, at=side * 0.61 * EDGE, fixed=held, label=f"cube{side:+g}"))

    def drive(sim: wc.Simulation) -> None:
        sim.set_velocity(0, (0.0, 0.0, 0.1 * np.cos(2.0 * np.pi * 2.0 * sim.time)))

    return setting(*bodies, gravity=NONE, seconds=1.0, pairs=((1, 0), (0, 2)), drive=drive)


def not_manifold() -> Setting:
    """A surface with an edge that four triangles share."""
    x = np.concatenate([np.zeros((1, 3)), np.eye(3), [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]])
    return setting(body(wc.TetMesh(x, [[0, 1, 2, 3], [0, 1, 4, 5]])), gravity=NONE, seconds=0.1)
