"""B9: fast impacts, and bodies that a step could carry through others unseen.

A body of length l misses a plate of thickness w when v h > w + l. The missing is provoked twice:
with the step left to the solver, which may take as many as it likes, and with a fixed step, which
is refused where it is too long.
"""

from collections.abc import Iterator
from functools import partial

import warp_contact as wc
from trials.case import NONE, UP, Case, soft
from trials.outcome import BEYOND, FINE
from trials.watch import Setting

THICK, LENGTH = 0.002, 0.02  # of the plate and of the block that hits it [m]
RATIOS = 0.5, 0.9, 1.1, 2.0, 5.0, 20.0  # way in a frame or a step, over the thickness
STIFF, RATE = 1e6, 400.0  # with the solver's steps: Young's modulus [Pa], frames per second
SOFT, STEP_RATE = 1e3, 400.0  # with fixed ones, which are stable for it


def cases(quick: bool) -> Iterator[Case]:
    """Every one; the quick run leaves out the finer ball."""
    for count in (41,) if quick else (41, 147):
        for speed in (10.0, 67.0):
            yield Case(
                f"B9 golf ball of {count} vertices, {speed:g} m/s", partial(golf, count, speed)
            )
    for young in (1e4, 1e7):
        yield Case(f"B9 small ball on large, E {young:g}", partial(balls, young))
    yield Case("B9 squishy ball, 5 m/s", squishy)
    for ratio in RATIOS:
        yield Case(f"B9 {ratio:g} plates a frame", partial(through, ratio, None))
    for ratio in RATIOS:
        expect = FINE if ratio < 0.6 else BEYOND
        yield Case(f"B9 {ratio:g} plates a fixed step", partial(through, ratio, 1), expect)
    yield Case("B9 plate on plate, 5 plates a frame", two_plates)


def golf(count: int, speed: float) -> Setting:
    """A golf ball hits a wall."""
    scene = wc.Scene(NONE, friction=0.3)
    wall = wc.box((0.02, 0.1, 0.1), (1, 3, 3))
    scene.add_body(wall, soft(1e7), (-0.01, 0.0, 0.0), fixed=True, label="wall")
    ball = wc.sphere(0.02, count)
    scene.add_body(
        ball, soft(1e7, 1150.0, 0.45), (0.021, 0.0, 0.0), velocity=(-speed, 0, 0), label="ball"
    )
    return Setting(scene, 0.004, 10000.0, pairs=((0, 1, (1, 0, 0)),))


def balls(young: float) -> Setting:
    """A small ball hits a large one of another stiffness and density."""
    scene = wc.Scene(NONE, friction=0.3)
    scene.add_body(wc.sphere(0.5, 147), soft(1e4), label="large")
    density = 1000.0 if young < 1e6 else 8000.0
    place = (0.0, 0.0, 0.67)
    scene.add_body(
        wc.sphere(0.15, 55), soft(young, density), place, velocity=(0, 0, -10.0), label="small"
    )
    return Setting(scene, 0.3, 500.0)


def squishy() -> Setting:
    """A soft ball hits the ground at a third of its speed of sound."""
    scene = wc.Scene((0.0, 0.0, -9.81), friction=0.3)
    scene.add_plane(UP)
    scene.add_body(wc.sphere(0.1, 147), soft(7e4), (0.0, 0.0, 0.11), velocity=(0.0, 0.0, -5.0))
    return Setting(scene, 0.2, 1000.0)


def through(ratio: float, substeps: int | None) -> Setting:
    """A block hits a thin plate that is held; with fixed steps below its speed of sound up to 2."""
    scene = wc.Scene(NONE, friction=0.3)
    young, rate = (STIFF, RATE) if substeps is None else (SOFT, STEP_RATE)
    plate = wc.box((0.1, 0.1, THICK), (3, 3, 1))
    scene.add_body(plate, soft(young), fixed=True, label="plate")
    speed = ratio * THICK * rate
    place = (0.003, 0.002, 0.5 * (THICK + LENGTH) + 0.75 * speed / rate)
    v = (0.0, 0.0, -speed)
    scene.add_body(wc.box(LENGTH, 2), soft(young), place, velocity=v, label="block")
    seconds = (4.0 * LENGTH + speed / rate) / speed + 10.0 / rate
    return Setting(scene, seconds, rate, substeps, pairs=((0, 1, UP),))


def two_plates() -> Setting:
    """Two plates fly at each other."""
    scene = wc.Scene(NONE, friction=0.3)
    speed = 2.5 * THICK * RATE
    for sign in (-1.0, 1.0):
        plate = wc.box((0.1, 0.1, THICK), (8, 8, 1))
        place = (0.005 * sign, 0.0, sign * (0.5 * THICK + 0.75 * speed / RATE))
        scene.add_body(plate, soft(STIFF), place, velocity=(0.0, 0.0, -sign * speed))
    return Setting(scene, 20.0 / RATE, RATE, pairs=((0, 1, UP),))
