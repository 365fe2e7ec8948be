"""B1: Erleben's scenes (2018), as IPC uses them: bodies of two or three tets, all of it surface.

Spikes and wedges of height 3 on each other, in a funnel and in a crack, sliding at 10 m/s; a cube
on the edge of a cliff and over the inner edges of a floor. Friction 1, unless they are to slide.
"""

from collections.abc import Iterator
from functools import partial

import warp_contact as wc
from trials.case import DOWN, UP, Case, soft
from trials.pieces import UPSIDE_DOWN, about, both, ring, spike, wedge
from trials.watch import Setting

DROP = 1e-4  # [m]
SECONDS = 1.25  # of scenes that have no rest


def cases(quick: bool) -> Iterator[Case]:
    """All ten, with single and with many tets where a floor is in play."""
    turned = both(about("z", 90.0), UPSIDE_DOWN)
    yield Case("B1.1 spike on spike", partial(onto, spike, spike, UPSIDE_DOWN))
    yield Case("B1.2 spike on wedge", partial(onto, wedge, spike, UPSIDE_DOWN))
    yield Case("B1.3 wedge on wedge, crossed", partial(onto, wedge, wedge, turned))
    yield Case("B1.3 wedge on wedge, parallel", partial(onto, wedge, wedge, UPSIDE_DOWN))
    yield Case("B1.4 spike in a hole, pulled through", hole)
    yield Case("B1.5 spike in a crack", partial(crack, spike))
    yield Case("B1.6 wedge in a crack", partial(crack, wedge))
    yield Case("B1.7 spike slides at 10 m/s", partial(slide, spike, 6))
    yield Case("B1.8 wedge slides at 10 m/s", partial(slide, wedge, 6))
    yield Case("B1.9 cube on the edge of a cliff", cliff)
    for cells in (1, 4) if quick else (1, 4, 9):
        yield Case(f"B1.10 cube slides over {cells} inner edges", partial(floor, cells))


def onto(low, high, turn) -> Setting:
    """The upper body stands on its tip or edge on that of the lower one, which is fixed."""
    scene = wc.Scene(DOWN, friction=1.0)
    scene.add_body(low(), soft(), fixed=True, label="low")
    scene.add_body(high(), soft(), (0.0, 0.0, DROP), turn, label="high")
    return Setting(scene, SECONDS, pairs=((0, 1, UP),))


def hole() -> Setting:
    """The base of a spike is pulled down at 1 m/s through a funnel half as wide as the base."""
    scene = wc.Scene(DOWN, friction=0.0)
    funnel = ring((0.3, 0.8), 2.0, 1.0, 12)
    scene.add_body(funnel, soft(1e6), fixed=True, label="hole")
    needle = spike()
    body = scene.add_body(
        needle, soft(), (0.0, 0.0, -0.6), both(about("z", 15.0), UPSIDE_DOWN), label="spike"
    )
    tip_id = 4
    body.fixed[tip_id] = True

    def drive(sim: wc.Simulation) -> None:
        sim.set_velocity(body, (0.0, 0.0, -1.0), [tip_id])

    return Setting(scene, 1.5, pairs=(), drive=drive)


def crack(shape) -> Setting:
    """A body falls with its tip or edge into the gap of two blocks that lean outwards."""
    scene = wc.Scene(DOWN, friction=0.3)
    for side in (-1.0, 1.0):
        block = wc.box((2.0, 4.0, 3.0), (2, 3, 3))
        x = block.vertices
        lean = wc.TetMesh(x + (side * 0.15 * (x[:, 2:] + 1.5)) * [1.0, 0.0, 0.0], block.tets)
        scene.add_body(lean, soft(1e6), (side * 1.05, 0.0, -1.5), fixed=True)
    body = scene.add_body(shape(), soft(), (0.02, 0.01, -0.2), UPSIDE_DOWN, label="wedge")
    return Setting(scene, 2.0, pairs=((0, body.index, (1, 0, 0)), (body.index, 1, (1, 0, 0))))


def slide(shape, cells: int) -> Setting:
    """A body on its base slides over a floor of many facets."""
    scene = wc.Scene(DOWN, friction=0.1)
    floor = wc.box((16.0, 4.0, 1.0), (2 * cells, cells // 2, 1))
    scene.add_body(floor, soft(1e6), (5.0, 0.0, -0.5), fixed=True, label="floor")
    place = 0.0, 0.0, 3.0 + DROP
    scene.add_body(shape(), soft(), place, velocity=(10.0, 0.0, 0.0), label="slider")
    return Setting(scene, 1.0, pairs=((0, 1, UP),))


def cliff() -> Setting:
    """A cube falls with a part of its base on the edge of a block."""
    scene = wc.Scene(DOWN, friction=1.0)
    scene.add_body(wc.box(4.0, 1), soft(1e6), (-2.0, 0.0, -2.0), fixed=True, label="cliff")
    scene.add_body(wc.box(1.0, 1), soft(), (-0.1, 0.0, 0.6), about("z", 20.0), label="cube")
    return Setting(scene, 1.5, pairs=((0, 1, UP),))


def floor(cells: int) -> Setting:
    """A cube slides without friction over a floor that is plane but not one facet."""
    scene = wc.Scene(DOWN, friction=0.0)
    mesh = wc.box((8.0, 4.0, 1.0), (2 * cells, cells, 1))
    scene.add_body(mesh, soft(1e6), (2.0, 0.0, -0.5), fixed=True, label="floor")
    scene.add_body(wc.box(1.0, 1), soft(), (-1.0, 0.0, 0.5 + DROP), velocity=(2.0, 0.0, 0.0))
    return Setting(scene, 1.5, pairs=((0, 1, UP),))
