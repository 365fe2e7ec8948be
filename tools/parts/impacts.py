"""Cases in which bodies strike each other."""

from functools import partial

import numpy as np
from trials import figures, limits
from trials.watch import attempt
from verification import collision

import warp_contact as wc

OVERLAP = "deepest overlap [% of an edge]"
SPIN = "angular momentum [of sum m |x| |v|]"
GAINED = "energy gained [of that at the start]"
APPROACH = "approach left [of that before]"


def tilted() -> dict[str, float]:
    """Collision of tilted blocks."""
    found = collision.collide(collision.build(3, 3, 1.0, "tilted"))
    return {OVERLAP: found[OVERLAP], SPIN: found["angular momentum change [of sum m |x| |v|]"]}


def oblique() -> dict[str, float]:
    """Oblique collision with friction."""
    scene = collision.thrown((3, 5), "oblique", 1.0)
    found = collision.collide(scene, steps=collision.STEPS)
    return {SPIN: found["angular momentum change [of sum m |x| |v|]"]}


def fine() -> dict[str, float]:
    """Collision of tilted blocks of 8 cells."""
    found = collision.collide(collision.build(8, 8, 1.0, "tilted"))
    return {OVERLAP: found[OVERLAP]}


def beside() -> dict[str, float]:
    """Tilted blocks of 8 cells, one aside."""
    found = collision.collide(collision.build(8, 8, 1.0, "tilted shifted"))
    return {OVERLAP: found[OVERLAP]}


def rim(friction: float = 0.0) -> dict[str, float]:
    """Corner that comes in close to a rim."""
    # Of two hundred random draws of 3:3 and 2:5 cells, one of six that need what this is to show.
    turned, shift = (161.0, 219.0, 204.0), np.array([0.015, 0.019, 0.0])
    scene = collision.build(3, 3, 1.0, "tilted shifted", friction, turned, shift)
    found = collision.collide(scene)
    return {OVERLAP: found[OVERLAP], SPIN: found["angular momentum change [of sum m |x| |v|]"]}


def rough_rim() -> dict[str, float]:
    """Corner that comes in close to a rim, with friction."""
    return rim(0.3)


def balls() -> dict[str, float]:
    """Balls of 147 vertices, one falls on the other."""
    return gained(partial(limits.balls, 147))


def gained(build) -> dict[str, float]:
    """Energy of a stability case."""
    return {GAINED: max(attempt(build, "surface").gained, 0.0)}


def bent() -> dict[str, float]:
    """Corner that slides up a bent face."""
    return gained(partial(figures.collide, 47))


def seam() -> dict[str, float]:
    """Corner on the seam of two cubes with a gap."""
    return gained(partial(limits.seam, 1e-3))


def corner() -> dict[str, float]:
    """Heavy corners over fixed ones of a light face with a free one, one step."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=1.0)
    scene.add_body(wc.box(1.0, 1), wc.NeoHookean(1e5, 0.3, 1.0), fixed=np.arange(8) != 5)
    place, v = (-0.34, -0.34, 0.68), (5.0, 5.0, -45.0)
    scene.add_body(wc.box(0.3, 1), wc.NeoHookean(1e5, 0.3, 1e6), place, velocity=v)
    sim = wc.Simulation(scene, fps=1000, substeps=1)
    before = sim.measure().kinetic
    sim.step_frame()
    after = sim.measure()
    return {GAINED: max((after.kinetic + after.elastic) / before - 1.0, 0.0)}


def thin() -> dict[str, float]:
    """Thin soft plates at 20 m/s."""
    scene, speed = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0), 20.0
    for k in range(2):
        mesh, rubber = wc.box((0.1, 0.1, 0.01), (4, 4, 1)), wc.NeoHookean(300.0, 0.3, 1000.0)
        place, v = (0.004 * k, 0.003 * k, 0.06 * k), (0.0, 0.0, -speed * k)
        scene.add_body(mesh, rubber, place, velocity=v)
    sim = wc.Simulation(scene)
    for _ in sim.frames(2):
        pass
    lower, upper = (float(sim.velocities(body)[:, 2].mean()) for body in scene.bodies)
    return {APPROACH: max(lower - upper, 0.0) / speed}
