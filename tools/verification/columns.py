"""Columns on each other along a local z axis: their scene, their exact state, their stresses.

    u(s) = -(p s + rho G (L s - s^2 / 2)) / E

under a pressure p on top, s from the foot of a column of length L. The Poisson ratio is 0: a fixed
corotated column is then exactly linear in its axial stretch, P = E (F - R) with F = R S
(Stomakhin et al. 2012).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from verification.setup import ALIGNED, Pose, block, forces, gradients, on_face, step_rate
from warp_contact.scene.scene import Body


class Column(NamedTuple):
    """E [Pa], length [m], density [kg/m^3], cells, section [m], mesh with its seed, damping [s]."""

    young: float
    length: float
    density: float
    cells: tuple[int, int, int]
    section: tuple[float, float] = (1.0, 1.0)
    mesh: str = "structured"
    seed: int = 0
    damping: float = 0.0

    @property
    def wave_speed(self) -> float:
        """Of the bar [m/s]."""
        return float(np.sqrt(self.young / self.density))

    @property
    def slowest(self) -> float:
        """Frequency of its slowest mode, held at one end [1/s]."""
        return 0.5 * np.pi * self.wave_speed / self.length


class Pile(NamedTuple):
    """Columns from below; the foot of the first is held."""

    columns: Sequence[Column]
    gap: float  # between them [m], below 0 an overlap
    base: float = 0.0  # height of the foot [m]
    clamped: bool = False  # the top of the last is held too
    pose: Pose = ALIGNED
    gravity: float = 0.0  # along -z [m/s^2]
    friction: float = 0.0

    def build(self, law=wc.Corotated) -> wc.Scene:
        """The rest shapes, of a material of that law."""
        scene = wc.Scene(self.pose.out((0.0, 0.0, -self.gravity)), self.friction)
        foot = self.base
        for c in self.columns:
            mesh = block((*c.section, c.length), c.cells, c.mesh, c.seed)
            held = on_face(mesh, 2, -1) & (c is self.columns[0])
            held |= on_face(mesh, 2, 1) & (self.clamped and c is self.columns[-1])
            material = law(c.young, 0.0, c.density, c.damping)
            place = self.pose.out((0.0, 0.0, foot + 0.5 * c.length))
            scene.add_body(mesh, material, place, self.pose.q, fixed=held)
            foot += c.length + self.gap
        return scene

    def simulate(self, load: float | None = None) -> wc.Simulation:
        """A simulation in frames of about one step.

        It starts at rest under the weights and a pressure ``load`` [Pa] on top, neighbours touching
        or with a gap above zero; or in the rest shapes.
        """
        edge = min(min(c.section[0] / c.cells[0], c.length / c.cells[2]) for c in self.columns)
        rate = step_rate(edge, max(c.wave_speed for c in self.columns))
        sim = wc.Simulation(self.build(), fps=rate)
        if load is not None:
            x = np.concatenate(self.static(sim.scene, load))
            sim.state.x.assign(x.astype(np.float32))
        return sim

    def static(self, scene: wc.Scene, load: float = 0.0) -> list[np.ndarray]:
        """Positions [m] of each body under the weights and a pressure ``load`` [Pa] on top."""
        above = load + self.gravity * sum(c.density * c.length for c in self.columns)
        foot, positions = self.base, []
        for body, c in zip(scene.bodies, self.columns, strict=True):
            weight = self.gravity * c.density
            above -= weight * c.length
            x = self.pose.back(body.x)
            s = x[:, 2] - x[:, 2].min()
            x[:, 2] = foot + s - (above * s + weight * (c.length * s - 0.5 * s**2)) / c.young
            positions.append(self.pose.out(x))
            sunk = (above * c.length + 0.5 * weight * c.length**2) / c.young
            foot += c.length - sunk + max(self.gap, 0.0)
        return positions

    def face(self, sim: wc.Simulation, k: int, side: int) -> np.ndarray:
        """Heights z [m] of the vertices at the lower (-1) or upper (1) end of column ``k``."""
        body = sim.scene.bodies[k]
        return self.pose.back(sim.positions(body))[on_face(body.mesh, 2, side), 2]

    def pressures(self, sim: wc.Simulation, *bodies: Body) -> np.ndarray:
        """Axial stress of each tet of some columns [Pa], pressure counted positive."""
        at = [stress(body, self.pose.back(sim.positions(body))) for body in bodies]
        return -np.concatenate(at)[:, 2, 2]


def stress(body: Body, x: np.ndarray) -> np.ndarray:
    """P [Pa] of each tet at ``x`` [m], in the axes of the mesh; in doubles, shape (m, 3, 3)."""
    grad = gradients(body.mesh.vertices, body.mesh.tets)
    f = np.einsum("tci,tcj->tij", x[body.mesh.tets].astype(float), grad)
    u, _, vt = np.linalg.svd(f)
    return body.material.youngs_modulus * (f - u @ vt)


def between(sim: wc.Simulation) -> list[float]:
    """Forces [N] between neighbours, from below."""
    return forces(sim, *pairwise(body.label for body in sim.scene.bodies))
