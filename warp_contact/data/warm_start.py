"""Warm start: the impulses of the last step, from which the next one starts, also across frames.

One cache, keyed by a vertex or an edge and the body that it touches. A vertex has the impulse of
its first contact. An edge has all its contacts, which are persistent.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact


@dataclass
class WarmStart:
    """What a step needs of the one before, beside the state.

    Attributes:
        partner: body of each vertex' first contact in the last step, -1 for none, shape (n_vert,)
        kept: its tangential and normal impulse [N s], over h [N] in implicit steps, shape (n_vert,)
        n_edge: contacts of edges in the last step, shape (1,)
        edges: these, with their impulses, sorted by edge and body, shape (capacity.contacts,)
        lacking: what the answer of implicit bodies to the contacts of the last step lacked [N],
            shape (n_vert,), or (0,) without such bodies
    """

    partner: wp.array[int]
    kept: wp.array[wp.vec4]
    n_edge: wp.array[int]
    edges: wp.array[EdgeContact]
    lacking: wp.array[wp.vec3]


def allocate(n_vert: int, n_contact: int, implicit: bool) -> WarmStart:
    """Allocate before any step."""
    return WarmStart(
        partner=wp.full(n_vert, -1, dtype=int),
        kept=wp.zeros(n_vert, dtype=wp.vec4),
        n_edge=wp.zeros(1, dtype=int),
        edges=wp.zeros(n_contact, dtype=EdgeContact),
        lacking=wp.zeros(n_vert if implicit else 0, dtype=wp.vec3),
    )


def forget(warm: WarmStart, lacking: bool = True) -> None:
    """The next step has no impulses to start from; nor does it know what was ``lacking``."""
    warm.partner.fill_(-1)
    warm.n_edge.zero_()
    if lacking:
        warm.lacking.zero_()


def forget_at(warm: WarmStart, verts: np.ndarray, edges: np.ndarray) -> None:
    """The same for some vertices and edges, masks."""
    arrays = [warm.lacking] if len(warm.lacking) else []
    for array, nothing in (warm.partner, -1), *((a, 0.0) for a in arrays):
        kept = array.numpy().copy()
        kept[verts] = nothing
        array.assign(kept)
    found = warm.edges.numpy()[: int(warm.n_edge.numpy()[0])]
    left = found[~edges[found["edge"]]]
    warm.n_edge.fill_(len(left))
    if len(left):
        wp.copy(warm.edges, wp.array(left, dtype=EdgeContact), count=len(left))


def copied(warm: WarmStart) -> WarmStart:
    """The same in arrays of its own."""
    return WarmStart(*(wp.clone(array) for array in vars(warm).values()))


def copy(to: WarmStart, of: WarmStart) -> None:
    """Overwrite one with another, whose contacts fit."""
    wp.copy(to.partner, of.partner)
    wp.copy(to.kept, of.kept)
    wp.copy(to.n_edge, of.n_edge)
    wp.copy(to.edges, of.edges, count=min(len(to.edges), len(of.edges)))
    wp.copy(to.lacking, of.lacking)


def recall(
    to: WarmStart, of: WarmStart, verts: np.ndarray, edges: np.ndarray, needed: wp.array
) -> None:
    """Put the impulses of vertices and edges, masks, back from another one; all of others stay.

    Where the contacts of edges do not fit, ``needed`` says how many there are.
    """
    both = (to.partner, of.partner), (to.kept, of.kept), (to.lacking, of.lacking)
    for array, kept in both if len(to.lacking) else both[:2]:
        mine, theirs = array.numpy().copy(), kept.numpy()
        mine[verts] = theirs[verts]
        array.assign(mine)
    mine, theirs = (w.edges.numpy()[: int(w.n_edge.numpy()[0])] for w in (to, of))
    theirs = theirs[edges[theirs["edge"]]]
    both = np.empty(len(mine) + len(theirs), dtype=mine.dtype)
    both[: len(mine)], both[len(mine) :] = mine, theirs
    both = both[np.lexsort((both["body"], both["edge"]))]
    if len(both) > len(to.edges):
        needed.fill_(len(both))
        return
    to.n_edge.fill_(len(both))
    if len(both):
        wp.copy(to.edges, wp.array(both, dtype=EdgeContact), count=len(both))


def values(warm: WarmStart) -> dict[str, np.ndarray]:
    """What a checkpoint needs of it."""
    n = int(warm.n_edge.numpy()[0])
    arrays = {"partner": warm.partner, "kept": warm.kept, "n_edge": warm.n_edge}
    arrays["lacking"] = warm.lacking
    edges = warm.edges.numpy()[:n]
    return {k: array.numpy() for k, array in arrays.items()} | {"edges": edges}


def restore(warm: WarmStart, stored: dict[str, np.ndarray]) -> None:
    """Take over the ``values`` of another one; they fit."""
    warm.partner.assign(stored["partner"])
    warm.kept.assign(stored["kept"])
    warm.n_edge.assign(stored["n_edge"])
    warm.lacking.assign(stored["lacking"])
    edges = stored["edges"]
    if len(edges):
        wp.copy(warm.edges, wp.array(edges, dtype=EdgeContact), count=len(edges))
