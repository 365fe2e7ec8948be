"""Two free blocks collide: momenta, energy and overlap.

The blocks meet along z, without gravity, damping or friction. In "turned" placements the whole
setting is rotated, which should change nothing; in "tilted" ones the second block alone, which
then hits with a corner.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

import warp_contact as wc
from checks.table import Row
from warp_contact.scene.scene import rotation_matrix

EDGE = 0.1  # of a block [m]
YOUNG, POISSON, DENSITY = 5e4, 0.3, 1000.0  # [Pa], [-], [kg/m^3]
SPEED = 1.0  # relative [m/s]
GAP = 0.004  # at the start [m]
SHIFT = np.array([0.02, 0.013, 0.0])  # sideways [m]
ANGLES = 17.0, 31.0, 53.0  # about x, then y, then z [degrees]
FPS = 240  # the blocks touch for some 40 ms
DURATION = 0.25  # [s]

CELLS = (3, 3), (2, 5), (8, 8), (1, 1)
RATIOS = 1.0, 100.0  # of Young's moduli
PLACES = "aligned", "shifted", "turned", "turned shifted", "tilted", "tilted shifted"
TARGETS = {  # figure: largest value
    "momentum change [of sum m |v|]": 1e-6,
    "angular momentum change [of sum m |x| |v|]": 1e-5,
    "largest energy [of that at the start]": 1.01,
    "deepest overlap [% of an edge]": 0.1,
}


@dataclass
class Motion:
    """Momentum and angular momentum of a state, about its centre of mass, with their scales."""

    p: np.ndarray
    l: np.ndarray
    p_scale: float
    l_scale: float

    @classmethod
    def of(cls, sim: wc.Simulation) -> "Motion":
        """Measure a state in double precision."""
        m = sim.model.mass.numpy().astype(float)[:, None]
        x, v = sim.positions().astype(float), sim.velocities().astype(float)
        x -= (m * x).sum(axis=0) / m.sum()
        speed = np.linalg.norm(v, axis=1)
        return cls(
            p=(m * v).sum(axis=0),
            l=np.cross(x, m * v).sum(axis=0),
            p_scale=float((m[:, 0] * speed).sum()),
            l_scale=float((m[:, 0] * np.linalg.norm(x, axis=1) * speed).sum()),
        )


def run(quick: bool) -> Iterator[Row]:
    """Every configuration, then the worst of each figure."""
    worst = dict.fromkeys(TARGETS, 0.0)
    cells = [c for c in CELLS if not (quick and c == (8, 8))]
    ratios = RATIOS[:1] if quick else RATIOS
    for (a, b), ratio, place in product(cells, ratios, PLACES):
        values = collide(build(a, b, ratio, place))
        for figure, value in values.items():
            worst[figure] = max(worst[figure], value)
            yield Row(f"collision {a}:{b} 1:{ratio:g} {place}", figure, value, TARGETS[figure])
    for figure, value in worst.items():
        yield Row("collision, worst", figure, value, TARGETS[figure])


def build(
    a: int,
    b: int,
    ratio: float,
    place: str,
    friction: float = 0.0,
    angles: Sequence[float] = ANGLES,
    shift: np.ndarray = SHIFT,
) -> wc.Scene:
    """Blocks of a and b cells along an edge, the second ``ratio`` times as stiff."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    soft = wc.NeoHookean(YOUNG, POISSON, DENSITY)
    stiff = wc.NeoHookean(ratio * YOUNG, POISSON, DENSITY)
    q = quaternion(angles)
    whole = rotation_matrix(q) if "turned" in place else np.eye(3)
    turn = q if "turned" in place else (0.0, 0.0, 0.0, 1.0)
    other = q if "tilted" in place else turn
    upper = wc.box(EDGE, b)
    low = (upper.vertices @ rotation_matrix(other).T @ whole)[:, 2].min()
    away = np.array([0.0, 0.0, 0.5 * EDGE + GAP - low])
    if "shifted" in place:
        away += shift
    v = whole @ [0.0, 0.0, 0.5 * SPEED]
    scene.add_body(wc.box(EDGE, a), soft, -0.5 * whole @ away, turn, v, label="first")
    scene.add_body(upper, stiff, 0.5 * whole @ away, other, -v, label="second")
    return scene


def quaternion(angles) -> np.ndarray:
    """Rotations about x, then y, then z [degrees] as a quaternion (x, y, z, w)."""
    (a, b, c), (d, e, f) = (g(np.radians(angles) / 2.0) for g in (np.cos, np.sin))
    return np.array(
        [
            d * b * c - a * e * f,
            a * e * c + d * b * f,
            a * b * f - d * e * c,
            a * b * c + d * e * f,
        ]
    )


def collide(scene: wc.Scene, response=None) -> dict[str, float]:
    """Run until the blocks are apart again; the worst of each figure."""
    sim = wc.Simulation(scene, response, fps=FPS)
    start, first = Motion.of(sim), sim.measure().energy
    edge = float(sim.model.body_edge.numpy().min())
    worst = np.zeros(len(TARGETS))
    for _ in sim.frames(round(DURATION * FPS)):
        measured, now = sim.measure(), Motion.of(sim)
        figures = (
            np.linalg.norm(now.p - start.p) / start.p_scale,
            np.linalg.norm(now.l - start.l) / start.l_scale,
            measured.energy / first,
            100.0 * measured.overlap / edge,
        )
        worst = np.maximum(worst, figures)
    return dict(zip(TARGETS, worst.tolist(), strict=True))
