"""The render surfaces of bodies: where they are, as the tets have deformed."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.output import skin as kernels
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.surface import Surface
from warp_contact.scene.topology import FACES


@dataclass(frozen=True)
class Skin:
    """How a surface hangs on a mesh, wherever that is placed.

    Attributes:
        tet: the tet of each vertex, shape (n,)
        weight: of its corners, shape (n,)
        pose: inverse of the rest edge matrix of all tets, in the frame of the mesh [1/m], (n_tet,)
        tris: triangles, shape (f,)
        normal: at rest, of each corner, shape (3 f,); None where triangles give them
        point: vertex of each corner, shape (3 f,)
        start: first entry of each vertex in ``around``, shape (n + 1,)
        around: triangles at each vertex, shape (3 f,)
    """

    tet: wp.array
    weight: wp.array
    pose: wp.array
    tris: wp.array
    normal: wp.array | None
    point: wp.array
    start: wp.array
    around: wp.array


class Skins:
    """The render surfaces of a scene."""

    def __init__(self, scene: Scene, model: Model):
        """Find the tets of all; bodies that share mesh and surface share what is found."""
        found: dict[tuple[int, int], Skin] = {}
        self._model, self._of = model, {}
        for body in scene.bodies:
            if body.render is not None:
                key = id(body.mesh), id(body.render)
                if key not in found:
                    found[key] = _skin(body.mesh, body.render)
                self._of[body.index] = found[key]

    def __contains__(self, body: int) -> bool:
        """Whether a body has one."""
        return body in self._of

    def at(self, body: int, x: wp.array) -> tuple[np.ndarray, np.ndarray]:
        """Its vertices [m], (n, 3), and unit normals, of vertices (n, 3) or corners (f, 3, 3).

        Where all vertices of the scene are at ``x``.
        """
        skin, model = self._of[body], self._model
        first, last = model.body_tet.numpy()[body : body + 2].tolist()
        tets, n = model.tets[first:last], skin.tet.shape[0]
        points = wp.empty(n, dtype=wp.vec3)
        wp.launch(kernels.place, n, inputs=[tets, skin.tet, skin.weight, x], outputs=[points])
        if skin.normal is None:
            normals = wp.empty(n, dtype=wp.vec3)
            inputs = [skin.tris, skin.start, skin.around, points]
            wp.launch(kernels.sum_normals, n, inputs=inputs, outputs=[normals])
            return points.numpy(), normals.numpy()
        normals = wp.empty(skin.point.shape[0], dtype=wp.vec3)
        inputs = [tets, skin.pose, skin.tet, skin.point, skin.normal, x]
        wp.launch(kernels.turn_normals, len(normals), inputs=inputs, outputs=[normals])
        return points.numpy(), normals.numpy().reshape(-1, 3, 3)


def _skin(mesh: TetMesh, surface: Surface) -> Skin:
    corner, n = mesh.vertices[mesh.tets], len(surface.vertices)
    pose = wp.array(np.linalg.inv(np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2)), dtype=wp.mat33)
    tets, y = wp.array(mesh.tets, dtype=wp.vec4i), wp.array(mesh.vertices, dtype=wp.vec3)
    lower, upper = (wp.array(side(corner, axis=1), dtype=wp.vec3) for side in (np.min, np.max))
    boxes = wp.Bvh(lower, upper)
    whole = wp.Mesh(y, wp.array(mesh.surface.ravel(), dtype=int))
    tet, weight = wp.zeros(n, dtype=int), wp.zeros(n, dtype=wp.vec4)
    inputs = [boxes.id, whole.id, wp.array(_tet_of(mesh), dtype=int), tets, pose, y]
    inputs.append(wp.array(surface.vertices, dtype=wp.vec3))
    wp.launch(kernels.find_tets, n, inputs=inputs, outputs=[tet, weight])
    flat, normal = surface.triangles.ravel(), surface.normals
    count = np.bincount(flat, minlength=n)
    return Skin(
        tet=tet,
        weight=weight,
        pose=pose,
        tris=wp.array(surface.triangles, dtype=wp.vec3i),
        normal=None if normal is None else wp.array(normal.reshape(-1, 3), dtype=wp.vec3),
        point=wp.array(flat, dtype=int),
        start=wp.array(np.append(0, np.cumsum(count)), dtype=int),
        around=wp.array(np.argsort(flat, kind="stable") // 3, dtype=int),
    )


def _tet_of(mesh: TetMesh) -> np.ndarray:
    """The tet of each triangle of the surface, which come in the order of their tets, (f,)."""
    faces = mesh.tets[:, FACES].reshape(-1, 3)
    row = np.unique(np.concatenate([faces, mesh.surface]), axis=0, return_inverse=True)[1].ravel()
    return np.flatnonzero(np.isin(row[: len(faces)], row[len(faces) :])) // len(FACES)
