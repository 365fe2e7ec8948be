"""What the damping of a step needs, and how contacts changed the velocities in the last steps."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.data.model import Model

MOST = 256  # stages of a step: more would take longer than any frame is worth


@dataclass
class Damping:
    """Only of scenes with a damped body.

    Attributes:
        row: number of the world of each vertex, shape (n_vert,)
        coef: coefficients of the polynomial of each world [-], shape (n_world, MOST)
        reach: largest step times eigenvalue that it is good for [-], shape (n_world,)
        last: change of the velocities by contacts in the last step [m/s], shape (n_vert,)
        before: the same in the step before it [m/s], shape (n_vert,)
        free: velocities in this step before the contacts [m/s], shape (n_vert,)
        even, odd: terms of the polynomial [m/s], shape (n_vert,)
        undamped: 1 in worlds without a damped body, shape (n_vert,); None where there are none
        kicked: velocities there after the forces [m/s], shape (n_vert,); None likewise
    """

    row: wp.array[int]
    coef: wp.array2d[float]
    reach: wp.array[float]
    last: wp.array[wp.vec3]
    before: wp.array[wp.vec3]
    free: wp.array[wp.vec3]
    even: wp.array[wp.vec3]
    odd: wp.array[wp.vec3]
    undamped: wp.array[int] | None = None
    kicked: wp.array[wp.vec3] | None = None


def allocate(model: Model) -> Damping | None:
    """Allocate before any step, for one world; None where no body is damped."""
    if not any(e.damped for e in model.elements):
        return None
    vectors = [wp.zeros(model.n_vert, dtype=wp.vec3) for _ in range(5)]
    row = wp.zeros(model.n_vert, dtype=int)
    return Damping(row, wp.zeros((1, MOST), dtype=float), wp.ones(1, dtype=float), *vectors)


def divide(d: Damping | None, model: Model, of_vert: np.ndarray, n_world: int) -> None:
    """Let each world have a polynomial of its own; ``of_vert`` are their numbers, (n_vert,).

    Only bodies with tets in ``model`` are damped by it.
    """
    if d:
        d.row.assign(of_vert.astype(np.int32))
        d.coef, d.reach = wp.zeros((n_world, MOST), dtype=float), wp.ones(n_world, dtype=float)
        own = [model.tet_body.numpy()[e.tet.numpy()] for e in model.elements]
        of_body = np.array([material.damping > 0.0 for material in model.materials])
        of_body &= np.isin(np.arange(model.n_body), np.concatenate(own))
        damped = np.bincount(of_vert, of_body[model.vert_body.numpy()], n_world) > 0.0
        if not damped.all():
            d.undamped = wp.array(~damped[of_vert], dtype=int)
            d.kicked = wp.zeros(model.n_vert, dtype=wp.vec3)


def copied(d: Damping | None) -> tuple[wp.array, ...]:
    """What a step needs of the ones before, in arrays of its own."""
    return (wp.clone(d.last), wp.clone(d.before)) if d else ()


def copy(to: Damping | None, of: tuple[wp.array, ...]) -> None:
    """Put back what was ``copied``."""
    if to:
        wp.copy(to.last, of[0])
        wp.copy(to.before, of[1])


def keep(of: tuple[wp.array, ...], d: Damping | None) -> None:
    """Overwrite what was ``copied`` with what is now."""
    if d:
        wp.copy(of[0], d.last)
        wp.copy(of[1], d.before)


def forget(d: Damping | None) -> None:
    """Nothing has touched."""
    if d:
        d.last.zero_()
        d.before.zero_()


def recall(d: Damping | None, of: tuple[wp.array, ...], verts: np.ndarray) -> None:
    """Put what was ``copied`` back at some vertices, a mask."""
    if d:
        for array, kept in zip((d.last, d.before), of, strict=True):
            mine = array.numpy().copy()
            mine[verts] = kept.numpy()[verts]
            array.assign(mine)


def forget_at(d: Damping | None, verts: np.ndarray) -> None:
    """Nothing has touched some vertices, a mask."""
    if d:
        for array in (d.last, d.before):
            kept = array.numpy().copy()
            kept[verts] = 0.0
            array.assign(kept)


def values(d: Damping | None) -> dict[str, np.ndarray]:
    """What a checkpoint needs of it."""
    return {"last": d.last.numpy(), "before": d.before.numpy()} if d else {}


def restore(d: Damping | None, stored: dict[str, np.ndarray]) -> None:
    """Take over the ``values`` of another one."""
    if d:
        d.last.assign(stored["last"])
        d.before.assign(stored["before"])
