"""Dynamic relaxation: a scene to its equilibrium, without damping in the material.

After each frame of one or two steps the velocities are multiplied by s = exp(-2 zeta w / fps),
where w is the frequency of the slowest mode: viscous damping proportional to the mass (Underwood
1983), which vanishes at rest and so leaves the equilibrium alone. The velocities of symplectic
Euler lag by h/2, so what is scaled is v + h/2 f/m; scaling v itself would feed fast modes. A frame
of more steps would see modes of a whole number of half periods always at rest and never damp them.
"""

from collections.abc import Callable, Iterator

import numpy as np
import warp as wp

import warp_contact as wc
from warp_contact.step import forces

ZETA = 0.7  # of the slowest mode: the fastest decay without a long tail


def step_rate(edge: float, speed: float) -> float:
    """Frames per second [1/s] of about one stable step, for the shortest edge of a cell [m].

    The tets of a cell have modes of some 3.5 speed / edge, with the speed of the waves [m/s].
    """
    return 3.0 * speed / edge


def rest(
    sim: wc.Simulation, omega: float, lasts: float, of: Callable, part=0.2, least=0, calmed=True
) -> np.ndarray:
    """Let a scene come to rest; what ``of()`` is after each of the last frames, shape (n, ...).

    It ``lasts`` for so many 1 / ``omega`` [1/s], that of the slowest mode, ``least`` frames at
    least, of which a ``part`` are the last; ``calmed`` unless the material damps enough.
    """
    frames = max(least, int(np.ceil(lasts / omega * sim.fps)))
    run = relax(sim, omega, frames) if calmed else sim.frames(frames)
    return np.array([of() for frame in run if frame > (1.0 - part) * frames])


def relax(sim: wc.Simulation, omega: float, frames: int) -> Iterator[int]:
    """Step ``frames`` frames, calm each, and yield its number; ``omega`` [1/s], slowest mode."""
    factor = float(np.exp(-2.0 * ZETA * omega / sim.fps))
    for frame in sim.frames(frames):
        yield frame
        ahead = 0.5 * acceleration(sim) / (sim.fps * max(sim.substeps, 1))
        v = sim.velocities()
        mobile = sim.model.inv_mass.numpy()[:, None] > 0.0
        sim.state.v.assign(np.where(mobile, factor * (v + ahead) - ahead, v).astype(np.float32))


def acceleration(sim: wc.Simulation) -> np.ndarray:
    """By elasticity and gravity [m/s^2], none where contact balances them; shape (n_vert, 3)."""
    model = sim.model
    f_tet, on = wp.zeros(4 * model.n_tet, dtype=wp.vec3), wp.full(model.n_tet, 1, dtype=int)
    forces.internal_forces(model, sim.state.x, on, f_tet)
    a = np.zeros((model.n_vert, 3))
    np.add.at(a, model.tets.numpy().ravel(), f_tet.numpy().reshape(-1, 3).astype(float))
    a = model.inv_mass.numpy()[:, None] * a + np.array(model.gravity)
    a[sim.contact_fields()["pressure"] > 0.0] = 0.0
    return a
