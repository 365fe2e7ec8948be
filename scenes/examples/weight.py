"""A block at rest on a plate that is tilted: its contact forces are m g cos(a) and m g sin(a).

Gravity is tilted in place of the plate. ``python -m warp_contact.scenes.examples.weight``
"""

import numpy as np

import warp_contact as wc

EDGE = 0.1  # of the block [m]
DENSITY = 1000.0  # [kg/m^3]
GRAVITY = 9.81  # [m/s^2]
FRICTION = 0.5  # the block slides where this is less than tan(tilt)
FRAMES = 60  # until it is at rest
VIEW = {"eye": (0.5, -0.8, 0.4), "target": (0.0, 0.0, 0.05)}


def build(tilt: float = 20.0) -> wc.Scene:
    """A plate, whose upper side is at z = 0, and the block on it; ``tilt`` in degrees."""
    a = np.radians(tilt)
    gravity = (GRAVITY * np.sin(a), 0.0, -GRAVITY * np.cos(a))
    scene = wc.Scene(gravity, friction=FRICTION)
    rubber = wc.NeoHookean(1e5, 0.3, DENSITY, damping=4e-3)
    plate = wc.box((0.4, 0.4, 0.02), (4, 4, 1))
    scene.add_body(plate, rubber, (0.0, 0.0, -0.01), fixed=True, label="plate")
    scene.add_body(wc.box(EDGE, 3), rubber, (0.0, 0.0, EDGE / 2), label="block")
    return scene


def main(tilt: float = 20.0, frames: int = FRAMES) -> tuple[np.ndarray, np.ndarray]:
    """Force on the block [N], across the plate and along it, and that of the closed form."""
    sim = wc.Simulation(build(tilt))
    for _ in sim.frames(frames):
        pass
    force = sim.forces()["plate", "block"]  # on the plate, which was added first
    weight = DENSITY * EDGE**3 * GRAVITY
    expected = weight * np.array([np.cos(np.radians(tilt)), np.sin(np.radians(tilt))])
    found = np.array([-force.normal[2], force.friction[0]])
    print("normal, friction:", found.round(4), "N; closed form:", expected.round(4), "N")
    print("at", force.point.round(4), "m; on the block", sim.force_on("block").round(4), "N")
    return found, expected


if __name__ == "__main__":
    main()
