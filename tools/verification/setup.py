"""What the cases share: meshes, orientations, samples of a run, relaxation.

A method that is right only for one mesh, or only along the axes, is not right: cases run on meshes
that are structured, mirrored and jittered, and along the axes and turned.
"""

from collections.abc import Callable

import numpy as np
import warp as wp

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix
from warp_contact.step.forces import internal_forces

G = 9.81  # [m/s^2]
MESHES = "structured", "mirrored", "jittered"
JITTER = 0.15  # of a cell: largest shift of a vertex; no tet comes near to inverting
ANGLES = 17.0, 31.0, 53.0  # of what is turned, about x, then y, then z [degrees]
ZETA = 0.7  # of the slowest mode: the fastest decay without a long tail


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
    return wc.TetMesh(x + np.where(np.abs(x) < half - 0.01 * cell, shift, 0.0), regular.tets)


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


def step_rate(edge: float, speed: float) -> float:
    """Frames per second [1/s] of about one stable step, for the shortest edge of a cell [m].

    The tets of a cell have modes of some 3.5 speed / edge, with the speed of the waves [m/s].
    """
    return 3.0 * speed / edge


def rest(
    sim: wc.Simulation, omega: float, lasts: float, of: Callable, part=0.2, least=0, zeta=ZETA
) -> np.ndarray:
    """Let a scene come to rest; what ``of()`` is after each of the last frames, shape (n, ...).

    It ``lasts`` for so many 1 / ``omega`` [1/s], that of the slowest mode, ``least`` frames at
    least, of which a ``part`` are the last.

    After each frame of one or two steps velocities are multiplied by s = exp(-2 zeta omega / fps):
    viscous damping proportional to the mass (Underwood 1983), which leaves the equilibrium alone.
    Those of symplectic Euler lag by h/2, so what is scaled is v + h/2 f/m; scaling v itself would
    feed fast modes. A frame of more steps would see modes of a whole number of half periods always
    at rest and never damp them.
    """
    frames, found = max(least, int(np.ceil(lasts / omega * sim.fps))), []
    factor, mobile = np.exp(-2.0 * zeta * omega / sim.fps), sim.model.inv_mass.numpy() > 0.0
    for frame in sim.frames(frames):
        if frame > (1.0 - part) * frames:
            found.append(of())
        ahead = 0.5 * acceleration(sim) / (sim.fps * max(sim.substeps, 1))
        v = sim.state.v.numpy()
        calmed = np.where(mobile[:, None], factor * (v + ahead) - ahead, v)
        sim.state.v.assign(calmed.astype(np.float32))
    return np.array(found)


def acceleration(sim: wc.Simulation) -> np.ndarray:
    """By elasticity and gravity [m/s^2], none where contact balances them; shape (n_vert, 3)."""
    model = sim.model
    f_tet, on = wp.zeros(4 * model.n_tet, dtype=wp.vec3), wp.full(model.n_tet, 1, dtype=int)
    internal_forces(model, sim.state.x, on, f_tet)
    a = np.zeros((model.n_vert, 3))
    np.add.at(a, model.tets.numpy().ravel(), f_tet.numpy().reshape(-1, 3).astype(float))
    a = model.inv_mass.numpy()[:, None] * a + np.array(model.gravity)
    a[sim.contact_fields()["pressure"] > 0.0] = 0.0
    return a


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
