"""B3: bodies of very unequal mass or stiffness; B9: fast impacts.

A body of length l misses a plate of thickness w when v h > w + l. The solver may take as many
steps h as it likes; a fixed one is in the map "speed".
"""

from collections.abc import Iterator

import warp_contact as wc
from trials.setting import NONE, UP, Case, Setting, body, case, setting, soft

EDGE = 0.1  # [m]
MAT = wc.box((1.0, 1.0, 0.1), (6, 6, 1))
THICK, LENGTH = 0.002, 0.02  # of the plate and of the block that hits it [m]
RATIOS = 0.5, 0.9, 1.1, 2.0, 5.0, 20.0  # way in a frame, over the thickness
RATE = 400.0  # frames per second


def ratios() -> Iterator[Case]:
    """B3."""
    yield case("B3a cube of mass 10^4 on a small one", heavy, 3.0)
    yield case("B3a cube of mass 10^4 strikes a small one at 5 m/s", heavy, 0.1, 5.0)
    kinds = soft(1e8, 2000.0), soft(1e4, 1000.0)
    run = {"friction": 0.1, "planes": [UP], "seconds": 1.0}
    for where, (low, high) in (("on", kinds), ("below", kinds[::-1])):
        two = body(MAT, low, 0.051), body(MAT, high, (0.03, 0.0, 0.051 + 0.103))
        yield case(f"B3b soft mat {where} a stiff board, 1:10^4", setting, *two, **run)
    for ratio in (1e2, 1e4):
        yield case(f"B3 densities 1:{ratio:g}, heavy on light", column, ratio, 1.0)
        yield case(f"B3 densities {ratio:g}:1, light on heavy", column, 1.0 / ratio, 1.0)
        yield case(f"B3 stiffness 1:{ratio:g}, stiff on soft", column, 1.0, ratio)
        yield case(f"B3 stiffness {ratio:g}:1, soft on stiff", column, 1.0, 1.0 / ratio)
    yield case("B3 block of a weight of 4 moduli, nothing else", own_weight, 4.0)


def speed() -> Iterator[Case]:
    """B9."""
    for count in (41, 147):
        for v in (10.0, 67.0):
            yield case(f"B9 golf ball of {count} vertices, {v:g} m/s", golf, count, v)
    flight = {"gravity": NONE, "seconds": 0.3, "fps": 500.0}
    for young, density in ((1e4, 1000.0), (1e7, 8000.0)):
        large = body(wc.sphere(0.5, 147), soft(1e4))
        small = body(wc.sphere(0.15, 55), soft(young, density), 0.67, v=-10.0)
        yield case(f"B9 small ball on large, E {young:g}", setting, large, small, **flight)
    # At a third of its speed of sound.
    ball = body(wc.sphere(0.1, 147), soft(7e4), 0.11, v=-5.0)
    yield case("B9 squishy ball, 5 m/s", setting, ball, planes=[UP], seconds=0.2, fps=1000.0)
    for ratio in RATIOS:
        yield case(f"B9 {ratio:g} plates a frame", through, ratio)


def own_weight(moduli: float) -> Setting:
    """A block, held at its base, whose weight over its section is so many times its modulus.

    There is no contact: what goes inside out here does so by its material (``neo_hookean.py``).
    """
    young = 1000.0 * 9.81 * EDGE / moduli
    block = body(wc.box(EDGE, 3), soft(young), fixed="base")
    return setting(block, seconds=0.1, fps=600.0, pairs=())


def heavy(seconds: float, speed: float = 0.0) -> Setting:
    """At rest the pressure on the small cube is ten times its Young's modulus."""
    small = body(wc.box(EDGE, 2), soft(1e6), 0.0505)
    large = body(wc.box(1.0, 2), soft(1e8, 1e4), 0.602, v=-speed)
    return setting(small, large, friction=0.5, planes=[UP], seconds=seconds)


def column(density: float, young: float) -> Setting:
    """A cube on one that is held; the lower one is strained by 5 % at rest, by the heavier one."""
    base = 20.0 * max(density, 1.0) * 1000.0 * 9.81 * EDGE * max(1.0, 1.0 / young)
    upper = body(wc.box(EDGE, 3), soft(base * young, 1000.0 * density), (0.004, 0.003, EDGE + 1e-3))
    return setting(body(wc.box(EDGE, 2), soft(base), fixed="base"), upper, seconds=0.3)


def golf(count: int, speed: float) -> Setting:
    """A golf ball hits a wall."""
    wall = body(wc.box((0.02, 0.1, 0.1), (1, 3, 3)), soft(1e7), (-0.01, 0.0, 0.0), fixed=True)
    rubber, v = soft(1e7, 1150.0, 0.45), (-speed, 0, 0)
    ball = body(wc.sphere(0.02, count), rubber, (0.021, 0.0, 0.0), v=v)
    pairs = ((0, 1, (1, 0, 0)),)
    return setting(wall, ball, gravity=NONE, seconds=0.004, fps=10000.0, pairs=pairs)


def through(ratio: float) -> Setting:
    """A block hits a thin plate that is held."""
    rubber = soft(1e6)
    plate = body(wc.box((0.1, 0.1, THICK), (3, 3, 1)), rubber, fixed=True)
    v = ratio * THICK * RATE
    place = (0.003, 0.002, 0.5 * (THICK + LENGTH) + 0.75 * v / RATE)
    block = body(wc.box(LENGTH, 2), rubber, place, v=-v)
    seconds = (4.0 * LENGTH + v / RATE) / v + 10.0 / RATE
    return setting(plate, block, gravity=NONE, seconds=seconds, fps=RATE)
