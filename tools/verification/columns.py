"""Columns on each other along a local z axis: their scene, their exact state, their stresses.

    u(s) = -(p s + rho G (L s - s^2 / 2)) / E

under a pressure p on top, s from the foot of a column of length L. The Poisson ratio is 0: a fixed
corotated column is then exactly linear in its axial stretch, P = E (F - R) with F = R S
(Stomakhin et al. 2012).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import warp_contact as wc
from verification.relax import step_rate
from verification.setup import ALIGNED, Ask, Pose, block, on_face
from warp_contact.scene.scene import Body


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        young: [Pa]
        length: [m]
        density: [kg/m^3]
        cells: shape (3,)
        section: [m], shape (2,)
        mesh: one of ``setup.MESHES``
        seed: of the jittered mesh
        damping: of the material [s]
    """

    young: float
    length: float
    density: float
    cells: tuple[int, int, int]
    section: tuple[float, float] = (1.0, 1.0)
    mesh: str = "structured"
    seed: int = 0
    damping: float = 0.0

    @property
    def rest(self) -> wc.TetMesh:
        """Its mesh, about the origin."""
        return block((*self.section, self.length), self.cells, self.mesh, self.seed)

    @property
    def material(self) -> wc.Corotated:
        """Linear in the axial stretch."""
        return wc.Corotated(self.young, 0.0, self.density, self.damping)

    @property
    def wave_speed(self) -> float:
        """Of the bar [m/s]."""
        return float(np.sqrt(self.young / self.density))

    @property
    def slowest(self) -> float:
        """Frequency of its slowest mode, held at one end [1/s]."""
        return 0.5 * np.pi * self.wave_speed / self.length


@dataclass(frozen=True)
class Pile:
    """Columns from below, the foot of the first held.

    Attributes:
        columns: as named
        gap: between the rest shapes [m], negative for an overlap
        base: height of the foot [m]
        clamped: whether the top of the last is held too
        pose: of the whole
        gravity: along -z [m/s^2]
        friction: Coulomb's coefficient
    """

    columns: Sequence[Column]
    gap: float
    base: float = 0.0
    clamped: bool = False
    pose: Pose = ALIGNED
    gravity: float = 0.0
    friction: float = 0.0

    def build(self) -> wc.Scene:
        """The rest shapes."""
        scene = wc.Scene(self.pose.out((0.0, 0.0, -self.gravity)), self.friction)
        foot, last = self.base, len(self.columns) - 1
        for k, c in enumerate(self.columns):
            rest, place = c.rest, self.pose.out((0.0, 0.0, foot + 0.5 * c.length))
            held = on_face(rest, 2, -1) & (k == 0)
            held |= on_face(rest, 2, 1) & (self.clamped and k == last)
            scene.add_body(rest, c.material, place, self.pose.q, fixed=held)
            foot += c.length + self.gap
        return scene

    def simulate(self, ask: Ask) -> wc.Simulation:
        """A simulation in frames of about one step; a penalty has 100 E A / L in all."""
        first, height = self.columns[0], sum(c.length for c in self.columns)
        contacts = sum((c.cells[0] + 1) * (c.cells[1] + 1) for c in self.columns[:2])
        stiffness = 100.0 * first.young * first.section[0] * first.section[1] / height / contacts
        edge = min(min(c.section[0] / c.cells[0], c.length / c.cells[2]) for c in self.columns)
        rate = step_rate(edge, max(c.wave_speed for c in self.columns))
        return wc.Simulation(self.build(), ask.respond(stiffness), fps=rate)

    def static(self, scene: wc.Scene, load: float = 0.0) -> list[np.ndarray]:
        """Positions [m] of each body under the weights and a pressure ``load`` [Pa] on top.

        Neighbours touch, or keep a gap above zero.
        """
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

    def start(self, sim: wc.Simulation, load: float = 0.0) -> wc.Simulation:
        """Put a simulation into that state."""
        sim.state.x.assign(np.concatenate(self.static(sim.scene, load)).astype(np.float32))
        return sim

    def faces(self, sim: wc.Simulation) -> tuple[np.ndarray, np.ndarray]:
        """Heights z [m] of the vertices of the upper face of the first column and the one above."""
        first, second = sim.scene.bodies[:2]
        top = self.pose.back(sim.positions(first))[on_face(first.mesh, 2, 1), 2]
        return top, self.pose.back(sim.positions(second))[on_face(second.mesh, 2, -1), 2]

    def pressures(self, sim: wc.Simulation, *bodies: Body) -> np.ndarray:
        """Axial stress of each tet of some columns [Pa], pressure counted positive."""
        at = [stress(body, self.pose.back(sim.positions(body))) for body in bodies]
        return -np.concatenate(at)[:, 2, 2]


def stress(body: Body, x: np.ndarray) -> np.ndarray:
    """P [Pa] of each tet at ``x`` [m], in the axes of the mesh; in doubles, shape (m, 3, 3)."""
    tets = body.mesh.tets
    f = _edges(x[tets]) @ np.linalg.inv(_edges(body.mesh.vertices[tets]))
    u, _, vt = np.linalg.svd(f)
    return body.material.youngs_modulus * (f - u @ vt)


def _edges(corners: np.ndarray) -> np.ndarray:
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2).astype(float)
