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
from measure.figure import Figure, relative, zero

import warp_contact as wc
from verification.columns import Column, Pile
from verification.relax import ZETA, rest
from verification.setup import ALIGNED, MESHES, Ask, G, Pose, forces

# Good: the quantum of the paper's search, 2^-5 of the overlap. Excellent: half of what penalty
# forces of 100 E / L leave. Best: float32.
LIMITS = 0.031, 0.005, 1e-5
SETTLE = 14.0  # 1 / (slowest frequency): exp(-0.7 * 14) = 6e-5 of the overlap remain
DAMPED = 0.35  # ratio of the slowest mode in the run with a damped material
LAYERS = 8  # of cells along a column


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
    def sinks(self) -> tuple[float, float]:
        """By its own weight: the top of column 1, and the foot of the hanging column 2 [m]."""
        weight = (self.density or 0.0) * G
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
    yield from press("equal", CASES["equal"], ask, 6, "structured", ALIGNED, DAMPED)


def press(
    name: str, case: Case, ask: Ask, across: int, mesh: str, pose: Pose, damped: float = 0.0
) -> Iterator[Figure]:
    """Let the columns push each other apart, to rest.

    ``damped``: of the slowest mode, by the material instead of by relaxation.
    """
    label = f"A1 {name} 4:{across} {mesh} {pose}{' damped' if damped else ''}"
    columns = []
    for k, (young, length, n) in enumerate(((case.e1, case.l1, 4), (case.e2, case.l2, across))):
        density = case.density or 1e-2 * young
        columns.append(Column(young, length, density, (n, n, LAYERS), mesh=mesh, seed=ask.seed + k))
    omega = min(c.slowest for c in columns)
    columns = [replace(c, damping=2.0 * damped / omega) for c in columns]
    gravity = G if case.density else 0.0
    pile = Pile(columns, -case.overlap, clamped=True, pose=pose, gravity=gravity)
    sim = pile.simulate(ask)
    lasts = SETTLE * (ZETA / damped if damped else 1.0)
    between = lambda: forces(sim, ("body0", "body1"))  # noqa: E731
    force = rest(sim, omega, lasts, between, calmed=not damped).mean()
    yield relative(label, "contact force / section [Pa]", force, case.pressure, LIMITS)
    g = case.overlap
    for side, z in zip(("lower", "upper"), pile.faces(sim), strict=True):
        off = float(z.mean() - case.interface) / g
        name = f"mean height of the {side} face [m]"
        yield Figure(label, name, float(z.mean()), case.interface, off, LIMITS)
    yield zero(label, "deepest overlap [of that at the start]", sim.measure().overlap / g, LIMITS)
    if case.density is None:
        p = layer_means(sim.scene.bodies[0].mesh, pile.pressures(sim, sim.scene.bodies[0]))
        worst = p[np.abs(p - case.pressure).argmax()]
        yield relative(label, "stress of the worst layer [Pa]", worst, case.pressure, LIMITS)


def layer_means(mesh: wc.TetMesh, values: np.ndarray) -> np.ndarray:
    """Means over the layers of tets of a column, weighted by volume."""
    z = mesh.vertices[mesh.tets].mean(axis=1)[:, 2]
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    layer = np.clip(((z - low) / (high - low) * LAYERS).astype(int), 0, LAYERS - 1)
    return np.bincount(layer, mesh.volumes * values) / np.bincount(layer, mesh.volumes)
