"""A1d: five cubes on each other, under their own weight, are one column.

    pressure above cube k = rho G (5 - k) L,  settlement of the top = rho G (5 L)^2 / 2 E
    u(z) = -rho G (H z - z^2 / 2) / E,  H = 5 L

Poisson ratio 0, base held. They start in this state, with a resting gap between them.
"""

from collections.abc import Iterator

import numpy as np

import warp_contact as wc
from verification.figure import Figure, relative
from verification.relax import relax, step_rate
from verification.setup import Ask, G, Pose, block, on_face

COUNT, EDGE = 5, 1.0  # [m]
YOUNG, DENSITY = 1e6, 1000.0  # [Pa], [kg/m^3]: 4.9 % of strain at the base
CELLS = (4, 4), (4, 3)  # of the cubes, in turn
GAP = 2.5e-4  # between the cubes at the start [m]: a thousandth of an edge of a cell
# As for two columns: the quantum of the paper's search, then what the other levels ask there.
LIMITS = 0.031, 0.005, 1e-5
SETTLE = 10.0  # 1 / (slowest frequency); the start is near the end
SAMPLE = 0.2  # part of the frames at the end over which forces are averaged


def run(ask: Ask) -> Iterator[Figure]:
    """Equal and other cells; the full run turns them, mirrors and jitters the meshes too."""
    plain = [(cells, "structured", False) for cells in CELLS]
    more = [(cells, mesh, True) for cells in CELLS for mesh in ("mirrored", "jittered")]
    for cells, mesh, turned in plain if ask.quick else plain + more:
        yield from stand(ask, cells, mesh, Pose(turned))


def build(cells: tuple[int, int], mesh: str, seed: int, pose: Pose) -> wc.Scene:
    """The cubes in their rest shapes, above each other."""
    scene = wc.Scene(gravity=pose.out((0.0, 0.0, -G)))
    material = wc.Corotated(YOUNG, 0.0, DENSITY)
    for k in range(COUNT):
        rest = block(EDGE, cells[k % 2], mesh, seed + k)
        place = pose.out((0.0, 0.0, (k + 0.5) * EDGE + k * GAP))
        held = on_face(rest, 2, -1) if k == 0 else None
        scene.add_body(rest, material, place, pose.q, fixed=held, label=f"cube{k}")
    return scene


def sunk(z: np.ndarray) -> np.ndarray:
    """The exact displacement [m] at a height z of the column [m]."""
    return -DENSITY * G * (COUNT * EDGE * z - 0.5 * z**2) / YOUNG


def stand(ask: Ask, cells: tuple[int, int], mesh: str, pose: Pose) -> Iterator[Figure]:
    """Forces between the cubes and the height of the top."""
    label = f"A1 stack of five {cells[0]}:{cells[1]} {mesh} {pose}"
    scene = build(cells, mesh, ask.seed, pose)
    speed = float(np.sqrt(YOUNG / DENSITY))
    contacts = (cells[0] + 1) ** 2 + (cells[1] + 1) ** 2
    respond = ask.respond(100.0 * YOUNG * EDGE / COUNT / contacts)
    sim = wc.Simulation(scene, respond, fps=step_rate(EDGE / cells[0], speed))
    start = []
    for k, body in enumerate(scene.bodies):
        x = pose.back(body.x)
        x[:, 2] += sunk(x[:, 2] - k * GAP)
        start.append(pose.out(x))
    sim.state.x.assign(np.concatenate(start).astype(np.float32))
    omega = 0.5 * np.pi * speed / (COUNT * EDGE)
    frames = int(np.ceil(SETTLE / omega * sim.fps))
    forces = np.zeros(COUNT - 1)
    first = int((1.0 - SAMPLE) * frames)
    for frame in relax(sim, omega, frames):
        if frame > first:
            now = sim.measure().forces
            forces += [now.get((f"cube{k}", f"cube{k + 1}"), 0.0) for k in range(COUNT - 1)]
    for k, force in enumerate(forces / (frames - first)):
        exact = DENSITY * G * (COUNT - 1 - k) * EDGE
        yield relative(label, f"pressure above cube {k} [Pa]", force / EDGE**2, exact, LIMITS)
    top = scene.bodies[-1]
    z = pose.back(sim.positions(top))[on_face(top.mesh, 2, 1), 2].mean()
    settled, exact = COUNT * EDGE - z, -sunk(COUNT * EDGE)
    yield relative(label, "settlement of the top [m]", settled, exact, LIMITS)
