"""Shapes of bodies that take implicit steps, and the inverses of A0 that they share.

A0 = M + h C0 + h^2 K0 belongs to a shape at rest, a material, what is fixed and a length of the
step. Copies of a mesh share it.
"""

from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.frame import elements
from warp_contact.kernels.implicit.bodies import FOUR, FREE, HELD, LUMPED, RIGID
from warp_contact.step.forces import apply_damping, apply_stiffness

KEPT = 8  # lengths of steps of which the inverses are kept
LARGEST = 800  # vertices of a body with an inverse: it takes 26 MB and seconds to find


def mobile(model: Model) -> np.ndarray:
    """Bodies of which not all vertices are fixed, a mask, shape (n_body,)."""
    return np.maximum.reduceat(model.inv_mass.numpy(), model.body_vert.numpy()[:-1]) > 0.0


def too_large(model: Model) -> np.ndarray:
    """Bodies that move and deform and have no inverse, a mask, shape (n_body,)."""
    deforms = np.array([material.kernels is not None for material in model.materials])
    return mobile(model) & deforms & (np.diff(model.body_vert.numpy()) > LARGEST)


def find_shapes(model: Model, x: np.ndarray) -> Shapes:
    """Which bodies take implicit steps, which are equal.

    ``x`` are positions (n_vert, 3) at which all bodies have their shape at rest.
    """
    kind = np.full(model.n_body, int(LUMPED))
    of_body = np.full(model.n_body, -1)
    moving, lumped = mobile(model), too_large(model)
    placed = np.tile(np.eye(3), (model.n_body, 1, 1))
    like: dict[tuple, int] = {}
    firsts: list[int] = []
    start = model.body_vert.numpy()
    fixed = model.inv_mass.numpy() == 0.0
    for b in np.flatnonzero(moving & ~lumped):
        own = slice(start[b], start[b + 1])
        if model.solids[b]:
            kind[b] = int(RIGID)
            continue
        kind[b] = int(HELD) if fixed[own].any() else int(FREE)
        placed[b] = _rotation(model.rest[own], x[own])
        of_body[b] = like.setdefault(_key(model, b), len(firsts))
        if of_body[b] == len(firsts):
            firsts.append(b)
    sizes = [start[b + 1] - start[b] for b in firsts]
    blocks = [-(-n // FOUR) * n for n in sizes]
    first = np.concatenate([[0], np.cumsum(blocks)]).astype(int)
    rest, inertia = np.zeros((model.n_vert, 3)), np.zeros((model.n_body, 3, 3))
    mass = model.mass.numpy().astype(float)
    for b in np.flatnonzero(moving):
        own, solid = slice(start[b], start[b + 1]), model.solids[b]
        if solid:
            rest[own], inertia[b] = model.rest[own] - solid.centre, solid.inertia
            continue
        r = model.rest[own] - np.average(model.rest[own], axis=0, weights=mass[own])
        rest[own] = r
        inertia[b] = _inertia(mass[own], r)
    force, torque = (wp.zeros(model.n_body, dtype=wp.vec3) for _ in range(2))
    parts = lumped, *_parts(model, lumped)
    return Shapes(kind, of_body, placed, first, rest, inertia, force, torque, *parts)


def largest_mobilities(model: Model) -> np.ndarray:
    """How all vertices of a body together answer impulses on each, at most [1/kg], (n_vert,).

    The inverse masses, but for rigid bodies whose mass lies further inside than their vertices.
    """
    found, mass = model.inv_mass.numpy().astype(float), model.mass.numpy().astype(float)
    start = model.body_vert.numpy()
    for b, solid in enumerate(model.solids):
        if solid:
            own, of_body = slice(start[b], start[b + 1]), np.zeros((6, 6))
            u = _rigid_motions(model.rest[own] - solid.centre)
            of_body[:3, :3], of_body[3:, 3:] = solid.mass * np.eye(3), solid.inertia
            of_vertices = u.T @ (np.repeat(mass[own], 3)[:, None] * u)
            found[own] *= np.linalg.eigvals(np.linalg.solve(of_body, of_vertices)).real.max()
    return found


class Inverses:
    """The inverses of A0 of all shapes, for a few lengths of the step."""

    def __init__(self, model: Model, shapes: Shapes):
        """Assemble stiffness and damping at rest."""
        firsts = [int((shapes.of_body == k).argmax()) for k in range(len(shapes.first) - 1)]
        ends = model.body_tet.numpy()
        own = [np.arange(ends[b], ends[b + 1]) for b in firsts]
        stiff, damped = _element_matrices(model, np.concatenate([*own, []]).astype(int))
        start, last = model.body_vert.numpy(), 0
        mass, inv_mass = model.mass.numpy().astype(float), model.inv_mass.numpy()
        self._shapes = []
        for b, tet in zip(firsts, own, strict=True):
            first, last = last, last + len(tet)
            free = np.repeat(inv_mass[start[b] : start[b + 1]] > 0.0, 3)
            m = np.repeat(mass[start[b] : start[b + 1]], 3)
            r = shapes.rest[start[b] : start[b + 1]]
            given = (matrix[first:last] for matrix in (damped, stiff))
            matrices = (_assemble(model, b, of_tets) for of_tets in given)
            rigid = _rigid_part(m[::3], r) if free.all() else None
            self._shapes.append((m, *matrices, free, rigid))
        self._kept: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def blocks(self, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Blocks (n, 3, 12) [1/kg] for steps ``h`` [s], shape after shape, and norms (n, 4)."""
        if h not in self._kept:
            none = np.zeros((0, 3, 12)), np.zeros((0, 4))  # all bodies are rigid
            found = [none, *(_inverse(h, *shape) for shape in self._shapes)]
            blocks, norms = (np.concatenate(part) for part in zip(*found, strict=True))
            while len(self._kept) >= KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[h] = blocks.astype(np.float32), norms.astype(np.float32)
        return self._kept[h]


def _parts(model: Model, lumped: np.ndarray) -> tuple[Model, Model]:
    """The model with the tets of bodies that are ``lumped`` alone, and with those of the others.

    In the first one only their vertices move.
    """
    of_tet, number = lumped[model.tet_body.numpy()[: model.n_tet]], np.arange(model.n_tet)
    inv_mass = np.where(lumped[model.vert_body.numpy()], model.inv_mass.numpy(), np.float32(0.0))
    own = elements.some(model, of_tet, number)
    explicit = replace(model, elements=own, inv_mass=wp.array(inv_mass, dtype=float))
    if not own:
        return explicit, model
    return explicit, replace(model, elements=elements.some(model, ~of_tet, number))


def _key(model: Model, b: int) -> tuple:
    """What equal bodies have in common, beside their form."""
    v0, v1 = model.body_vert.numpy()[b : b + 2]
    t0, t1 = model.body_tet.numpy()[b : b + 2]
    fixed = model.inv_mass.numpy()[v0:v1] == 0.0
    tets = model.tets.numpy()[t0:t1] - v0
    return model.materials[b], fixed.tobytes(), tets.tobytes(), model.rest[v0:v1].tobytes()


def _rotation(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation that takes points a into b, shape (n, 3)."""
    u, _, vt = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def _element_matrices(model: Model, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping of the tets ``of``, ids (n,), at rest, shape (n, 12, 12).

    They are where the mesh has them: copies have the same bits, wherever they stand.
    """
    corners = model.rest[model.tets.numpy()[of]]
    pose = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    of_tets = replace(elements.apart(model, of), pose=wp.array(pose, dtype=wp.mat33))
    both = apply_stiffness, apply_damping
    return tuple(elements.matrices(of_tets, apply, corners) for apply in both)


def _assemble(model: Model, b: int, matrices: np.ndarray) -> np.ndarray:
    """The matrix of body ``b`` from those of its tets, shape (3 n, 3 n), symmetric."""
    v0, v1 = model.body_vert.numpy()[b : b + 2]
    t0, t1 = model.body_tet.numpy()[b : b + 2]
    tets = model.tets.numpy()[t0:t1] - v0
    rows = (3 * tets[:, :, None] + np.arange(3)).reshape(len(tets), 12)
    out = np.zeros((3 * (v1 - v0), 3 * (v1 - v0)))
    np.add.at(out, (rows[:, :, None], rows[:, None, :]), matrices)
    return 0.5 * (out + out.T)


def _inverse(
    h: float,
    m: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    free: np.ndarray,
    rigid: tuple[np.ndarray, np.ndarray] | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Blocks of the inverse less its ``rigid`` part, and norms of the whole, in rows of four.

    Both are 0 for fixed vertices.
    """
    a = np.diag(m) + h * damping + h * h * stiffness
    out = np.zeros_like(a)
    chosen = np.ix_(free, free)
    out[chosen] = np.linalg.inv(a[chosen])
    norms = np.linalg.norm(_blocks(out), ord=2, axis=(2, 3))
    if rigid is not None:
        u, answer = rigid
        out -= answer @ u.T
        # What rounding leaves of it in a stiff body.
        mu = m[:, None] * u
        out -= answer @ (mu.T @ out)
        out -= (out @ mu) @ answer.T
    columns = _in_fours(_blocks(out).swapaxes(2, 3))  # (four, column, axis, 4, 3)
    return columns.reshape(-1, 3, 3 * FOUR), _in_fours(norms[:, :, None]).reshape(-1, FOUR)


def _blocks(a: np.ndarray) -> np.ndarray:
    """Shape (n, n, 3, 3)."""
    n = len(a) // 3
    return a.reshape(n, 3, n, 3).transpose(0, 2, 1, 3)


def _in_fours(a: np.ndarray) -> np.ndarray:
    """Rows of ``a``, shape (n, n, k, ...), four at once, zeros behind: (n / 4, n, k, 4, ...)."""
    rows = np.zeros((-(-len(a) // FOUR) * FOUR, *a.shape[1:]))
    rows[: len(a)] = a
    return np.moveaxis(rows.reshape(-1, FOUR, *a.shape[1:]), 1, 3)


def _inertia(mass: np.ndarray, r: np.ndarray) -> np.ndarray:
    return (mass * (r * r).sum(axis=1)).sum() * np.eye(3) - (mass[:, None] * r).T @ r


def _rigid_part(mass: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """U and U M_r^-1 of points ``r`` from their centre of mass, shape (3 n, 6)."""
    u = _rigid_motions(r)
    return u, u @ np.linalg.inv(u.T @ (np.repeat(mass, 3)[:, None] * u))


def _rigid_motions(r: np.ndarray) -> np.ndarray:
    """U of points ``r``, shape (3 n, 6)."""
    u = np.zeros((len(r), 3, 6))
    u[:, :, :3] = np.eye(3)
    for k in range(3):
        u[:, :, 3 + k] = np.cross(np.eye(3)[k], r)
    return u.reshape(-1, 6)
