"""What the cases share: what is asked of them, meshes, orientations, responses.

A method that is right only for one mesh, or only along the axes, is not right: cases run on meshes
that are structured, mirrored and jittered, and along the axes and turned.
"""

from dataclasses import dataclass

import numpy as np
from checks.collision import ANGLES, quaternion

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

G = 9.81  # [m/s^2]
MESHES = "structured", "mirrored", "jittered"
JITTER = 0.15  # of a cell: largest shift of a vertex; no tet comes near to inverting
RESPONSES = "default", "literal", "penalty", "predicted"


@dataclass(frozen=True)
class Ask:
    """What is asked of a case.

    Attributes:
        quick: fewer variants, coarser meshes
        response: one of ``RESPONSES``
        seed: of the jittered meshes
    """

    quick: bool = True
    response: str = "default"
    seed: int = 0

    def respond(self, stiffness: float, damping: float = 0.0):
        """The response; a penalty takes the constants of the case [N/m], [N s/m]."""
        if self.response == "penalty":
            return wc.Penalty(stiffness, damping)
        if self.response == "predicted":
            return wc.PredictedForce()
        return wc.ContactSurface("literal" if self.response == "literal" else "balanced")


class Pose:
    """A rotation of a whole setting: local coordinates to those of the scene and back."""

    def __init__(self, turned: bool = False):
        """Along the axes, or turned about all three."""
        self.turned = turned
        self.q = quaternion(ANGLES if turned else (0.0, 0.0, 0.0))
        self._r = rotation_matrix(self.q)

    def __str__(self):
        """Its name in the table."""
        return "turned" if self.turned else "aligned"

    def out(self, local) -> np.ndarray:
        """Local vectors, shape (..., 3), in the scene."""
        return np.asarray(local, dtype=float) @ self._r.T

    def back(self, world) -> np.ndarray:
        """Vectors of the scene, shape (..., 3), in local coordinates."""
        return np.asarray(world, dtype=float) @ self._r


def block(size, cells, mesh: str = "structured", seed: int = 0) -> wc.TetMesh:
    """A block about the origin; its faces stay plane when its vertices are jittered."""
    regular = wc.box(size, cells, mirrored=mesh == "mirrored")
    if mesh != "jittered":
        return regular
    x = regular.vertices
    half = x.max(axis=0)
    cell = 2.0 * half / np.broadcast_to(np.asarray(cells), 3)
    shift = np.random.default_rng(seed).uniform(-JITTER, JITTER, x.shape) * cell
    inside = np.abs(x) < half - 0.01 * cell
    return wc.TetMesh(x + np.where(inside, shift, 0.0), regular.tets)


def on_face(mesh: wc.TetMesh, axis: int, side: int) -> np.ndarray:
    """Mask of the vertices on the face of a block at its lower (-1) or upper (1) end."""
    x = side * mesh.vertices[:, axis]
    return x > x.max() - 1e-6 * np.ptp(x)
