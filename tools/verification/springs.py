"""A1: two overlapping columns are two springs in series.

    p = (g - s) / (L1/E1 + L2/E2),  s = rho1 G L1^2 / 2 E1 - rho2 G L2^2 / 2 E2
    interface at L1 - p L1/E1 - rho1 G L1^2 / 2 E1

for an overlap g of the rest shapes, Poisson ratio 0, outer ends held; s is what gravity adds to
the gap (Spillmann and Teschner 2005, Fig. 6, put into numbers with the strength of materials).
The densities of the weightless cases go with the moduli, so that both columns have the same
wave speed; the equilibrium does not know them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

import warp_contact as wc
from verification import columns
from verification.columns import Column
from verification.figure import Figure, relative, zero
from verification.relax import ZETA, relax, step_rate
from verification.setup import MESHES, Ask, G, Pose

# Good: the quantum of the paper's search, 2^-5 of the overlap. Excellent: half of what penalty
# forces of 100 E / L leave. Best: float32.
LIMITS = 0.031, 0.005, 1e-5
SETTLE = 14.0  # 1 / (slowest frequency): exp(-0.7 * 14) = 6e-5 of the overlap remain
SAMPLE = 0.2  # part of the frames at the end over which forces are averaged
DAMPED = 0.35  # ratio of the slowest mode in the run with a damped material


@dataclass(frozen=True)
class Case:
    """Young's moduli [Pa], lengths [m], overlap of the rest shapes [m], density or None."""

    e1: float
    l1: float
    e2: float
    l2: float
    overlap: float
    density: float | None = None

    @property
    def gravity(self) -> float:
        """Downwards [m/s^2]."""
        return G if self.density else 0.0

    @property
    def sinks(self) -> tuple[float, float]:
        """By its own weight: the top of column 1, and the foot of the hanging column 2 [m]."""
        weight = (self.density or 0.0) * self.gravity
        return 0.5 * weight * self.l1**2 / self.e1, 0.5 * weight * self.l2**2 / self.e2

    @property
    def pressure(self) -> float:
        """Exact [Pa]."""
        first, second = self.sinks
        return (self.overlap - first + second) / (self.l1 / self.e1 + self.l2 / self.e2)

    @property
    def interface(self) -> float:
        """Exact height [m]."""
        return self.l1 - self.pressure * self.l1 / self.e1 - self.sinks[0]


CASES = {
    "equal": Case(1e5, 1.0, 1e5, 1.0, 0.1),
    "ratio 3": Case(1e5, 1.0, 3e5, 1.0, 0.1),
    "ratio 10": Case(1e5, 1.0, 1e6, 1.0, 0.1),
    "ratio 100": Case(1e5, 1.0, 1e7, 1.0, 0.1),
    "ratio 1e4": Case(1e4, 1.0, 1e8, 1.0, 0.1),
    "unequal lengths": Case(2e5, 0.5, 1e5, 2.0, 0.05),
    "gravity": Case(1e6, 1.0, 3e6, 1.0, 0.02, 1000.0),
}
CELLS = 4, 6  # across the upper column; the lower one has 4


def run(ask: Ask) -> Iterator[Figure]:
    """Every case; the quick run takes each on matching and on other, turned and jittered cells."""
    quick = ((4, "structured", False), (6, "jittered", True))
    full = [(n, mesh, turned) for n in CELLS for mesh in MESHES for turned in (False, True)]
    for name, case in CASES.items():
        for across, mesh, turned in quick if ask.quick else full:
            yield from press(name, case, ask, across, mesh, Pose(turned))
    yield from press("equal", CASES["equal"], ask, 6, "structured", Pose(), DAMPED)


def pair(case: Case, across: int, mesh: str, seed: int) -> tuple[Column, Column]:
    """Both columns."""
    rho = case.density
    lower = Column(
        case.e1, case.l1, (1.0, 1.0), (4, 4, 8), rho or 1e-2 * case.e1, mesh=mesh, seed=seed
    )
    upper = Column(
        case.e2,
        case.l2,
        (1.0, 1.0),
        (across, across, 8),
        rho or 1e-2 * case.e2,
        0.0,
        mesh,
        seed + 1,
    )
    return lower, upper


def press(
    name: str, case: Case, ask: Ask, across: int, mesh: str, pose: Pose, damped: float = 0.0
) -> Iterator[Figure]:
    """Let the columns push each other apart, to rest.

    ``damped``: of the slowest mode, by the material instead of by relaxation.
    """
    label = f"A1 {name} 4:{across} {mesh} {pose}{' damped' if damped else ''}"
    lower, upper = pair(case, across, mesh, ask.seed)
    speed = max(lower.wave_speed, upper.wave_speed)
    omega = 0.5 * np.pi * min(lower.wave_speed / case.l1, upper.wave_speed / case.l2)
    if damped:
        beta = 2.0 * damped / omega
        lower, upper = replace(lower, damping=beta), replace(upper, damping=beta)
    scene = columns.build(lower, upper, case.overlap, pose, case.gravity)
    # 100 E / L in all, split among the vertices of both faces.
    stiffness = 100.0 * case.e1 / (case.l1 + case.l2) / (25 + (across + 1) ** 2)
    cell = min(1.0 / across, case.l1 / 8, case.l2 / 8)
    sim = wc.Simulation(scene, ask.respond(stiffness), fps=step_rate(cell, speed))
    settle = SETTLE * (ZETA / damped if damped else 1.0) / omega
    frames = int(np.ceil(settle * sim.fps))
    forces = []
    for frame in sim.frames(frames) if damped else relax(sim, omega, frames):
        if frame > (1.0 - SAMPLE) * frames:
            forces.append(sim.measure().forces.get(("lower", "upper"), 0.0))
    yield from report(label, case, sim, pose, float(np.mean(forces)))


def report(
    label: str, case: Case, sim: wc.Simulation, pose: Pose, force: float
) -> Iterator[Figure]:
    """Pressure, both sides of the interface, what is left of the overlap, the stress."""
    g = case.overlap
    yield relative(label, "contact force / section [Pa]", force, case.pressure, LIMITS)
    for side, z in zip(("lower", "upper"), columns.faces(sim, pose), strict=True):
        off = (z.mean() - case.interface) / g
        name = f"mean height of the {side} face [m]"
        yield Figure(label, name, z.mean(), case.interface, off, LIMITS)
    yield zero(label, "deepest overlap [of that at the start]", sim.measure().overlap / g, LIMITS)
    if case.density is None:
        body = sim.scene.bodies[0]
        p = layer_means(body, columns.axial(sim, body, pose))
        worst = p[np.abs(p - case.pressure).argmax()]
        yield relative(label, "stress of the worst layer [Pa]", worst, case.pressure, LIMITS)


def layer_means(body, values: np.ndarray) -> np.ndarray:
    """Means over the eight layers of tets of a column, weighted by volume."""
    z = body.mesh.vertices[body.mesh.tets].mean(axis=1)[:, 2]
    low, high = body.mesh.vertices[:, 2].min(), body.mesh.vertices[:, 2].max()
    layer = np.clip(((z - low) / (high - low) * 8).astype(int), 0, 7)
    w = body.mesh.volumes
    return np.bincount(layer, w * values) / np.bincount(layer, w)
