"""What contact does to each vertex, for pictures and files."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.work import Work


def contact_fields(model: Model, x: wp.array, work: Work, duration: float) -> dict[str, np.ndarray]:
    """Fields of the last frame, of ``duration`` [s], at positions ``x``: see ``Simulation``."""
    c = work.contacts.record.numpy()[: int(work.contacts.n.numpy()[0])]
    vert, coef, pair, depth = c["vert"], c["coef"], c["pair"], c["depth"]
    penetration = np.zeros(model.n_vert, dtype=np.float32)
    partner = np.full(model.n_vert, -1, dtype=np.int32)
    for k in range(5):
        on = coef[:, k] != 0.0
        np.maximum.at(penetration, vert[on, k], depth[on])
        partner[vert[on, k]] = pair[on, 1 if k < 2 else 0]
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
    tris, at = model.tris.numpy(), x.numpy().astype(np.float64)
    a, b, c = np.moveaxis(at[tris], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    return np.bincount(tris.ravel(), np.repeat(area, 3), minlength=model.n_vert)
