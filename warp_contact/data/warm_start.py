"""The impulses of the last step, from which the next one starts: also across frames."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact


@dataclass
class Warm:
    """What a step needs to know of the one before, beside the state.

    Attributes:
        partner: body of each vertex' first contact in the last step, -1 for none, shape (n_vert,)
        kept: tangential and normal impulse of that contact [N s], shape (n_vert,)
        n_held: contacts of edges in the last step, shape (1,)
        held: these, with their impulses, sorted by edge and body, shape (capacity.contacts,)
    """

    partner: wp.array
    kept: wp.array
    n_held: wp.array
    held: wp.array


def allocate(n_vert: int, n_contact: int) -> Warm:
    """Room for so many vertices and contacts; there was no step yet."""
    return Warm(
        partner=wp.full(n_vert, -1, dtype=int),
        kept=wp.zeros(n_vert, dtype=wp.vec4),
        n_held=wp.zeros(1, dtype=int),
        held=wp.zeros(n_contact, dtype=EdgeContact),
    )


def copy(to: Warm, of: Warm) -> None:
    """Overwrite one with another; there is room for its contacts."""
    wp.copy(to.partner, of.partner)
    wp.copy(to.kept, of.kept)
    wp.copy(to.n_held, of.n_held)
    wp.copy(to.held, of.held, count=min(len(to.held), len(of.held)))


def values(warm: Warm) -> dict[str, np.ndarray]:
    """What a checkpoint needs of it."""
    n = int(warm.n_held.numpy()[0])
    arrays = {"partner": warm.partner, "kept": warm.kept, "n_held": warm.n_held}
    held = warm.held.numpy()[:n]
    return {k: array.numpy() for k, array in arrays.items()} | {"held": held}


def restore(warm: Warm, stored: dict[str, np.ndarray]) -> None:
    """Take over the ``values`` of another one; there is room for them."""
    warm.partner.assign(stored["partner"])
    warm.kept.assign(stored["kept"])
    warm.n_held.assign(stored["n_held"])
    if len(stored["held"]):
        wp.copy(warm.held, wp.array(stored["held"], dtype=EdgeContact), count=len(stored["held"]))
