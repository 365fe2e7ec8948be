"""The weights of a contact switched off, to see what they are for.

A contact point lies inside a triangle (or on an edge), and w_i are its barycentric weights there.
They enter the displacement vectors, eq. (1) of Spillmann and Teschner (2005), the pressure of the
other side, eq. (2), and with the default response the impulses. Without them a force jumps from
vertex to vertex while a contact point wanders:

    closest    all of the weight on the vertex with the largest
    mean       the same weight on all vertices of the triangle

What the package does is not touched: its contacts are changed right after they were found.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import warp as wp

from warp_contact.step import depth

wp.set_module_options({"enable_backward": False})

CLOSEST, MEAN = "closest vertex", "plain mean"
OFF = CLOSEST, MEAN


@contextmanager
def switched_off(how: str) -> Iterator[None]:
    """Contacts of vertices without weights, ``how`` one of ``OFF``, inside of the block."""
    found = depth.vertex_contacts

    def vertex_contacts(model, x0, x, work, fresh):
        found(model, x0, x, work, fresh)
        c = work.contacts
        wp.launch(
            level,
            dim=work.capacity.contacts,
            inputs=[how == CLOSEST, model.n_body, c.n, c.pair],
            outputs=[c.coef],
        )

    with patch.object(depth, "vertex_contacts", vertex_contacts):
        yield


@wp.kernel
def level(
    # in
    closest: bool,
    n_body: int,
    n_contact: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    # in, out
    coef: wp.array2d[float],  # (capacity, 5), of the triangle's corners from 2 on
):
    """One thread per contact: one corner of the triangle takes all of it, or each a third."""
    c = wp.tid()
    if c >= n_contact[0] or pair[c][1] >= n_body or coef[c, 0] == 0.0:
        return
    most = int(2)
    for k in range(3, 5):
        if coef[c, k] < coef[c, most]:
            most = k
    for k in range(2, 5):
        if closest:
            coef[c, k] = wp.where(k == most, -1.0, 0.0)
        else:
            coef[c, k] = -1.0 / 3.0
