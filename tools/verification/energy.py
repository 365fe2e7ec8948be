"""Damping: the logarithmic decrement of a bar's first mode against what was asked.

2 pi r / sqrt(1 - r^2)  for a ratio r of the damping to the critical one
"""

from itertools import product

import numpy as np
import warp as wp
from measure.figure import Figure, Figures, zero

import warp_contact as wc
from verification.setup import masses, on_face, watch
from warp_contact.step import forces

SIZE, CELLS = (0.4, 0.1, 0.1), (8, 2, 2)  # [m], held at one end
YOUNG, POISSON, DENSITY = 1e5, 0.3, 1000.0  # [Pa], [-], [kg/m^3]
ENERGY = 1e-2, 1e-2, 1e-2  # of a spring over distance, area and volume [J]
AMPLITUDE = 1e-3  # of the first mode [m]
PERIODS, FRAMES = 3, 40  # frames in a period
RATIOS = 0.0, 0.02, 0.1  # of the damping to the critical one
MATERIALS = {
    "neo-Hookean": lambda damping: wc.NeoHookean(YOUNG, POISSON, DENSITY, damping),
    "corotated": lambda damping: wc.Corotated(YOUNG, POISSON, DENSITY, damping),
    "springs": lambda damping: wc.SpringNetwork(*ENERGY, DENSITY, damping),
}
NONE, OFF = (1e-3,), (5.0,)  # largest decrement without damping; % off with it


def run(quick: bool) -> Figures:
    """Every material and damping; the quick run leaves two materials out."""
    for name, ratio in product(list(MATERIALS)[: 1 if quick else None], RATIOS):
        yield decay(f"energy {name} damping ratio {ratio:g}", MATERIALS[name], ratio)


def decay(case: str, material, ratio: float) -> Figure:
    """Release a bar along x, held at its lower end, in its first mode and fit the envelope."""

    def start(damping: float, fps: float) -> wc.Simulation:
        scene, mesh = wc.Scene(gravity=(0.0, 0.0, 0.0)), wc.box(SIZE, CELLS)
        scene.add_body(mesh, material(damping), fixed=on_face(mesh, 0, -1))
        return wc.Simulation(scene, fps=fps)

    omega, mode = first_mode(start(0.0, 60.0))
    sim = start(2.0 * ratio / omega, FRAMES * omega / (2.0 * np.pi))
    rest = sim.positions().astype(float)
    sim.state.x.assign((rest + AMPLITUDE * mode).astype(np.float32))
    weight = masses(sim)[:, None] * mode

    def look() -> tuple[float, float]:
        return (weight * (sim.positions() - rest)).sum(), (weight * sim.velocities()).sum()

    q, p = watch(sim, PERIODS * FRAMES / sim.fps, look).T
    time = np.arange(1, len(q) + 1) / sim.fps
    damped = omega * np.sqrt(1.0 - ratio**2)
    envelope = np.log(np.hypot(damped * q, p + ratio * omega * q))
    measured = -np.polyfit(time, envelope, 1)[0] * 2.0 * np.pi / damped
    if not ratio:
        return zero(case, "logarithmic decrement", measured, NONE)
    asked = 2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2)
    return zero(case, "logarithmic decrement [% off]", 100.0 * (measured / asked - 1.0), OFF)


def first_mode(sim: wc.Simulation) -> tuple[float, np.ndarray]:
    """Angular frequency [1/s] and shape of the softest mode, largest entry 1."""
    model, n = sim.model, sim.model.n_vert
    f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
    k = np.empty((3 * n, 3 * n))
    corners = model.tets.numpy().ravel()
    for row, unit in zip(k, np.eye(3 * n, dtype=np.float32), strict=True):
        dx = wp.array(unit.reshape(n, 3), dtype=wp.vec3)
        forces.apply_stiffness(model, sim.state.x, dx, f_tet)
        f = np.zeros((n, 3))
        np.add.at(f, corners, f_tet.numpy().reshape(-1, 3).astype(float))
        row[:] = f.ravel()
    free = model.inv_mass.numpy() > 0.0
    root = np.repeat(np.sqrt(model.inv_mass.numpy()[free].astype(float)), 3)
    k = k[np.ix_(np.repeat(free, 3), np.repeat(free, 3))]
    value, vector = np.linalg.eigh(root[:, None] * 0.5 * (k + k.T) * root)
    mode = np.zeros((n, 3))
    mode[free] = (root * vector[:, 0]).reshape(-1, 3)
    return float(np.sqrt(value[0])), mode / np.abs(mode).max()
