"""Bodies that are strained hard and at rest: they stay where they are."""

import numpy as np

import warp_contact as wc


def test_what_is_squeezed_rests_and_its_velocities_say_so(device):
    """A ball of 60 mm between plates, squeezed by 10 mm: it answers by its present stiffness."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.5)
    rubber = wc.NeoHookean(1e5, 0.4, 1000.0, damping=2e-3)
    scene.add_body(wc.sphere(0.03, 147), rubber, label="ball")
    for side in (-1.0, 1.0):
        plate, place = wc.box((0.08, 0.08, 0.02), 1), (0.0, 0.0, 0.0401 * side)
        scene.add_body(plate, wc.Rigid(1000.0), place, fixed=True, label=f"plate{side:+.0f}")
    sim = wc.Simulation(scene, integrator="implicit", device=str(device))
    for side in (-1, 1):
        goal = (0.0, 0.0, 0.0351 * side), (0.0, 0.0, 0.0, 1.0)
        sim.move_to(f"plate{side:+d}", over=20, pose=goal)
    for _ in sim.frames(100):
        pass
    before = sim.positions("ball")
    for _ in sim.frames(6):
        pass
    moved = np.abs(sim.positions("ball") - before).max() / 0.1  # [m/s]
    # 1.3e-5 and 1.5e-5 [m/s]; 1.0e-4 and 1.6e-4 with contacts solved as elsewhere, and velocities
    # of 0.035 by the stiffness at rest.
    assert moved < 5e-5
    assert np.abs(sim.velocities("ball")).max() < 1e-4
