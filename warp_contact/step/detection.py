"""A complete detection pass at given positions, without persistent contacts."""

import warp as wp

from warp_contact.data.launch import if_any
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.step import impulse, narrow_phase


def detect(model: Model, x0: wp.array, x: wp.array, work: Work, near_plane: float = 0.0) -> None:
    """Contacts of vertices and edges at ``x``, in a step from ``x0``, and their constants.

    ``near_plane`` as in ``find_vertices``.
    """
    narrow_phase.find_vertices(model, x0, x, work, near_plane)
    narrow_phase.clear_places(work)
    narrow_phase.find_edges(model, x0, x, work)
    if_any(work.narrow_phase.n_crossing, narrow_phase.append_edge_contacts, model, x0, work)
    if_any(work.contacts.n, impulse.begin, model, x0, work)


def detect_vertices(model: Model, x0: wp.array, x: wp.array, work: Work) -> None:
    """Contacts of vertices alone, as in the paper."""
    narrow_phase.find_vertices(model, x0, x, work)
    if_any(work.contacts.n, impulse.begin, model, x0, work)
