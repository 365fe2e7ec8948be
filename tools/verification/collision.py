"""A6: two free blocks collide: momenta, energy and overlap.

The blocks meet along z, without gravity or damping. In "turned" placements the whole setting is
rotated, which should change nothing; in "tilted" ones the second block alone, which then hits with
a corner. Thrown blocks have unequal densities, meet obliquely and spinning, with friction there,
and are followed over a thousand steps. The scales are sum m |v| and sum m |x| |v| at the start.
"""

from itertools import product

import numpy as np
from measure.figure import Figure, Figures, zero

import warp_contact as wc
from verification.setup import ALIGNED, ANGLES, masses, quaternion
from warp_contact.scene.scene import rotation_matrix

EDGE = 0.1  # of a block [m]
YOUNG, POISSON, DENSITY = 5e4, 0.3, 1000.0  # [Pa], [-], [kg/m^3]
SPEED = 1.0  # relative [m/s]
GAP = 0.004  # at the start [m]
SHIFT = np.array([0.02, 0.013, 0.0])  # sideways [m]
FPS = 240  # the blocks touch for some 40 ms
DURATION = 0.25  # at least [s]: until the blocks have parted

CELLS = (3, 3), (2, 5), (8, 8), (1, 1)
RATIOS = 1.0, 100.0  # of Young's moduli
PLACES = "aligned", "shifted", "turned", "turned shifted", "tilted", "tilted shifted"

STEPS = 1000  # of thrown blocks, at least
SPIN = 10.0  # [1/s]
SLIDE = 0.5  # sideways speed of an oblique impact [m/s]
FRICTION = 0.3  # of oblique and spinning ones
DENSITIES = 1.0, 10.0, 1000.0  # their ratios
WAYS = "head-on", "oblique", "spinning"

# 1e-7 is the random walk of float32 over a thousand steps; a corner that hits turns the blocks.
MOMENTUM, TURNED = (1e-4, 1e-6, 1e-7), (1e-4, 1e-5, 1e-6)
RISE = 1e-2, 1e-3, 0.0  # of the energy: it may only fall
OVERLAP = 0.1  # the most
NAMES = (
    "momentum change [of sum m |v|]",
    "angular momentum change [of sum m |x| |v|]",
    "largest energy [of that at the start]",
    "deepest overlap [% of an edge]",
)


def run(quick: bool) -> Figures:
    """Every placement, then thrown blocks; quick leaves out the fine ones."""
    coarse = [c for c in CELLS if c != (8, 8)], RATIOS[:1]
    for cells, ratio, place in product(*(coarse if quick else (CELLS, RATIOS)), PLACES):
        found = collide(build(*cells, ratio, place))
        yield from judged(f"A6 {cells[0]}:{cells[1]} 1:{ratio:g} {place}", found, TURNED)
    for way, ratio in product(WAYS, DENSITIES):
        yield from hit((3, 5) if quick else (5, 9), way, ratio)


def hit(cells: tuple[int, int], way: str, ratio: float) -> Figures:
    """Thrown blocks."""
    found = collide(thrown(cells, way, ratio), STEPS)
    return judged(f"A6 {way} {cells[0]}:{cells[1]} density 1:{ratio:g}", found, MOMENTUM)


def judged(label: str, found: dict[str, float], angular: tuple) -> Figures:
    """The figures of a collision against their limits."""
    momentum, turning, energy, overlap = found.items()
    yield zero(label, *momentum, MOMENTUM)
    yield zero(label, *turning, angular)
    yield Figure(label, *energy, 1.0, np.maximum(energy[1] - 1.0, 0.0), RISE)
    yield Figure(label, *overlap, most=OVERLAP)


def collide(scene: wc.Scene, steps: int = 0) -> dict[str, float]:
    """Run until the blocks are apart again, ``steps`` at least; the worst of each figure."""
    sim = wc.Simulation(scene, fps=FPS)
    edge = float(sim.model.body_edge.numpy().min())
    p, l, *scales = motion(sim)
    start, worst, done, hit = sim.measure().energy, np.zeros(len(NAMES)), 0, False
    while done < steps or sim.time < DURATION:
        sim.step_frame()
        done += sim.substeps
        measured, (p_now, l_now, *_) = sim.measure(), motion(sim)
        hit = hit or measured.n_contacts > 0
        changes = np.linalg.norm([p_now - p, l_now - l], axis=1) / scales
        energy, overlap = measured.energy / start, 100.0 * measured.overlap / edge
        worst = np.maximum(worst, [*changes, energy, overlap])
    if not hit:
        worst[:] = np.nan  # no figure of a collision
    return dict(zip(NAMES, worst.tolist(), strict=True))


def motion(sim: wc.Simulation) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Momentum and angular momentum about the centre of mass, and their scales; in doubles."""
    m = masses(sim)[:, None]
    x, v = sim.positions().astype(float), sim.velocities().astype(float)
    x -= (m * x).sum(axis=0) / m.sum()
    speed = np.linalg.norm(v, axis=1)
    scales = m[:, 0] @ speed, m[:, 0] @ (np.linalg.norm(x, axis=1) * speed)
    return (m * v).sum(axis=0), np.cross(x, m * v).sum(axis=0), *scales


def build(
    a: int, b: int, ratio: float, place: str, friction=0.0, angles=ANGLES, shift=SHIFT
) -> wc.Scene:
    """Blocks of a and b cells along an edge, the second ``ratio`` times as stiff."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    turn = quaternion(angles) if "turned" in place else ALIGNED.q
    other = quaternion(angles) if "tilted" in place else turn
    whole, upper = rotation_matrix(turn), wc.box(EDGE, b)
    low = (upper.vertices @ rotation_matrix(other).T @ whole)[:, 2].min()
    away = np.array([0.0, 0.0, 0.5 * EDGE + GAP - low]) + (shift if "shifted" in place else 0.0)
    v = whole @ [0.0, 0.0, 0.5 * SPEED]
    soft, stiff = (wc.NeoHookean(k * YOUNG, POISSON, DENSITY) for k in (1.0, ratio))
    scene.add_body(wc.box(EDGE, a), soft, -0.5 * whole @ away, turn, v)
    scene.add_body(upper, stiff, 0.5 * whole @ away, other, -v)
    return scene


def thrown(cells: tuple[int, int], way: str, ratio: float) -> wc.Scene:
    """Two blocks that meet along z, the second ``ratio`` times as dense."""
    aside, spinning = float(way != "head-on"), way == "spinning"
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=FRICTION * aside)
    # A spinning block is free of the other one at any angle.
    away = (0.5 * EDGE + GAP) * (np.sqrt(2.0) if spinning else 1.0)
    for k, sign in enumerate((-1.0, 1.0)):
        mesh = wc.box(EDGE, cells[k])
        spin = sign * SPIN * spinning * np.array([0.6, 0.0, 0.8])
        v = np.cross(spin, mesh.vertices) - sign * 0.5 * np.array([SLIDE * aside, 0.0, SPEED])
        material = wc.NeoHookean(YOUNG, POISSON, DENSITY * ratio**k)
        place = sign * (0.5 * SHIFT * aside + [0.0, 0.0, away])
        scene.add_body(mesh, material, place, velocity=v)
    return scene
