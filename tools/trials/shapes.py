"""B1 and B2: bodies of few tets, all of it surface, and boxes of few cells.

``spikes`` are Erleben's scenes (2018), as IPC uses them: spikes and wedges of height 3 on each
other, in a funnel and in a crack, sliding at 10 m/s; a cube on the edge of a cliff and over the
inner edges of a floor. ``primitives`` are pairs of IPC's 16 unit tests, stacks and tight fits.
"""

from collections.abc import Iterator

import numpy as np
from verification.setup import quaternion

import warp_contact as wc
from trials.pieces import AS_IS, UPSIDE_DOWN, ridge, ring, spike, tip, wedge
from trials.setting import NONE, UP, Case, Setting, body, case, setting, soft

DROP = 1e-4  # [m]
GAP, SPEED = 0.01, 0.5  # [m], [m/s]
PAIRS = {  # lower and upper body, each turned
    "point on triangle": (tip, UPSIDE_DOWN, tip, quaternion((180.0, 0.0, 20.0))),
    "triangle on point": (tip, AS_IS, tip, AS_IS),
    "point on point": (tip, AS_IS, tip, UPSIDE_DOWN),
    "edge on edge, crossed": (ridge, AS_IS, ridge, quaternion((180.0, 0.0, 90.0))),
    "edge on edge, at 30 degrees": (ridge, AS_IS, ridge, quaternion((180.0, 0.0, 30.0))),
    "edge on edge, parallel": (ridge, AS_IS, ridge, UPSIDE_DOWN),
}


def spikes() -> Iterator[Case]:
    """B1, with single and with many tets where a floor is in play."""
    turned = quaternion((180.0, 0.0, 90.0))
    yield case("B1.1 spike on spike", onto, spike, spike)
    yield case("B1.2 spike on wedge", onto, wedge, spike)
    yield case("B1.3 wedge on wedge, crossed", onto, wedge, wedge, turned)
    yield case("B1.3 wedge on wedge, parallel", onto, wedge, wedge)
    yield case("B1.4 spike in a hole, pulled through", hole)
    yield case("B1.5 spike in a crack", crack, spike)
    yield case("B1.6 wedge in a crack", crack, wedge)
    for name, shape in (("B1.7 spike", spike), ("B1.8 wedge", wedge)):
        floor = body(wc.box((16.0, 4.0, 1.0), (12, 3, 1)), soft(1e6), (5.0, 0.0, -0.5), fixed=True)
        slider = body(shape(), at=3.0 + DROP, v=(10.0, 0.0, 0.0))
        yield case(f"{name} slides at 10 m/s", setting, floor, slider, friction=0.1, seconds=1.0)
    cliff = body(wc.box(4.0, 1), soft(1e6), (-2.0, 0.0, -2.0), fixed=True)
    cube = body(wc.box(1.0, 1), at=(-0.1, 0.0, 0.6), turn=quaternion((0.0, 0.0, 20.0)))
    yield case("B1.9 cube on the edge of a cliff", setting, cliff, cube, friction=1.0, seconds=1.5)
    for cells in (1, 4, 9):
        mesh = wc.box((8.0, 4.0, 1.0), (2 * cells, cells, 1))
        floor = body(mesh, soft(1e6), (2.0, 0.0, -0.5), fixed=True)
        cube = body(wc.box(1.0, 1), at=(-1.0, 0.0, 0.5 + DROP), v=(2.0, 0.0, 0.0))
        name = f"B1.10 cube slides over {cells} inner edges"
        yield case(name, setting, floor, cube, friction=0.0, seconds=1.5)


