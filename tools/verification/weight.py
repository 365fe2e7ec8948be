"""A7: at rest a block presses with its weight, whatever carries it.

    sum F_n = rho L^3 G,  the centre of pressure is below the centre of mass,
    and on three points each carries the barycentric part of the centre of mass among them.

On a plane and on another block as in ``tools/check.py``; then on a membrane held at its rim and on
the tips of three fixed tets.
"""

from collections.abc import Iterator

import numpy as np
from checks import weight as check

import warp_contact as wc
from verification.figure import Figure, relative, zero
from verification.setup import Ask, G

FORCE = 0.02, 0.001, 1e-5
RIPPLE = 0.05, 0.005, 1e-5
CENTRE = 0.02, 0.001, 1e-5  # of an edge of the block: the moment balance, as sharp as the force
SHEET, SHEET_CELLS = (0.3, 0.3, 0.02), (12, 12, 1)  # [m]
TIPS = np.array([[-0.03, -0.025], [0.035, -0.02], [0.005, 0.04]])  # (x, y) [m]
SPIKE = 0.02  # height of a supporting tet [m]
STIFF = 20.0  # times the modulus of the block on the tips: it tilts by its dents, 1e-3
GRIP = 0.02  # friction on the tips: holds against that tilt, adds 2e-4 to the size of a force
SETTLE, SAMPLE = 2.0, 0.5  # [s]
STIFFNESS, DAMPING = 500.0, 1.0  # of a penalty [N/m], [N s/m]: sinks by 1 % of an edge of a cell
ON_TIP = 1e4  # the same for the single contact of a tip [N/m]


def run(ask: Ask) -> Iterator[Figure]:
    """What carries the block, one after the other."""
    for case, stack in list(check.STACKS.items())[: 2 if ask.quick else None]:
        yield from checked(f"A7 {case}", stack, ask)
    yield from centre("A7 on a plane, centre of pressure", ask)
    yield from on_sheet("A7 on a membrane", ask)
    yield from on_points("A7 on three points", ask)


def checked(label: str, stack: tuple, ask: Ask) -> Iterator[Figure]:
    """The rows of ``tools/check.py`` as figures."""
    for row in check.settle(label, *stack, ask.respond(STIFFNESS, DAMPING)):
        if "[%" in row.figure and "overlap" not in row.figure:
            limits = FORCE if row.figure.startswith("mean force") else RIPPLE
            name = row.figure[: row.figure.index(" [%")] + " [of the mean]"
            yield zero(label, name, row.value / 100.0, limits)


def cube(scene: wc.Scene, height: float, cells: int = 3, stiff: float = 1.0) -> wc.Scene:
    """Add the block of ``tools/check.py``, its foot at ``height`` [m]."""
    material = wc.NeoHookean(stiff * check.YOUNG, check.POISSON, check.DENSITY, check.DAMPING)
    place = (0.0, 0.0, height + 0.5 * check.EDGE)
    scene.add_body(wc.box(check.EDGE, cells), material, place, label="block")
    return scene


def settled(
    scene: wc.Scene, ask: Ask, stiffness: float = STIFFNESS
) -> tuple[wc.Simulation, Iterator[int]]:
    """A scene after it came to rest, and the frames to sample."""
    sim = wc.Simulation(scene, ask.respond(stiffness, DAMPING), fps=check.FPS)
    for _ in sim.frames(round(SETTLE * check.FPS)):
        pass
    return sim, sim.frames(round(SAMPLE * check.FPS))


WEIGHT = check.DENSITY * check.EDGE**3 * G  # [N]


def centre(label: str, ask: Ask) -> Iterator[Figure]:
    """Moment balance about the centre of mass, from the pressure at the vertices."""
    scene = wc.Scene(gravity=(0.0, 0.0, -G), friction=0.0)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    sim, frames = settled(cube(scene, 0.0), ask)
    mass = sim.model.mass.numpy().astype(float)
    off, total = [], []
    for _ in frames:
        force = sim.contact_fields()["pressure"] * vertex_areas(sim)
        x = sim.positions().astype(float)
        off.append((force @ x - force.sum() * (mass @ x) / mass.sum())[:2])
        total.append(force.sum())
    arm = np.linalg.norm(np.mean(off, axis=0)) / np.mean(total)
    yield zero(label, "offset from the centre of mass [of an edge]", arm / check.EDGE, CENTRE)
    yield relative(label, "sum of the nodal forces [N]", np.mean(total), WEIGHT, FORCE)


def vertex_areas(sim: wc.Simulation) -> np.ndarray:
    """A third of the surface around each vertex [m^2], shape (n_vert,)."""
    tris, x = sim.model.tris.numpy(), sim.positions().astype(float)
    a, b, c = np.moveaxis(x[tris], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(tris.ravel(), np.repeat(area, 3), minlength=len(x))


def on_sheet(label: str, ask: Ask) -> Iterator[Figure]:
    """The block on a membrane held at its rim."""
    scene = wc.Scene(gravity=(0.0, 0.0, -G))
    sheet = wc.box(SHEET, SHEET_CELLS)
    rim = np.abs(sheet.vertices[:, :2]).max(axis=1) > 0.499 * SHEET[0]
    material = wc.NeoHookean(20.0 * check.YOUNG, check.POISSON, check.DENSITY, check.DAMPING)
    scene.add_body(sheet, material, fixed=rim, label="sheet")
    sim, frames = settled(cube(scene, 0.5 * SHEET[2] + 1e-3), ask)
    force = [sim.measure().forces.get(("sheet", "block"), 0.0) for _ in frames]
    mean = float(np.mean(force))
    yield relative(label, "mean force [N]", mean, WEIGHT, FORCE)
    yield zero(label, "ripple of the force [of the mean]", np.std(force) / max(mean, 1e-9), RIPPLE)


def on_points(label: str, ask: Ask) -> Iterator[Figure]:
    """The block on three tips."""
    scene = wc.Scene(gravity=(0.0, 0.0, -G), friction=GRIP)
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    foot = 0.5 * SPIKE * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle - 2.0], axis=1)
    spike = wc.TetMesh(np.vstack([np.zeros((1, 3)), foot]), [[0, 1, 2, 3]])
    material = wc.NeoHookean(check.YOUNG, check.POISSON, check.DENSITY)
    for k, (x, y) in enumerate(TIPS):
        scene.add_body(spike, material, (x, y, 0.0), fixed=True, label=f"tip{k}")
    sim, frames = settled(cube(scene, 1e-4, 4, STIFF), ask, ON_TIP)
    forces = np.zeros(3)
    n = 0
    for _ in frames:
        now = sim.measure().forces
        forces += [now.get((f"tip{k}", "block"), 0.0) for k in range(3)]
        n += 1
    mass, x = sim.model.mass.numpy()[12:].astype(float), sim.positions(3).astype(float)
    at = (mass @ x / mass.sum())[:2]
    part = np.linalg.solve(np.vstack([TIPS.T, np.ones(3)]), [*at, 1.0])
    for k, force in enumerate(forces / n):
        yield relative(label, f"mean force on tip {k} [N]", force, part[k] * WEIGHT, FORCE)
