"""What the cases share: what is asked of them, meshes, orientations, responses, samples of a run.

A method that is right only for one mesh, or only along the axes, is not right: cases run on meshes
that are structured, mirrored and jittered, and along the axes and turned.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

G = 9.81  # [m/s^2]
MESHES = "structured", "mirrored", "jittered"
JITTER = 0.15  # of a cell: largest shift of a vertex; no tet comes near to inverting
ANGLES = 17.0, 31.0, 53.0  # of what is turned, about x, then y, then z [degrees]
RESPONSES = {  # by the constants of a penalty of the case [N/m], [N s/m]
    "default": lambda *penalty: wc.ContactSurface(),
    "literal": lambda *penalty: wc.ContactSurface("literal"),
    "penalty": wc.Penalty,
    "predicted": lambda *penalty: wc.PredictedForce(),
}


class Ask(NamedTuple):
    """What is asked of a case."""

    quick: bool = True  # fewer variants
    response: str = "default"  # one of ``RESPONSES``
    seed: int = 0  # of jittered meshes

    def respond(self, stiffness: float, damping: float = 0.0):
        """The response; a penalty takes the constants of the case [N/m], [N s/m]."""
        return RESPONSES[self.response](stiffness, damping)


class Pose:
    """A rotation of a whole setting: local vectors, shape (..., 3), to the scene and back."""

    def __init__(self, turned: bool = False):
        """Along the axes, or turned about all three."""
        self.name = "turned" if turned else "aligned"
        self.q = quaternion(ANGLES if turned else (0.0, 0.0, 0.0))
        self._r = rotation_matrix(self.q)

    def out(self, local) -> np.ndarray:
        """Local vectors in the scene."""
        return np.asarray(local, dtype=float) @ self._r.T

    def back(self, world) -> np.ndarray:
        """Vectors of the scene in local coordinates."""
        return np.asarray(world, dtype=float) @ self._r


def quaternion(angles) -> np.ndarray:
    """Rotations about x, then y, then z [degrees] as a quaternion (x, y, z, w)."""
    (a, b, c), (d, e, f) = (g(np.radians(angles) / 2.0) for g in (np.cos, np.sin))
    x, y = d * b * c - a * e * f, a * e * c + d * b * f
    return np.array([x, y, a * b * f - d * e * c, a * b * c + d * e * f])


ALIGNED = Pose()


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


def mean_edge(mesh: wc.TetMesh) -> float:
    """Mean length of an edge at rest [m]."""
    p, q = mesh.edges.T
    return float(np.linalg.norm(mesh.vertices[p] - mesh.vertices[q], axis=1).mean())


def gradients(x: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Of the linear shape functions of the corners of each tet [1/m], shape (n_tet, 4, 3)."""
    g = np.linalg.inv(x[tets[:, 1:]] - x[tets[:, :1]]).swapaxes(1, 2)
    return np.concatenate([-g.sum(axis=1, keepdims=True), g], axis=1)


def watch(sim: wc.Simulation, seconds: float, of: Callable = lambda: None) -> np.ndarray:
    """Step for some time [s]; what ``of()`` is after each frame, shape (frames, ...)."""
    return np.array([of() for _ in sim.frames(round(seconds * sim.fps))])


def forces(sim: wc.Simulation, *pairs: tuple[str, str]) -> list[float]:
    """Contact forces [N] between pairs of labels."""
    found = sim.measure().forces
    return [found.get(pair, 0.0) for pair in pairs]


def masses(sim: wc.Simulation, body: int | None = None) -> np.ndarray:
    """Of the vertices of one body or of all [kg], in double precision."""
    mass = sim.model.mass.numpy().astype(float)
    return mass if body is None else mass[sim.model.vert_body.numpy() == body]


def facing(x: np.ndarray, tris: np.ndarray, up: float, least: float = 0.9) -> np.ndarray:
    """The triangles whose normals are along z, up (1) or down (-1), shape (k, 3)."""
    a, b, c = np.moveaxis(x[tris], 1, 0)
    n = np.cross(b - a, c - a)
    return tris[up * n[:, 2] > least * np.linalg.norm(n, axis=1)]


def height(points: np.ndarray, x: np.ndarray, tris: np.ndarray, slack=1e-3) -> np.ndarray:
    """Height [m] of a surface at the (x, y) of each point; nan beside it. Shape (n,)."""
    a, b, c = (x[tris[:, k]].astype(float) for k in range(3))
    u, v = (b - a)[:, :2], (c - a)[:, :2]
    d = points[:, None, :2].astype(float) - a[:, :2]  # (n, k, 2)
    whole = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    s = (d[..., 0] * v[:, 1] - d[..., 1] * v[:, 0]) / whole
    t = (u[:, 0] * d[..., 1] - u[:, 1] * d[..., 0]) / whole
    least = np.minimum(np.minimum(s, t), 1.0 - s - t)
    best = least.argmax(axis=1)
    row = np.arange(len(points))
    s, t = s[row, best], t[row, best]
    z = a[best, 2] + s * (b - a)[best, 2] + t * (c - a)[best, 2]
    return np.where(least[row, best] >= -slack, z, np.nan)