def primitives() -> Iterator[Case]:
    """B2."""
    for name, pair in PAIRS.items():
        yield case(f"B2 {name}", meet, *pair)
        yield case(f"B2 {name}, aside", meet, *pair, aside=(0.07, 0.04))
    for cells in (1, 2):
        cube = body(wc.box(1.0, cells), at=0.5 + GAP)
        yield case(f"B2 cube on plane, {cells} cells", setting, cube, planes=[UP], seconds=2.0)
        for where, aside in (("aligned", (0.0, 0.0)), ("shifted", (0.3, 0.4))):
            yield case(f"B2 cube on cube, {where}, {cells} cells", stack, 2, 0.02, cells, aside)
    yield case("B2 stack of five cubes, gap 1", stack, 5, 1.0, 1)
    cube = body(wc.box(1.0, 2), at=(0.505, 0.505, 0.505))
    leaning = {"gravity": (-3.0, -4.0, -8.0), "planes": np.eye(3), "seconds": 1.5}
    yield case("B2 cube in a corner, clearance 0.005", setting, cube, **leaning)
    for clearance in (5e-3, 5e-7):
        yield case(f"B2 tet in a slot, clearance {clearance:g}", slot, clearance)


def onto(low, high, turn=UPSIDE_DOWN) -> Setting:
    """The upper body stands on its tip or edge on that of the lower one, which is fixed."""
    lower, upper = body(low(), fixed=True), body(high(), at=DROP, turn=turn)
    return setting(lower, upper, friction=1.0, seconds=1.25)


def hole() -> Setting:
    """The base of a spike is pulled down at 1 m/s through a funnel half as wide as the base."""
    funnel = body(ring((0.3, 0.8), 2.0, 1.0, 12), soft(1e6), fixed=True)
    turn, pulled = quaternion((180.0, 0.0, 15.0)), [4]
    needle = body(spike(), at=-0.6, turn=turn, fixed=pulled)

    def drive(sim: wc.Simulation) -> None:
        sim.set_velocity(1, (0.0, 0.0, -1.0), pulled)

    return setting(funnel, needle, friction=0.0, seconds=1.5, pairs=(), drive=drive)


def crack(shape) -> Setting:
    """A body falls with its tip or edge into the gap of two blocks that lean outwards."""
    block = wc.box((2.0, 4.0, 3.0), (2, 3, 3))
    x, walls = block.vertices, []
    for side in (-1.0, 1.0):
        lean = wc.TetMesh(x + (side * 0.15 * (x[:, 2:] + 1.5)) * [1.0, 0.0, 0.0], block.tets)
        walls.append(body(lean, soft(1e6), (side * 1.05, 0.0, -1.5), fixed=True))
    falling = body(shape(), at=(0.02, 0.01, -0.2), turn=UPSIDE_DOWN)
    return setting(*walls, falling, seconds=2.0, pairs=((0, 2, (1, 0, 0)), (2, 1, (1, 0, 0))))


def meet(low, low_turn, high, high_turn, aside=(0.0, 0.0)) -> Setting:
    """A body hits a fixed one, without gravity; ``aside`` keeps them off the symmetric place."""
    lower = body(low(), turn=low_turn, fixed=True)
    s = setting(lower, body(high(), turn=high_turn, v=-SPEED), gravity=NONE, seconds=0.6)
    a, b = s.scene.bodies
    b.x[:] += [*aside, a.x[:, 2].max() + GAP - b.x[:, 2].min()]
    return s


def stack(count: int, gap: float, cells: int, aside=(0.0, 0.0)) -> Setting:
    """Cubes fall on each other and on the ground."""
    cubes = []
    for k in range(count):
        place = k % 2 * aside[0], k % 2 * aside[1], 0.5 + k * (1.0 + gap)
        cubes.append(body(wc.box(1.0, cells), soft(1e6), place))
    seconds = 1.0 + 0.5 * count * (gap >= 1.0)
    return setting(*cubes, friction=0.5, planes=[UP], seconds=seconds)


def slot(clearance: float) -> Setting:
    """A tet between two fixed walls."""
    places = [(side * (0.5 + clearance + 0.5), 0.0, 0.0) for side in (-1.0, 1.0)]
    walls = [body(wc.box((1.0, 3.0, 4.0), 1), at=place, fixed=True) for place in places]
    pairs = (0, 2, (1, 0, 0)), (2, 1, (1, 0, 0))
    return setting(*walls, body(ridge(), at=1.0), friction=0.0, seconds=0.4, pairs=pairs)
