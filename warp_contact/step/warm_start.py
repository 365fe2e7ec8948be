"""Warm start: the impulses start from those of the last step."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import warm_start as kernels


def recall_vertices(work: Work, share: float = 1.0) -> None:
    """Start the contacts of vertices from a share of the last step; set the parts of all."""
    c = work.contacts
    launch_over(
        kernels.recall_vertices,
        work.capacity.contacts,
        inputs=[share, _unit(work), c.n_vertex, c.n, c.record, c.constraint]
        + [work.warm.partner, work.warm.kept],
        outputs=[c.impulse, c.part],
    )


def recall_edges(work: Work, share: float = 1.0, again: bool = False) -> None:
    """Start the contacts of edges from a share of the impulses that they have.

    Where they are listed ``again`` in a step, those of worlds without new ones just go on.
    """
    c, n = work.contacts, work.narrow_phase
    launch_over(
        kernels.recall_edges,
        work.capacity.contacts,
        inputs=[share, _unit(work), again, work.worlds, c.n_vertex, c.n, c.record, c.constraint]
        + [n.source, n.found],
        outputs=[c.impulse],
    )


def keep_vertices(work: Work) -> None:
    """Keep the impulses of the vertices for the next step."""
    c = work.contacts
    work.warm.partner.fill_(-1)
    launch_over(
        kernels.keep_vertices,
        work.capacity.contacts,
        inputs=[_unit(work), c.n_vertex, c.record, c.impulse],
        outputs=[work.warm.partner, work.warm.kept],
    )


def keep_edges(work: Work, look: int) -> None:
    """Keep the contacts of edges for the next step; impulses changed where the ``look`` says so."""
    c, n = work.contacts, work.narrow_phase
    launch_over(
        kernels.keep_edges,
        work.capacity.contacts,
        inputs=[_unit(work), look, work.worlds, c.n_vertex, c.n, c.record, n.source, c.impulse],
        outputs=[n.found, work.warm.edges, work.warm.n_edge],
    )


def forget_edges(work: Work) -> None:
    """The next step has no persistent contacts of edges."""
    work.warm.n_edge.zero_()


def _unit(work: Work) -> wp.array:
    """Steps over which impulses are kept as forces; empty where they are kept as they are."""
    return work.dt if work.implicit else work.sweeps.no_dt
