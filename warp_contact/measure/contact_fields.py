"""What contact does to each vertex, for pictures and files."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.work import Work


def contact_fields(model: Model, x: wp.array, work: Work, duration: float) -> dict[str, np.ndarray]:
    """Fields of the last frame, of ``duration`` [s], at positions ``x``: see ``Simulation``."""
    c = work.contacts.of_step()[0]
    penetration = np.zeros(model.n_vert, dtype=np.float32)
    partner = np.full(model.n_vert, -1, dtype=np.int32)
    k, of = np.nonzero(c["coef"].T)
    vert = c["vert"][of, k]
    np.maximum.at(penetration, vert, c["depth"][of])
    partner[vert] = c["pair"][of, np.where(k < 2, 1, 0)]
    received = work.forces.received.numpy()
    impulse = np.linalg.norm(received, axis=1)
    pressure = impulse / (duration * np.maximum(vertex_area(model, x), 1e-30))
    return {
        "force": (received / duration).astype(np.float32),
        "pressure": pressure.astype(np.float32),
        "penetration": penetration,
        "partner": partner,
    }


@np.errstate(invalid="ignore")
def vertex_area(model: Model, x: wp.array) -> np.ndarray:
    """A third of the surface around each vertex [m^2], shape (n_vert,)."""
    tris = model.tris.numpy()
    a, b, c = np.take(x.numpy().T.astype(np.float64, order="C"), tris.T, axis=1).swapaxes(0, 1)
    u, v = b - a, c - a  # and their product, for which np.cross takes twice as long
    n = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 6.0
    return np.bincount(tris.ravel(), np.repeat(area, 3), minlength=model.n_vert)
