"""B2: pairs of primitives (IPC's 16 unit tests): points, edges, faces, stacks, tight fits."""

from collections.abc import Iterator
from functools import partial

import warp_contact as wc
from trials.case import DOWN, NONE, UP, Case, soft
from trials.pieces import UPSIDE_DOWN, about, both, ridge, tip
from trials.watch import Setting

GAP, SPEED = 0.01, 0.5  # [m], [m/s]
FIRST_EDGES = 10.0, 8.0, 4.0, 2.0, 1.0  # of the cubes of a pyramid [m]


def cases(quick: bool) -> Iterator[Case]:
    """Every pair; the quick run leaves out the slow pyramid."""
    flat = both(about("z", 20.0), UPSIDE_DOWN)
    pairs = {
        "point on triangle": (tip(), UPSIDE_DOWN, tip(), flat),
        "triangle on point": (tip(), (0, 0, 0, 1), tip(), (0, 0, 0, 1)),
        "point on point": (tip(), (0, 0, 0, 1), tip(), UPSIDE_DOWN),
        "edge on edge, crossed": (
            ridge(),
            (0, 0, 0, 1),
            ridge(),
            both(about("z", 90.0), UPSIDE_DOWN),
        ),
        "edge on edge, at 30 degrees": (
            ridge(),
            (0, 0, 0, 1),
            ridge(),
            both(about("z", 30.0), UPSIDE_DOWN),
        ),
        "edge on edge, parallel": (ridge(), (0, 0, 0, 1), ridge(), UPSIDE_DOWN),
    }
    for name, pair in pairs.items():
        yield Case(f"B2 {name}", partial(meet, *pair))
        yield Case(f"B2 {name}, aside", partial(meet, *pair, aside=(0.07, 0.04)))
    for cells in (1, 2):
        yield Case(f"B2 cube on plane, {cells} cells", partial(on_plane, cells))
        for aside in ((0.0, 0.0), (0.3, 0.4)):
            where = "shifted" if any(aside) else "aligned"
            yield Case(
                f"B2 cube on cube, {where}, {cells} cells", partial(stack, 2, 0.02, cells, aside)
            )
    yield Case("B2 stack of five cubes, gap 1", partial(stack, 5, 1.0, 1, (0.0, 0.0)))
    yield Case("B2 cube in a corner, clearance 0.005", corner)
    for clearance in (5e-3, 5e-7):
        yield Case(f"B2 tet in a slot, clearance {clearance:g}", partial(slot, clearance))
    if not quick:
        yield Case("B2 pyramid of five cubes", pyramid)


def meet(low, low_turn, high, high_turn, aside=(0.0, 0.0)) -> Setting:
    """A body hits a fixed one, without gravity; ``aside`` keeps them off the symmetric place."""
    scene = wc.Scene(gravity=NONE, friction=0.3)
    a = scene.add_body(low, soft(), NONE, low_turn, fixed=True, label="low")
    b = scene.add_body(high, soft(), NONE, high_turn, (0.0, 0.0, -SPEED), label="high")
    b.x[:] += [*aside, a.x[:, 2].max() + GAP - b.x[:, 2].min()]
    return Setting(scene, 0.6, pairs=((0, 1, UP),))


def on_plane(cells: int) -> Setting:
    """A cube falls on the ground."""
    scene = wc.Scene(DOWN, friction=0.3)
    scene.add_plane(UP)
    scene.add_body(wc.box(1.0, cells), soft(), (0.0, 0.0, 0.5 + GAP))
    return Setting(scene, 2.0)


def stack(count: int, gap: float, cells: int, aside) -> Setting:
    """Cubes fall on each other and on the ground."""
    scene = wc.Scene(DOWN, friction=0.5)
    scene.add_plane(UP)
    for k in range(count):
        place = k % 2 * aside[0], k % 2 * aside[1], 0.5 + k * (1.0 + gap)
        scene.add_body(wc.box(1.0, cells), soft(1e6), place)
    return Setting(
        scene,
        1.0 + 0.5 * count * (gap >= 1.0),
        pairs=tuple((k, k + 1, UP) for k in range(count - 1)),
    )


def pyramid() -> Setting:
    """Ever smaller cubes on each other."""
    scene = wc.Scene(DOWN, friction=0.5)
    scene.add_plane(UP)
    top = 0.0
    for edge in FIRST_EDGES:
        scene.add_body(wc.box(edge, 2), soft(1e6), (0.0, 0.0, top + 0.5 * edge))
        top += edge + 0.01
    return Setting(scene, 2.0, pairs=tuple((k, k + 1, UP) for k in range(4)))


def corner() -> Setting:
    """A cube falls into a corner of three planes that leans."""
    scene = wc.Scene((-3.0, -4.0, -8.0), friction=0.3)
    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        scene.add_plane(axis)
    scene.add_body(wc.box(1.0, 2), soft(), (0.505, 0.505, 0.505))
    return Setting(scene, 1.5)


def slot(clearance: float) -> Setting:
    """A tet between two fixed walls."""
    scene = wc.Scene(DOWN, friction=0.0)
    half = 0.5 + clearance
    for side in (-1.0, 1.0):
        wall = wc.box((1.0, 3.0, 4.0), 1)
        scene.add_body(
            wall, soft(), (side * (half + 0.5), 0.0, 0.0), fixed=True, label=f"wall{side:+g}"
        )
    scene.add_body(ridge(), soft(), (0.0, 0.0, 1.0), label="tet")
    return Setting(scene, 0.4, pairs=((0, 2, (1, 0, 0)), (2, 1, (1, 0, 0))))
