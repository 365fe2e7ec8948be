"""A1: overlapping columns are springs in series, and a stack of cubes is one column.

    p = (g - s) / (L1/E1 + L2/E2),  s = rho1 G L1^2 / 2 E1 - rho2 G L2^2 / 2 E2
    interface at L1 - p L1/E1 - rho1 G L1^2 / 2 E1

for an overlap g of two rest shapes, Poisson ratio 0, outer ends held; s is what gravity adds to
the gap (Spillmann and Teschner 2005, Fig. 6, put into numbers with the strength of materials).
The densities of the weightless cases go with the moduli, so that both columns have the same
wave speed; the equilibrium does not know them.

    pressure above cube k = rho G (5 - k) L,  settlement of the top = rho G (5 L)^2 / 2 E

for five cubes of length L under their own weight, base held. They start in this state, with a
resting gap between them.
"""

from typing import NamedTuple

import numpy as np
from measure.figure import Figure, Figures, relative, zero

from verification.columns import Column, Pile, between
from verification.setup import ALIGNED, MESHES, ZETA, G, Pose, rest

# Good: the quantum of the paper's search, 2^-5 of the overlap. Excellent: half of what penalty
# forces of 100 E / L leave. Best: float32.
LIMITS = 0.031, 0.005, 1e-5
SETTLE, STACK_SETTLE = 14.0, 10.0  # 1 / (slowest frequency): exp(-0.7 * 14) = 6e-5 are left
DAMPED = 0.35  # ratio of the slowest mode in the run with a damped material
LAYERS = 8  # of cells along a column
COUNT, YOUNG, DENSITY = 5, 1e6, 1000.0  # of cubes of 1 m [Pa], [kg/m^3]: 4.9 % strain at the base
CELLS = (4, 4), (4, 3)  # of the cubes, in turn
GAP = 2.5e-4  # between the cubes at the start [m]: a thousandth of an edge of a cell


class Case(NamedTuple):
    """Young's moduli [Pa], lengths [m], overlap of the rest shapes [m], density or None."""

    e1: float
    l1: float
    e2: float
    l2: float
    overlap: float
    density: float | None = None

    @property
    def exact(self) -> tuple[float, float]:
        """Pressure [Pa] and height of the interface [m]."""
        weight = (self.density or 0.0) * G
        first, second = 0.5 * weight * self.l1**2 / self.e1, 0.5 * weight * self.l2**2 / self.e2
        pressure = (self.overlap - first + second) / (self.l1 / self.e1 + self.l2 / self.e2)
        return pressure, self.l1 - pressure * self.l1 / self.e1 - first


CASES = {
    "equal": Case(1e5, 1.0, 1e5, 1.0, 0.1),
    "ratio 3": Case(1e5, 1.0, 3e5, 1.0, 0.1),
    "ratio 10": Case(1e5, 1.0, 1e6, 1.0, 0.1),
    "ratio 100": Case(1e5, 1.0, 1e7, 1.0, 0.1),
    "ratio 1e4": Case(1e4, 1.0, 1e8, 1.0, 0.1),
    "unequal lengths": Case(2e5, 0.5, 1e5, 2.0, 0.05),
    "gravity": Case(1e6, 1.0, 3e6, 1.0, 0.02, 1000.0),
}


def run(quick: bool) -> Figures:
    """Every case on all meshes, of 4 or 6 cells across the upper column; quick on two."""
    few = ((4, "structured", False), (6, "jittered", True))
    full = [(n, mesh, turned) for n in (4, 6) for mesh in MESHES for turned in (False, True)]
    for name in CASES:
        for across, mesh, turned in few if quick else full:
            yield from press(name, across, mesh, Pose(turned))
    yield from press("equal", 6, "structured", ALIGNED, DAMPED)


def press(name: str, across: int, mesh: str, pose: Pose, damped=0.0) -> Figures:
    """Let the columns push each other apart, to rest.

    ``damped``: of the slowest mode, by the material instead of by relaxation.
    """
    case = CASES[name]
    label = f"A1 {name} 4:{across} {mesh} {pose.name}{' damped' if damped else ''}"
    columns = []
    for k, (e, length, n) in enumerate(((case.e1, case.l1, 4), (case.e2, case.l2, across))):
        density = case.density or 1e-2 * e
        columns.append(Column(e, length, density, (n, n, LAYERS), mesh=mesh, seed=k))
    omega = min(c.slowest for c in columns)
    columns = [c._replace(damping=2.0 * damped / omega) for c in columns]
    gravity = G if case.density else 0.0
    pile = Pile(columns, -case.overlap, clamped=True, pose=pose, gravity=gravity)
    sim = pile.simulate()
    lasts, zeta = (SETTLE * ZETA / damped, 0.0) if damped else (SETTLE, ZETA)
    force = rest(sim, omega, lasts, lambda: between(sim), zeta=zeta).mean()
    exact, interface = case.exact
    yield relative(label, "contact force / section [Pa]", force, exact, LIMITS)
    for k, side in enumerate(("lower", "upper")):
        z = float(pile.face(sim, k, 1 - 2 * k).mean())
        name, off = f"mean height of the {side} face [m]", (z - interface) / case.overlap
        yield Figure(label, name, z, interface, off, LIMITS)
    left = sim.measure().overlap / case.overlap
    yield zero(label, "deepest overlap [of that at the start]", left, LIMITS)
    if case.density is None:
        body = sim.scene.bodies[0]
        z = body.mesh.vertices[body.mesh.tets].mean(axis=1)[:, 2] / case.l1 + 0.5
        layer = np.clip((z * LAYERS).astype(int), 0, LAYERS - 1)
        weighed = (body.mesh.volumes * pile.pressures(sim, body), body.mesh.volumes)
        p = np.divide(*(np.bincount(layer, values) for values in weighed))
        worst = p[np.abs(p - exact).argmax()]
        yield relative(label, "stress of the worst layer [Pa]", worst, exact, LIMITS)


def stack(quick: bool) -> Figures:
    """Equal and other cells; the full run turns them, mirrors and jitters the meshes too."""
    plain = [(cells, "structured", False) for cells in CELLS]
    more = [(cells, mesh, True) for cells in CELLS for mesh in ("mirrored", "jittered")]
    for cells, mesh, turned in plain if quick else plain + more:
        yield from stand(cells, mesh, Pose(turned))


def stand(cells: tuple[int, int], mesh: str, pose: Pose) -> Figures:
    """Forces between the cubes and the height of the top."""
    label = f"A1 stack of five {cells[0]}:{cells[1]} {mesh} {pose.name}"
    cubes = []
    for k in range(COUNT):
        cubes.append(Column(YOUNG, 1.0, DENSITY, (cells[k % 2],) * 3, mesh=mesh, seed=k))
    pile = Pile(cubes, GAP, pose=pose, gravity=G, friction=0.3)
    sim = pile.simulate(0.0)
    found = rest(sim, cubes[0].slowest / COUNT, STACK_SETTLE, lambda: between(sim))
    for k, pressure in enumerate(found.mean(axis=0)):
        exact = DENSITY * G * (COUNT - 1 - k)
        yield relative(label, f"pressure above cube {k} [Pa]", pressure, exact, LIMITS)
    settled = COUNT - pile.face(sim, -1, 1).mean()
    exact = DENSITY * G * COUNT**2 / (2.0 * YOUNG)
    yield relative(label, "settlement of the top [m]", settled, exact, LIMITS)
