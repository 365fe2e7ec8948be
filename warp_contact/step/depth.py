"""Depth and direction of every vertex inside a body: at the border, then layer by layer."""

import warp as wp

from warp_contact.data.launch import launch_over, while_any
from warp_contact.data.model import Model
from warp_contact.data.switches import on
from warp_contact.data.work import Work
from warp_contact.kernels.lengths import SHALLOW
from warp_contact.kernels.narrow_phase import depth as kernels


def find_depths(model: Model, x: wp.array, work: Work) -> None:
    """Set depth, direction and layer of the penetrations at ``x``; call once for each list."""
    n, b = work.narrow_phase, work.broad_phase
    launch_over(
        kernels.border_depth,
        work.capacity.contacts,
        inputs=[SHALLOW, work.mesh, x, b.verts.list.start, n.inside_at, b.verts.travel.travelled],
        outputs=[b.beside, n.penetration, n.pending],
    )
    if on("layers"):
        while_any(n.pending, _fill_layer, x, work)


def _fill_layer(x: wp.array, work: Work) -> None:
    n = work.narrow_phase
    wp.launch(kernels.begin_layer, dim=1, inputs=[], outputs=[n.layer, n.pending])
    launch_over(
        kernels.propagate,
        work.capacity.contacts,
        inputs=[n.layer, work.mesh, x, work.broad_phase.verts.list.start, n.inside_at],
        outputs=[n.penetration, n.pending],
    )
