"""Two rigid fingers grip a soft box, lift it by friction and let it fall.

They hold it while twice the friction of a finger carries its weight: 2 friction N > m g.
``python -m warp_contact.scenes.examples.gripper``
"""

import warp_contact as wc

EDGE = 0.06  # of the box [m]
DENSITY = 1000.0  # [kg/m^3]
FRICTION = 0.6
SQUEEZE = 0.004  # by which each finger presses in [m]
GAP = 0.002  # between finger and box at the start [m]
HEIGHT = 0.1  # by which it is lifted [m]
PHASES = (  # frames, speed of a finger toward the box and upwards over them
    (15, SQUEEZE + GAP, 0.0),
    (30, 0.0, HEIGHT),
    (15, 0.0, 0.0),
    (15, -0.02, 0.0),
)


def build(friction: float = FRICTION) -> wc.Scene:
    """The box stands on the floor, between the fingers."""
    scene = wc.Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0))
    foam = wc.NeoHookean(5e4, 0.3, DENSITY, damping=2e-3)
    scene.add_body(wc.box(EDGE, 3), foam, (0.0, 0.0, EDGE / 2), label="box")
    finger = wc.box((0.02, 0.04, 0.05), (1, 2, 2))
    for label, side in ("left", -1.0), ("right", 1.0):
        place = (side * (EDGE / 2 + GAP + 0.01), 0.0, 0.035)
        scene.add_body(finger, wc.Rigid(2700.0), place, fixed=True, label=label)
    return scene


def main(friction: float = FRICTION, phases=PHASES) -> list[float]:
    """Height [m] of the middle of the box at the end of each phase."""
    sim = wc.Simulation(build(friction), fps=60)
    heights = []
    for frames, inward, upward in phases:
        time = frames / sim.fps
        for label, toward in ("left", 1.0), ("right", -1.0):
            sim.set_velocity(label, (toward * inward / time, 0.0, upward / time))
        for _ in sim.frames(frames):
            pass
        heights.append(float(sim.positions("box")[:, 2].mean()))
        grip = sim.force_on("left")  # (0, 0, 0) where it does not touch
        print(f"{sim.time:.2f} s: height {heights[-1]:.4f} m; on a finger {grip.round(2)} N")
    return heights


if __name__ == "__main__":
    main()
