"""A7: at rest a block presses with its weight, whatever carries it.

    sum F_n = rho L^3 G,  the centre of pressure is below the centre of mass,
    and on three points each carries the barycentric part of the centre of mass among them.

On a plane and on another block, whose cells, direction and stiffness are its own; then on a
membrane held at its rim and on the tips of three fixed tets. Last, a light cube carries an equal
one R times as dense, R from 1 to 10000: E = 20 R rho G L, 5 % of strain in it, Poisson ratio 0. It
starts in the static state of a column, the wave speeds differ by sqrt(R).
"""

import numpy as np
from measure.figure import Figure, Figures, relative, zero

import warp_contact as wc
from verification.columns import Column, Pile, between
from verification.setup import G, forces, masses, rest, watch
from warp_contact.measure.contact_fields import vertex_area

EDGE = 0.1  # of a block [m]
YOUNG, POISSON, DENSITY, DAMPING = 5e4, 0.3, 1000.0, 2e-3  # [Pa], [-], [kg/m^3], [s]
WEIGHT = DENSITY * EDGE**3 * G  # [N]
GAP = 0.005  # stacked blocks fall by this [m]
SETTLE, SAMPLE = 2.0, 0.5  # [s]
STACK_SAMPLE = 1.0  # [s]
FPS = 60
STRAIGHT = 0.0, 0.0, 0.0, 1.0
TURN = 0.0, 0.0, np.sin(np.radians(10.0)), np.cos(np.radians(10.0))  # 20 degrees about z
STACKS = {  # case: (cells of the lower block, of the upper, ratio of stiffness, rotation)
    "on a plane": (3, None, 1.0, STRAIGHT),
    "on a block 3:4": (3, 4, 1.0, STRAIGHT),
    "on a block 4:3": (4, 3, 1.0, STRAIGHT),
    "on a block 3:4, turned by 20 degrees": (3, 4, 1.0, TURN),
    "on a block 3:4, lower one 10 times stiffer": (3, 4, 0.1, STRAIGHT),
    "on a block 3:4, upper one 10 times stiffer": (3, 4, 10.0, STRAIGHT),
}
SHEET, SHEET_CELLS = (0.3, 0.3, 0.02), (12, 12, 1)  # [m]
TIPS = np.array([[-0.03, -0.025], [0.035, -0.02], [0.005, 0.04]])  # (x, y) [m]
SPIKE = 0.02  # height of a supporting tet [m]
STIFF = 20.0  # times the modulus of the block on the tips: it tilts by its dents, 1e-3
GRIP = 0.02  # friction on the tips: holds against that tilt, adds 2e-4 to the size of a force
MASSES = 1.0, 10.0, 100.0, 1e3, 1e4  # R
CUBES, APART = (2, 3), 3e-5  # cells of the light and the heavy cube, gap at the start [m]
REST, LEAST = 10.0, 200  # 1 / (slowest frequency), frames
BLOCK = 10  # frames in a force of the ripple: one alone is a step or two

FORCE = 0.02, 0.001, 1e-5
RIPPLE = 0.05, 0.005, 1e-5
CENTRE = 0.02, 0.001, 1e-5  # of an edge of the block: the moment balance, as sharp as the force


def run(quick: bool) -> Figures:
    """What carries the block, one after the other; the quick run takes the first two stacks."""
    for case, stack in list(STACKS.items())[: 2 if quick else None]:
        yield from stacked(f"A7 {case}", stack)
    yield from centre("A7 on a plane, centre of pressure")
    yield from on_sheet("A7 on a membrane")
    yield from on_points("A7 on three points")


def rubber(stiff: float = 1.0) -> wc.NeoHookean:
    """The material of a block."""
    return wc.NeoHookean(stiff * YOUNG, POISSON, DENSITY, DAMPING)


def settled(bodies: list, friction=0.3, plane=False) -> wc.Simulation:
    """A scene of bodies, each the arguments of ``add_body``, after it came to rest."""
    scene = wc.Scene((0.0, 0.0, -G), friction)
    for body in bodies:
        scene.add_body(*body)
    if plane:
        scene.add_plane((0.0, 0.0, 1.0))
    sim = wc.Simulation(scene, fps=FPS)
    watch(sim, SETTLE)
    return sim


def steady(label: str, name: str, mean: float, force: np.ndarray, weight: float) -> Figures:
    """Mean and ripple of a force [N] that ought to be a weight."""
    yield relative(label, f"mean force{name} [N]", mean, weight, FORCE)
    ripple = np.std(force) / max(mean, 1e-9)
    yield zero(label, f"ripple of the force{name} [of the mean]", ripple, RIPPLE)


