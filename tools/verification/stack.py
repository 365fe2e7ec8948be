"""A1d: five cubes on each other, under their own weight, are one column.

    pressure above cube k = rho G (5 - k) L,  settlement of the top = rho G (5 L)^2 / 2 E

Poisson ratio 0, base held. They start in this state, with a resting gap between them.
"""

from collections.abc import Iterator

from measure.figure import Figure, relative

from verification.columns import Column, Pile
from verification.relax import rest
from verification.setup import Ask, G, Pose, forces, on_face

COUNT, EDGE = 5, 1.0  # [m]
YOUNG, DENSITY = 1e6, 1000.0  # [Pa], [kg/m^3]: 4.9 % of strain at the base
CELLS = (4, 4), (4, 3)  # of the cubes, in turn
GAP = 2.5e-4  # between the cubes at the start [m]: a thousandth of an edge of a cell
FRICTION = 0.3
# As for two columns: the quantum of the paper's search, then what the other levels ask there.
LIMITS = 0.031, 0.005, 1e-5
SETTLE = 10.0  # 1 / (slowest frequency); the start is near the end


def run(ask: Ask) -> Iterator[Figure]:
    """Equal and other cells; the full run turns them, mirrors and jitters the meshes too."""
    plain = [(cells, "structured", False) for cells in CELLS]
    more = [(cells, mesh, True) for cells in CELLS for mesh in ("mirrored", "jittered")]
    for cells, mesh, turned in plain if ask.quick else plain + more:
        yield from stand(ask, cells, mesh, Pose(turned))


def stand(ask: Ask, cells: tuple[int, int], mesh: str, pose: Pose) -> Iterator[Figure]:
    """Forces between the cubes and the height of the top."""
    label = f"A1 stack of five {cells[0]}:{cells[1]} {mesh} {pose}"
    across = [cells[k % 2] for k in range(COUNT)]
    cubes = [
        Column(YOUNG, EDGE, DENSITY, (n, n, n), mesh=mesh, seed=ask.seed + k)
        for k, n in enumerate(across)
    ]
    pile = Pile(cubes, GAP, pose=pose, gravity=G, friction=FRICTION)
    sim = pile.start(pile.simulate(ask))
    pairs = [(f"body{k}", f"body{k + 1}") for k in range(COUNT - 1)]
    omega = cubes[0].slowest / COUNT
    for k, force in enumerate(rest(sim, omega, SETTLE, lambda: forces(sim, *pairs)).mean(axis=0)):
        exact = DENSITY * G * (COUNT - 1 - k) * EDGE
        yield relative(label, f"pressure above cube {k} [Pa]", force / EDGE**2, exact, LIMITS)
    top = sim.scene.bodies[-1]
    z = pose.back(sim.positions(top))[on_face(top.mesh, 2, 1), 2].mean()
    exact = DENSITY * G * (COUNT * EDGE) ** 2 / (2.0 * YOUNG)
    yield relative(label, "settlement of the top [m]", COUNT * EDGE - z, exact, LIMITS)
