"""A block comes to rest on a plane and on another block: contact force, ripple, overlap."""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from checks.table import Row

EDGE = 0.1  # of a block [m]
YOUNG, POISSON, DENSITY = 5e4, 0.3, 1000.0  # [Pa], [-], [kg/m^3]
DAMPING = 2e-3  # [s]
GAP = 0.005  # the blocks fall by this [m]
GRAVITY = 9.81  # [m/s^2]
SETTLE, SAMPLE = 2.0, 1.0  # [s]
FPS = 60
TURN = (0.0, 0.0, np.sin(np.radians(10.0)), np.cos(np.radians(10.0)))  # 20 degrees about z

STACKS = {  # case: (cells of the lower block, of the upper, ratio of stiffness, rotation)
    "on a plane": (3, None, 1.0, None),
    "on a block 3:4": (3, 4, 1.0, None),
    "on a block 4:3": (4, 3, 1.0, None),
    "on a block 3:4, turned by 20 degrees": (3, 4, 1.0, TURN),
    "on a block 3:4, lower one 10 times stiffer": (3, 4, 0.1, None),
    "on a block 3:4, upper one 10 times stiffer": (3, 4, 10.0, None),
}


def run(quick: bool) -> Iterator[Row]:
    """Every stack; the quick run takes the first two."""
    for case, stack in list(STACKS.items())[: 2 if quick else None]:
        yield from settle(f"weight {case}", *stack)


def settle(
    case: str,
    cells: int,
    upper: int | None,
    ratio: float,
    rotation: tuple | None,
    response=None,
) -> Iterator[Row]:
    """Let a stack come to rest, then watch the forces between all that touches."""
    scene = wc.Scene(gravity=(0.0, 0.0, -GRAVITY))
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    young = YOUNG if ratio >= 1.0 else YOUNG / ratio
    material = wc.NeoHookean(young, POISSON, DENSITY, DAMPING)
    scene.add_body(wc.box(EDGE, cells), material, (0, 0, 0.5 * EDGE + GAP), label="lower")
    weights = {("lower", "plane0"): DENSITY * EDGE**3 * GRAVITY}
    if upper:
        weights["lower", "upper"] = weights["lower", "plane0"]
        weights["lower", "plane0"] *= 2.0
        material = wc.NeoHookean(ratio * young, POISSON, DENSITY, DAMPING)
        place = (0.0, 0.0, 1.5 * EDGE + 2.0 * GAP)
        rotation = rotation or (0.0, 0.0, 0.0, 1.0)
        scene.add_body(wc.box(EDGE, upper), material, place, rotation, label="upper")
    sim = wc.Simulation(scene, response, fps=FPS)
    for _ in sim.frames(round(SETTLE * FPS)):
        pass
    forces, overlap = {pair: [] for pair in weights}, []
    for _ in sim.frames(round(SAMPLE * FPS)):
        measured = sim.measure()
        overlap.append(measured.overlap)
        for pair, values in forces.items():
            values.append(measured.forces.get(pair, 0.0))
    for pair, values in forces.items():
        mean, name = float(np.mean(values)), " on ".join(reversed(pair))
        error = abs(mean / weights[pair] - 1.0)
        ripple = float(np.std(values)) / mean if mean else float("inf")
        yield Row(case, f"mean force, {name} [% off the weight]", 100.0 * error, 0.1)
        yield Row(case, f"ripple, {name} [% of the mean]", 100.0 * ripple, 1.0)
    edge = float(sim.model.body_edge.numpy().min())
    yield Row(case, "deepest overlap [% of an edge]", 100.0 * max(overlap) / edge, 0.1)
    yield Row(case, "kinetic energy at the end [J]", sim.measure().kinetic)