def stacked(label: str, stack: tuple) -> Figures:
    """Let a stack come to rest, then watch the forces between all that touches."""
    lower, upper, ratio, turn = stack
    soft = max(1.0, 1.0 / ratio)
    bodies = [(wc.box(EDGE, lower), rubber(soft), (0, 0, 0.5 * EDGE + GAP))]
    if upper:
        place = (0.0, 0.0, 1.5 * EDGE + 2.0 * GAP)
        bodies.append((wc.box(EDGE, upper), rubber(ratio * soft), place, turn))
    carried = {("body0", "plane0"): ("plane0 on lower", len(bodies) * WEIGHT)}
    carried |= {("body0", "body1"): ("upper on lower", WEIGHT)} if upper else {}
    sim = settled(bodies, plane=True)
    found = watch(sim, STACK_SAMPLE, lambda: (*forces(sim, *carried), sim.measure().overlap)).T
    for (name, weight), force in zip(carried.values(), found[:-1], strict=True):
        yield from steady(label, f", {name}", force.mean(), force, weight)
    overlap = 100.0 * found[-1].max() / float(sim.model.body_edge.numpy().min())
    yield Figure(label, "deepest overlap [% of an edge]", overlap, most=0.1)


def centre(label: str) -> Figures:
    """Moment balance about the centre of mass, from the pressure at the vertices."""
    block = wc.box(EDGE, 3), rubber(), (0.0, 0.0, 0.5 * EDGE)
    sim = settled([block], friction=0.0, plane=True)
    mass = masses(sim)

    def look() -> tuple[float, ...]:
        area, x = vertex_area(sim.model, sim.state.x), sim.positions()
        force = sim.contact_fields()["pressure"] * area
        moment = force @ x.astype(float) - force.sum() * (mass @ x) / mass.sum()
        return *moment[:2], force.sum()

    *moment, total = watch(sim, SAMPLE, look).mean(axis=0)
    arm = np.linalg.norm(moment) / total
    yield zero(label, "offset from the centre of mass [of an edge]", arm / EDGE, CENTRE)
    yield relative(label, "sum of the nodal forces [N]", total, WEIGHT, FORCE)


def on_sheet(label: str) -> Figures:
    """The block on a membrane held at its rim."""
    sheet = wc.box(SHEET, SHEET_CELLS)
    rim = np.abs(sheet.vertices[:, :2]).max(axis=1) > 0.499 * SHEET[0]
    place = (0.0, 0.0, 0.5 * SHEET[2] + 1e-3 + 0.5 * EDGE)
    sheet = sheet, rubber(20.0), (0, 0, 0), STRAIGHT, (0, 0, 0), rim
    sim = settled([sheet, (wc.box(EDGE, 3), rubber(), place)])
    force = watch(sim, SAMPLE, lambda: forces(sim, ("body0", "body1")))
    yield from steady(label, "", force.mean(), force, WEIGHT)


def on_points(label: str) -> Figures:
    """The block on three tips."""
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    foot = 0.5 * SPIKE * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle - 2.0], axis=1)
    spike = wc.TetMesh(np.vstack([np.zeros((1, 3)), foot]), [[0, 1, 2, 3]])
    material = wc.NeoHookean(YOUNG, POISSON, DENSITY)
    bodies = [(spike, material, (x, y, 0.0), STRAIGHT, (0, 0, 0), True) for x, y in TIPS]
    bodies.append((wc.box(EDGE, 4), rubber(STIFF), (0.0, 0.0, 1e-4 + 0.5 * EDGE)))
    sim = settled(bodies, GRIP)
    pairs = [(f"body{k}", "body3") for k in range(3)]
    mean = watch(sim, SAMPLE, lambda: forces(sim, *pairs)).mean(axis=0)
    mass, x = masses(sim, 3), sim.positions(3).astype(float)
    part = np.linalg.solve(np.vstack([TIPS.T, np.ones(3)]), [*(mass @ x / mass.sum())[:2], 1.0])
    for k, force in enumerate(mean):
        yield relative(label, f"mean force on tip {k} [N]", force, part[k] * WEIGHT, FORCE)


def ladder(quick: bool) -> Figures:
    """A light cube below a heavy one; the quick run leaves out every second ratio."""
    for ratio in MASSES[:: 2 if quick else 1]:
        yield from carry(ratio)


def cubes(ratio: float, young: float, damping: float = 0.0) -> Pile:
    """Both, the centre of the light one at the origin."""
    both = [
        Column(young, EDGE, density, (n, n, n), (EDGE, EDGE), damping=damping)
        for density, n in zip((DENSITY, ratio * DENSITY), CUBES, strict=True)
    ]
    return Pile(both, APART, -0.5 * EDGE, gravity=G, friction=0.3)


def carry(ratio: float) -> Figures:
    """Mean and ripple of the force on the light cube's top, and the overlap there."""
    label = f"A7m heavy on light, mass ratio {ratio:g}"
    young = 20.0 * ratio * DENSITY * G * EDGE
    sim = cubes(ratio, young).simulate(0.0)
    omega = float(np.sqrt(young * EDGE / (ratio * DENSITY * EDGE**3)))
    force = rest(sim, omega, REST, lambda: between(sim), 0.5, LEAST)[:, 0]
    blocks = force[: len(force) // BLOCK * BLOCK].reshape(-1, BLOCK).mean(axis=1)
    yield from steady(label, "", force.mean(), blocks, ratio * WEIGHT)
    yield zero(label, "deepest overlap [of an edge]", sim.measure().overlap * CUBES[1] / EDGE)
