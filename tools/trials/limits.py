"""B10: what the method was not made for.

Bodies wholly inside others, edges on edges, coarse curved bodies, deep starts, plates thinner than
the overlap, facets larger than a body, a vertex that touches two bodies, contacts that turn round.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

import warp_contact as wc
from trials.case import DOWN, NONE, UP, Case, soft
from trials.outcome import REFUSED
from trials.pieces import about, both
from trials.watch import Setting

EDGE, YOUNG = 0.1, 1e5  # [m], [Pa]
FINE_FPS = 1000.0  # where the largest elastic energy is wanted: a wave crosses a body in 10 frames


def cases(quick: bool) -> Iterator[Case]:
    """Every one; the quick run takes fewer angles, depths and balls."""
    for place in (0.0, 0.01, 0.03):
        yield Case(f"B10.1 enclosed, {place:g} from the middle", partial(enclosed, place))
    yield Case("B10.1 enclosed, on its way in", partial(enclosed, 0.03, -1.0))
    for angle in (90, 30) if quick else (90, 60, 45, 30, 10, 5, 1):
        yield Case(f"B10.2 cube edge on cube edge at {angle}", partial(edges, angle))
        yield Case(f"B10.2 beam across beam at {angle}", partial(beams, angle))
    for count in (13, 55, 147) if quick else (13, 41, 55, 147, 309, 561):
        yield Case(f"B10.3 ball on ball of {count} vertices", partial(balls, count))
    for part in (0.1, 0.3, 0.6, 0.9):
        yield Case(f"B10.5 deep start, {part:.0%}", partial(deep, part))
        if not quick:
            yield Case(f"B10.5 deep start, {part:.0%}, shifted", partial(deep, part, 0.02))
    for overlap in (0.5, 0.9, 1.5, 3.0):
        yield Case(f"B10.6 plate, overlap {overlap:g} of it", partial(plate, overlap))
    for inside in (False, True):
        where = "starts inside" if inside else "falls"
        yield Case(f"B10.7 cube on one large facet, {where}", partial(facet, inside))
    for gap in (0.0, 1e-3):
        yield Case(f"B10.8 corner on the seam of two cubes, gap {gap:g}", partial(seam, gap))
    yield Case("B10.8 ball between three cubes", three)
    yield Case("B10.9 ball between two walls, to and fro", to_and_fro)
    yield Case("B10.9 plate driven to and fro", driven)
    yield Case("B10.10 two tets that share an edge only", not_manifold, REFUSED)


def enclosed(place: float, speed: float = 0.0) -> Setting:
    """A small cube inside a large one; it has to leave by some side."""
    scene = wc.Scene(NONE, friction=0.0)
    scene.add_body(wc.box(EDGE, 3), soft(YOUNG), label="large")
    small = wc.box(0.3 * EDGE, 1)
    at, v = (0.1 * place, 0.0, place), (0.0, 0.0, speed)
    scene.add_body(small, soft(YOUNG), at, velocity=v, label="small")
    return Setting(scene, 1.0, FINE_FPS, pairs=(), recovers=True)


def edges(angle: float) -> Setting:
    """Two cubes meet with an edge each."""
    return meet(wc.box(EDGE, 2), about("x", 45.0), angle, 0.5 * np.sqrt(2.0) * EDGE)


def beams(angle: float) -> Setting:
    """Two flat beams lie across each other: no vertex of one is inside the other."""
    return meet(
        wc.box((4.0 * EDGE, EDGE, 0.5 * EDGE), (4, 1, 1)), about("x", 0.0), angle, 0.25 * EDGE
    )


def meet(mesh: wc.TetMesh, turn, angle: float, half: float, speed: float = 0.5) -> Setting:
    """The second, turned about z, comes down on the first."""
    scene = wc.Scene(NONE, friction=0.3)
    v = np.array([0.0, 0.0, 0.5 * speed])
    away = (0.0, 0.0, half + 0.002)
    scene.add_body(mesh, soft(YOUNG), -np.array(away), turn, v, label="low")
    scene.add_body(mesh, soft(YOUNG), away, both(about("z", angle), turn), -v, label="high")
    return Setting(scene, 0.2)


def balls(count: int) -> Setting:
    """Balls hit each other, turned so that facets do not match."""
    scene = wc.Scene(NONE, friction=0.0)
    for k, sign in enumerate((-1.0, 1.0)):
        away = sign * 0.52 * EDGE
        turn = both(about("y", 25.0 * k), about("z", 40.0 * k))
        v = (0.0, 0.0, -0.25 * sign)
        scene.add_body(wc.sphere(0.5 * EDGE, count), soft(YOUNG), (0.0, 0.0, away), turn, v)
    return Setting(scene, 0.1)


def deep(part: float, aside: float = 0.0) -> Setting:
    """Two cubes start in each other.

    Closed at once, before anything moves, the overlap would leave each cube shorter by half of it.
    Hooke's law for the columns that meet, cut free from the rest, bounds that energy from below.
    """
    scene = wc.Scene(NONE, friction=0.0)
    for k in range(2):
        place = k * aside, k * aside, k * (1.0 - part) * EDGE
        scene.add_body(wc.box(EDGE, 2 + k), soft(YOUNG), place)
    pairs = ((0, 1, UP),) if part < 0.5 else ()  # beyond, no side is the right one
    held = YOUNG * (0.5 * part) ** 2 * (EDGE - aside) ** 2 * EDGE
    return Setting(scene, 1.0, FINE_FPS, pairs=pairs, recovers=True, held=held)


def plate(overlap: float) -> Setting:
    """A cube starts in a plate, and beyond its far face where the overlap is above 1."""
    scene = wc.Scene(NONE, friction=0.0)
    thick = 0.1 * EDGE
    scene.add_body(wc.box((2.0 * EDGE, 2.0 * EDGE, thick), (6, 6, 1)), soft(YOUNG), label="plate")
    cube = wc.box(0.6 * EDGE, 2)
    place = 0.5 * thick + 0.3 * EDGE - overlap * thick
    scene.add_body(cube, soft(YOUNG), (0.003, 0.002, place), label="cube")
    return Setting(scene, 0.5, FINE_FPS, pairs=((0, 1, UP),), recovers=True)


def facet(inside: bool) -> Setting:
    """A small cube on the middle of a facet of a single large cell."""
    scene = wc.Scene(NONE if inside else DOWN, friction=0.3)
    large = wc.box(1.0, 1)
    scene.add_body(large, soft(YOUNG), fixed=large.vertices[:, 2] < 0.0, label="large")
    small = wc.box(EDGE, 1)
    place = 0.2, 0.2, 0.5 + 0.5 * EDGE + (-0.3 * EDGE if inside else 0.01)
    scene.add_body(small, soft(YOUNG), place, label="small")
    fps = FINE_FPS if inside else 200.0
    return Setting(scene, 0.5, fps, pairs=((0, 1, UP),), recovers=inside)


def seam(gap: float) -> Setting:
    """A corner comes down where two cubes meet: its vertex touches both."""
    scene = wc.Scene(DOWN, friction=0.3)
    for side in (-1.0, 1.0):
        mesh = wc.box(EDGE, 2)
        place = side * 0.5 * (EDGE + gap), 0.0, 0.0
        scene.add_body(mesh, soft(YOUNG), place, fixed=mesh.vertices[:, 2] < -0.049)
    turn = both(about("y", float(np.degrees(np.arctan(np.sqrt(0.5))))), about("x", 45.0))
    upper = scene.add_body(wc.box(EDGE, 2), soft(YOUNG), NONE, turn)
    low = upper.x[:, 2].argmin()
    upper.x[:] += np.array([0.0, 0.0, 0.5 * EDGE + 0.002]) - upper.x[low]
    return Setting(scene, 0.5, pairs=((0, 2, UP), (1, 2, UP)))


def three() -> Setting:
    """A ball falls into the corner of three cubes, each a body."""
    scene = wc.Scene((-5.0, -5.0, -5.0), friction=0.3)
    for axis in np.eye(3):
        scene.add_body(wc.box(2.0 * EDGE, 2), soft(YOUNG), -1.05 * EDGE * axis, fixed=True)
    scene.bodies[1].x[:, 0] += 2.05 * EDGE  # side by side rather than in each other
    scene.bodies[2].x[:, :2] += 2.05 * EDGE
    scene.add_body(wc.sphere(0.5 * EDGE, 41), soft(YOUNG), (0.7 * EDGE, 0.7 * EDGE, 0.7 * EDGE))
    return Setting(scene, 0.5, pairs=())


def to_and_fro() -> Setting:
    """A ball bounces between two fixed walls."""
    scene = wc.Scene(NONE, friction=0.3)
    for side in (-1.0, 1.0):
        wall = wc.box((2.0 * EDGE, 2.0 * EDGE, 0.3 * EDGE), (2, 2, 1))
        scene.add_body(wall, soft(YOUNG), (0.0, 0.0, side * 0.7 * EDGE), fixed=True)
    ball = wc.sphere(0.5 * EDGE, 55)
    scene.add_body(ball, soft(YOUNG), velocity=(0.0, 0.0, 1.0))
    return Setting(scene, 0.6, pairs=((0, 2, UP), (2, 1, UP)))


def driven() -> Setting:
    """A fixed plate between two cubes that lean on walls moves up and down: contacts turn round."""
    scene = wc.Scene(NONE, friction=0.3)
    mesh = wc.box((2.0 * EDGE, 2.0 * EDGE, 0.2 * EDGE), (3, 3, 1))
    scene.add_body(mesh, soft(YOUNG), fixed=True, label="plate")
    for side in (-1.0, 1.0):
        cube = wc.box(EDGE, 2)
        held = side * cube.vertices[:, 2] > 0.049
        place = (0.0, 0.0, side * 0.61 * EDGE)
        scene.add_body(cube, soft(YOUNG), place, fixed=held, label=f"cube{side:+g}")

    def drive(sim: wc.Simulation) -> None:
        sim.set_velocity(0, (0.0, 0.0, 0.1 * np.cos(2.0 * np.pi * 2.0 * sim.time)))

    return Setting(scene, 1.0, pairs=((1, 0, UP), (0, 2, UP)), drive=drive)


def not_manifold() -> Setting:
    """A surface with an edge that four triangles share."""
    x = np.concatenate([np.zeros((1, 3)), np.eye(3), [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]])
    scene = wc.Scene(NONE)
    scene.add_body(wc.TetMesh(x, [[0, 1, 2, 3], [0, 1, 4, 5]]), soft())
    return Setting(scene, 0.1)
