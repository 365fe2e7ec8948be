"""A parameter sweep: at which friction and tilt a block slides, in processes side by side.

It slides where friction < tan(tilt), with the acceleration g (sin(a) - friction cos(a)).
``python -m warp_contact.scenes.examples.friction_sweep``; the same command again goes on.
"""

from math import cos, radians, sin

import warp_contact as wc

GRAVITY = 9.81  # [m/s^2]
FRICTIONS = 0.2, 0.4, 0.6
TILTS = 10.0, 20.0, 30.0  # [degrees]


def slide(friction: float, tilt: float, frames: int = 30) -> float:
    """Speed [m/s] of a block after some frames on a plane; gravity is tilted in its place."""
    a = radians(tilt)
    scene = wc.Scene((GRAVITY * sin(a), 0.0, -GRAVITY * cos(a)), friction=friction)
    scene.add_plane((0.0, 0.0, 1.0))
    rubber = wc.NeoHookean(1e6, 0.3, 1000.0, damping=2e-3)
    scene.add_body(wc.box((0.2, 0.2, 0.05), (4, 4, 1)), rubber, (0.0, 0.0, 0.025), label="block")
    sim = wc.Simulation(scene, integrator="implicit")
    for _ in sim.frames(frames):
        pass
    return float(sim.velocities("block")[:, 0].mean())


def expected(friction: float, tilt: float, frames: int = 30) -> float:
    """The same of a rigid block that does not tip over [m/s]."""
    a = radians(tilt)
    return max(0.0, GRAVITY * (sin(a) - friction * cos(a))) * frames / 60.0


def main(out: str | None = "out/friction", executor=None) -> list[float]:
    """The speed in each case; each has a line in ``results.jsonl`` of the folder ``out``."""
    cases = [{"friction": f, "tilt": t} for f in FRICTIONS for t in TILTS]
    speeds = wc.sweep(slide, cases, executor, out=out)
    for case, speed in zip(cases, speeds, strict=True):
        print(case, f"{speed:.3f} m/s, closed form {expected(case['friction'], case['tilt']):.3f}")
    return speeds


if __name__ == "__main__":  # each process imports this file
    main()
