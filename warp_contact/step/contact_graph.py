"""Which contacts each vertex has, and how many contacts there are."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.scan import scan
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase import contact_graph as kernels
from warp_contact.step import coupled


def order_by_vertex(model: Model, work: Work) -> None:
    """Set ``contacts.graph``."""
    c = work.contacts
    graph, m = c.graph, work.capacity.contacts
    graph.start.zero_()
    outputs = [graph.n_touched, graph.start]
    launch_over(kernels.count_entries, m, inputs=[c.n, c.record], outputs=outputs)
    scan(graph.start, work.scan, inclusive=True)
    outputs = [graph.start, graph.entry]
    launch_over(kernels.fill_entries, m, inputs=[c.n, c.record], outputs=outputs)
    outputs = [graph.entry, graph.touched, graph.n_touched]
    launch_over(kernels.sort_entries, model.n_vert, inputs=[graph.start], outputs=outputs)


def count_contacts(work: Work, of_edges: wp.array, places: wp.array) -> None:
    """Set ``contacts.n``: those of vertices and ``of_edges`` of edges, which take ``places``."""
    wp.launch(
        kernels.total_contacts,
        dim=1,
        inputs=[work.contacts.n_vertex, of_edges, places, work.capacity.contacts],
        outputs=[work.contacts.n, work.overflow.contacts],
    )


def add_parts(model: Model, y: wp.array, work: Work, moves: wp.array) -> None:
    """Add the parts of the contacts to ``y``, positions or velocities, by the mobilities.

    Only in worlds where ``moves``, shape (n_world,), is not 0.
    """
    if work.implicit:
        return coupled.add_parts(model, y, work, moves)
    c = work.contacts
    launch_over(
        kernels.add_parts,
        model.n_vert,
        inputs=[c.graph, c.part, work.mobility, work.worlds, moves],
        outputs=[y],
    )
