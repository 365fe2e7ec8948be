"""B4 to B7: the scenes of the paper as they are, the sphere squeezed further, part of the bowl."""

from collections.abc import Iterator
from functools import partial

import numpy as np

import warp_contact as wc
from trials.case import UP, Case
from trials.watch import Setting
from warp_contact import scenes

FPS = 60.0
SQUEEZES = 0.7, 0.5, 0.3, 0.15  # of the sphere's diameter
SPEED = 0.1  # of the upper cube [m/s]
REST = 0.2  # between squeeze and release [s]
LIMIT = 600.0  # seconds that the larger scenes may take


def cases(quick: bool) -> Iterator[Case]:
    """Every one; the quick run is shorter and takes fewer fruits."""
    seconds = 0.5 if quick else 2.0
    yield Case("B4 three cubes on a membrane", partial(membrane, seconds))
    for part in SQUEEZES[:2] if quick else SQUEEZES:
        yield Case(f"B5 sphere squeezed to {part:.0%} and released", partial(squeezed, part))
    for friction in (0.3, 0.0):
        name = f"B6 stack of nine membranes, friction {friction:g}"
        yield Case(name, partial(stack, 0.25 * seconds, friction), limit=LIMIT)
    fraction = 0.05 if quick else 0.15
    name = f"B7 bowl, {fraction:.0%} of the fruit"
    yield Case(name, partial(bowl, 0.25 * seconds, fraction), limit=LIMIT)
    yield Case("Fig. 1 arches on slabs", partial(arches, seconds), limit=LIMIT)
    yield Case("Fig. 6 two pairs of blocks", partial(blocks, seconds))


def membrane(seconds: float) -> Setting:
    """Cubes of masses 1 : 4 : 16."""
    pairs = tuple((0, k, UP) for k in (1, 2, 3))
    return Setting(scenes.load("cubes_on_membrane").build(), seconds, FPS, pairs=pairs)


def squeezed(part: float) -> Setting:
    """The upper cube comes down until the gap is a part of the diameter, waits and goes up."""
    module = scenes.load("squeezed_sphere")
    scene = module.build(speed=SPEED)
    upper = scene.bodies[2]
    held = np.flatnonzero(upper.fixed)
    gap = float(upper.x[:, 2].min()) - module.EDGE
    down = (gap - part * 2.0 * module.RADIUS) / SPEED

    def drive(sim: wc.Simulation) -> None:
        waiting, up = sim.time >= down, sim.time >= down + REST
        sim.set_velocity(upper, (0.0, 0.0, SPEED * (up - (not waiting))), held)

    pairs = (0, 1, UP), (1, 2, UP)
    return Setting(scene, 2.0 * down + REST, FPS, pairs=pairs, drive=drive)


def stack(seconds: float, friction: float) -> Setting:
    """Nine membranes fall on each other."""
    return Setting(scenes.load("membrane_stack").build(friction=friction), seconds, FPS)


def bowl(seconds: float, fraction: float) -> Setting:
    """Fruits fall into a dish."""
    return Setting(scenes.load("bowl").build(fraction=fraction), seconds, FPS, pairs=())


def arches(seconds: float) -> Setting:
    """A coarse arch on a fine slab, a fine one on a coarse one."""
    pairs = (0, 1, UP), (2, 3, UP)
    return Setting(scenes.load("sampling").build(), seconds, FPS, pairs=pairs)


def blocks(seconds: float) -> Setting:
    """Blocks that start in each other; their outer ends are held."""
    pairs = (0, 1, UP), (2, 3, UP)
    scene = scenes.load("two_bodies").build()
    return Setting(scene, seconds, FPS, pairs=pairs, recovers=True)
