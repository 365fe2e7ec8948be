"""Cases in which nothing touches."""

import math
from time import process_time

import numpy as np
from verification.setup import on_face

import warp_contact as wc

DRIFT = "drift of the energy in 1 s [of it]"
FLATTENED = "rest volume of a tet [of its least]"
TIME = "processor time of 20 frames [s]"
TIMES = 3  # runs for a time


def vibrating() -> dict[str, float]:
    """Free block, let go squeezed."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(5e4, 0.3, 1000.0))
    sim = wc.Simulation(scene)
    sim.state.x.assign(sim.positions() * np.float32([1.0, 1.0, 0.6]))
    energy = [sim.measure().energy for _ in sim.frames(60)]
    first, last = np.mean(energy[:10]), np.mean(energy[-10:])
    return {DRIFT: abs(float(last / first) - 1.0)}


def pulled() -> dict[str, float]:
    """Springs pulled to five lengths."""
    scene, mesh = wc.Scene(gravity=(0.0, 0.0, 0.0)), wc.box(0.1, 3)
    top, bottom = (on_face(mesh, 2, side) for side in (1, -1))
    v = np.where(top[:, None], (0.0, 0.0, 2.0), 0.0)
    springs_only = wc.SpringNetwork(1.0, 1.0, 1.0, 1000.0)
    scene.add_body(mesh, springs_only, velocity=v, fixed=top | bottom)
    sim = wc.Simulation(scene, fps=10)
    least = min(sim.measure().volume_ratio for _ in sim.frames(2))
    return {FLATTENED: 1.0 / least if least > 0.0 else math.inf}


def crowd() -> dict[str, float]:
    """27 spheres that almost touch."""
    times, place = [], 0.1005 * np.stack(np.unravel_index(np.arange(27), (3, 3, 3)), axis=1)
    for _ in range(TIMES):
        scene, mesh = wc.Scene(gravity=(0.0, 0.0, 0.0)), wc.sphere(0.05, 80)
        for at in place:
            scene.add_body(mesh, wc.NeoHookean(5e4, 0.3, 1000.0), at)
        sim = wc.Simulation(scene)
        sim.step_frame()
        begin = process_time()
        for _ in sim.frames(20):
            pass
        times.append(process_time() - begin)
    return {TIME: min(times)}
