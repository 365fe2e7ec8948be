"""Names of the vertex or tet at which a run failed."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame.implicit_shapes import mobile


def finite_vertices(state: State) -> np.ndarray:
    """Whether position and velocity of each vertex are finite, shape (n_vert,)."""
    return np.isfinite(state.x.numpy()).all(axis=1) & np.isfinite(state.v.numpy()).all(axis=1)


def vertex_name(model: Model, vertex: int) -> str:
    """Body of a vertex, and its number there."""
    body = int(model.vert_body.numpy()[vertex])
    return f"body '{model.labels[body]}', vertex {vertex - int(model.body_vert.numpy()[body])}"


def flattest_tet(model: Model, x: wp.array) -> str:
    """Body of the tet with the least height, volume over largest face, and its number there.

    Of bodies that deform; of rigid ones, or those held as a whole, where there are no others.
    """
    at = x.numpy().astype(np.float64)
    a, b, c, d = np.moveaxis(at[model.tets.numpy()], 1, 0)
    faces = ((b, c, d), (a, c, d), (a, b, d), (a, b, c))
    area = [np.linalg.norm(np.cross(q - p, r - p), axis=1) for p, q, r in faces]
    volume = np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a))
    height = volume / np.maximum(np.max(area, axis=0), 1e-30)
    own = model.vert_body.numpy()[model.tets.numpy()[:, 0]]
    soft = np.array([material.kernels is not None for material in model.materials])
    deforms = (soft & mobile(model))[own]
    k = int(np.where(deforms | ~deforms.any(), height, np.inf).argmin())
    body = int(own[k])
    return f"body '{model.labels[body]}', tet {k - int(model.body_tet.numpy()[body])}"


def too_damped(model: Model, of_bodies: np.ndarray, dt: np.ndarray) -> str:
    """Why no step ``dt`` [s] can take such damping rates of bodies [1/s], shape (n_body,)."""
    body = int(of_bodies.argmax())
    fast = f"motion within body '{model.labels[body]}' decays at up to {of_bodies[body]:.3g} 1/s"
    remedy = "check its damping [s] and its tets"
    return f"{fast}, too fast for a step of {dt.max():.3g} s: {remedy}"
