"""Boxes around bodies and triangles."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.broad_phase import bounds


def of_bodies(
    model: Model,
    x: wp.array[wp.vec3],
    skin: wp.array[float],
    lower: wp.array[wp.vec3],
    upper: wp.array[wp.vec3],
) -> None:
    """Set the boxes of the bodies, grown by their skins [m], shape (n_body,)."""
    wp.launch(bounds.clear_boxes, dim=model.n_body, inputs=[], outputs=[lower, upper])
    wp.launch(
        bounds.body_boxes,
        dim=-(-model.n_surf // int(bounds.CHUNK)),
        inputs=[model.surf, model.vert_body, skin, x],
        outputs=[lower, upper],
    )


def of_triangles(
    model: Model,
    x: wp.array[wp.vec3],
    skin: wp.array[float],
    n_near: wp.array[int],
    lower: wp.array[wp.vec3],
    upper: wp.array[wp.vec3],
) -> None:
    """Set the boxes of the triangles of bodies near another, grown by the skins [m]."""
    wp.launch(
        bounds.triangle_boxes,
        dim=model.n_tri,
        inputs=[model.tris, model.tri_body, n_near, model.body_edge, skin, x],
        outputs=[lower, upper],
    )
