"""Larger capacities for a frame whose buffers were too small."""

from dataclasses import astuple

import numpy as np

from warp_contact.data.overflow import Capacity
from warp_contact.data.work import Work


def enlarged(work: Work) -> Capacity | None:
    """Twice what the frame would have needed, or None where all fitted.

    Buffers more than half full grow too: lists grow together, and each time that one does not fit a
    frame is lost.
    """
    needed = work.overflow.all.numpy()
    if not needed.any():
        return None
    have = np.array(astuple(work.capacity))
    used = np.maximum(needed, np.minimum(_used(work), have))
    return Capacity(*np.where(2 * used > have, 2 * used, have).tolist())


def _used(work: Work) -> np.ndarray:
    """What the last step used, or the last that used any, in the order of ``Capacity``."""
    verts, edges = work.broad_phase.verts, work.broad_phase.edges
    counts = [work.contacts.n, verts.n, verts.item_start[-1:], edges.n, edges.item_start[-1:]]
    contacts, n_vert, n_tet, n_edge, n_tri = (int(n.numpy()[0]) for n in counts)
    pairs = int((work.forces.pair_key.numpy() >= 0).sum())
    near = int(work.broad_phase.near.part.numpy()["tris"].max(initial=0))
    return np.array([contacts, pairs, n_vert, n_tet, n_edge, n_tri, near])
