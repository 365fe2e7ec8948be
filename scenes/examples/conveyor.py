"""A conveyor: a belt that is driven takes a parcel along by friction, then stops.

A parcel slips until it has the speed of the belt, for the time v / (friction g); it stops with the
belt after the same time. ``python -m warp_contact.scenes.examples.conveyor``
"""

import warp_contact as wc

SPEED = 0.5  # of the belt [m/s]
FRICTION = 0.4
SLIP = SPEED / (FRICTION * 9.81)  # how long the parcel slips [s]
FRAMES = 60
VIEW = {"eye": (0.9, -1.2, 0.6), "target": (0.2, 0.0, 0.0)}


def build(speed: float = SPEED) -> wc.Scene:
    """The belt's upper side is at z = 0; all its vertices are fixed, so that they can be driven."""
    scene = wc.Scene(friction=FRICTION)
    rubber = wc.NeoHookean(2e5, 0.3, 1000.0, damping=1e-3)
    belt = wc.box((1.2, 0.2, 0.02), (12, 2, 1))
    along = (speed, 0.0, 0.0)
    scene.add_body(belt, rubber, (0.0, 0.0, -0.01), velocity=along, fixed=True, label="belt")
    scene.add_body(wc.box(0.06, 2), rubber, (-0.2, 0.0, 0.03), label="parcel")
    return scene


def main(frames: int = FRAMES) -> list[float]:
    """Speed of the parcel [m/s] after each frame; the belt stops after half of them."""
    sim = wc.Simulation(build())
    speeds = []
    for frame in sim.frames(frames):
        speeds.append(float(sim.velocities("parcel")[:, 0].mean()))
        if frame == frames // 2:
            sim.set_velocity("belt", (0.0, 0.0, 0.0))
        if frame % 5 == 0:
            force = sim.force_on("parcel").round(3)
            print(f"{sim.time:.3f} s: {speeds[-1]:6.3f} m/s; on the parcel {force} N")
    return speeds


if __name__ == "__main__":
    main()
