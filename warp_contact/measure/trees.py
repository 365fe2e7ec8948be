"""Bvhs over bodies, triangles and tets for measurements: those of the step are not used."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.structs import mesh_of
from warp_contact.kernels.broad_phase import bounds
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.output import measure as kernels
from warp_contact.kernels.output import tunnelling


class Trees:
    """Built at the first use.

    Attributes:
        bodies: Bvh over the paths of the bodies, grouped by world
        volumes: Bvh over the tets, grouped by world
        mesh: with a Bvh over the paths of the triangles
    """

    def __init__(self, model: Model):
        """Allocate the boxes."""
        self._model = model
        sizes = model.n_body, model.n_tri, model.n_tet
        self._boxes = [(wp.zeros(n, dtype=wp.vec3), wp.zeros(n, dtype=wp.vec3)) for n in sizes]
        self._skin = wp.zeros(model.n_body, dtype=float)
        self.bodies: wp.Bvh | None = None
        self.volumes: wp.Bvh | None = None
        self.mesh: Mesh | None = None

    def refit(self, x0: wp.array, x: wp.array) -> None:
        """Take the paths of bodies and triangles from x0 to x, and the tets at x."""
        model = self._model
        of_body, of_tri, of_tet = (list(box) for box in self._boxes)
        wp.launch(bounds.clear_boxes, dim=model.n_body, inputs=[], outputs=of_body)
        for place in (x0, x):
            wp.launch(
                bounds.body_boxes,
                dim=-(-model.n_surf // int(bounds.CHUNK)),
                inputs=[model.surf, model.vert_body, self._skin, place],
                outputs=of_body,
            )
        ways = [model.tris, model.tri_body, model.body_edge, x0, x]
        wp.launch(tunnelling.triangle_paths, dim=model.n_tri, inputs=ways, outputs=of_tri)
        wp.launch(kernels.tet_boxes, dim=model.n_tet, inputs=[model.tets, x], outputs=of_tet)
        if self.mesh is None:
            self._build()
        for bvh in (self.bodies, self._surface, self.volumes):
            bvh.refit()

    def _build(self) -> None:
        model = self._model
        world = model.body_world.numpy()[model.vert_body.numpy()[model.tets.numpy()[:, 0]]]
        groups = model.body_world, model.tri_body, wp.array(world.astype(np.int32), dtype=int)
        self.bodies, self._surface, self.volumes = (
            wp.Bvh(*box, groups=group) for box, group in zip(self._boxes, groups, strict=True)
        )
        self.mesh = mesh_of(model, self._surface)
