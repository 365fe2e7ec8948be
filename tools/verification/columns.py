"""Two prismatic columns along a local z axis, held at their outer ends, in contact inside."""

from dataclasses import dataclass

import numpy as np

import warp_contact as wc
from verification.setup import Pose, block, on_face
from verification.stress import first_piola


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        young: [Pa]; the Poisson ratio is 0
        length: [m]
        section: [m], shape (2,)
        cells: shape (3,)
        density: [kg/m^3]
        damping: of the material [s]
        mesh: one of ``setup.MESHES``
        seed: of the jittered mesh
    """

    young: float
    length: float
    section: tuple[float, float]
    cells: tuple[int, int, int]
    density: float
    damping: float = 0.0
    mesh: str = "structured"
    seed: int = 0

    @property
    def rest(self) -> wc.TetMesh:
        """Its mesh, about the origin."""
        return block((*self.section, self.length), self.cells, self.mesh, self.seed)

    @property
    def material(self) -> wc.Corotated:
        """Fixed corotated with nu = 0: exactly linear in the axial stretch."""
        return wc.Corotated(self.young, 0.0, self.density, self.damping)

    @property
    def wave_speed(self) -> float:
        """Of the bar [m/s]."""
        return float(np.sqrt(self.young / self.density))


def build(lower: Column, upper: Column, overlap: float, pose: Pose, gravity=0.0) -> wc.Scene:
    """Base of the lower column at z = 0; the rest shapes overlap by ``overlap`` [m]."""
    scene = wc.Scene(gravity=pose.out((0.0, 0.0, -gravity)), friction=0.0)
    low = lower.rest
    scene.add_body(
        low,
        lower.material,
        pose.out((0.0, 0.0, 0.5 * lower.length)),
        pose.q,
        fixed=on_face(low, 2, -1),
        label="lower",
    )
    high = upper.rest
    scene.add_body(
        high,
        upper.material,
        pose.out((0.0, 0.0, lower.length - overlap + 0.5 * upper.length)),
        pose.q,
        fixed=on_face(high, 2, 1),
        label="upper",
    )
    return scene


def faces(sim: wc.Simulation, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Heights z [m] of the vertices of the upper face of the lower column and the one above."""
    lower, upper = sim.scene.bodies
    top = pose.back(sim.positions(lower))[on_face(lower.mesh, 2, 1), 2]
    bottom = pose.back(sim.positions(upper))[on_face(upper.mesh, 2, -1), 2]
    return top, bottom


def axial(sim: wc.Simulation, body, pose: Pose) -> np.ndarray:
    """Axial stress of each tet [Pa], pressure counted positive."""
    return -first_piola(body, pose.back(sim.positions(body)))[:, 2, 2]
