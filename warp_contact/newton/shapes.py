"""Shapes of Newton as meshes of tets."""

import numpy as np
from newton import GeoType, Mesh, Model

from warp_contact.scene.mesh import MeshError, TetMesh
from warp_contact.scene.scene import rotation_matrix
from warp_contact.scene.shapes import box, cylinder, sphere
from warp_contact.scene.shell import shell
from warp_contact.scene.surface import Surface

BALL = 309  # vertices of a sphere: facets that are 0.3 % of the radius inside it
RINGS = 4  # of a cylinder
PART = 0.05  # of the diagonal of a surface: the thickness of its shell
SEAM = 1e-6  # of the same: vertices nearer than that are one


def half_space(model: Model, k: int) -> tuple[tuple[float, ...], float] | None:
    """Normal and offset [m] of shape ``k``, None for one that is no endless plane."""
    scale = model.shape_scale.numpy()[k]
    if model.shape_type.numpy()[k] != GeoType.PLANE or scale[:2].any():
        return None
    place = model.shape_transform.numpy()[k].astype(np.float64)
    n = rotation_matrix(place[3:])[:, 2]
    return tuple(n.tolist()), float(n @ place[:3])


def mesh_of(model: Model, k: int, thickness: float | None) -> TetMesh:
    """Shape ``k`` in the frame of its body, or of the world.

    Boxes, spheres and cylinders are solid; capsules, meshes and planes with an end are shells of a
    ``thickness`` [m] on their inner side, or below; None takes ``PART`` of their diagonal.

    Raises:
        ValueError: naming a shape that is of no known kind, or cannot have that thickness
    """
    kind = GeoType(int(model.shape_type.numpy()[k]))
    a, b, c = model.shape_scale.numpy()[k].astype(np.float64).tolist()
    name = f"shape '{model.shape_label[k]}'"
    try:
        if kind == GeoType.BOX:
            mesh = box((2.0 * a, 2.0 * b, 2.0 * c), 2)
        elif kind == GeoType.SPHERE:
            mesh = sphere(a, BALL)
        elif kind == GeoType.CYLINDER and not c:
            mesh = cylinder(a, 2.0 * b, RINGS)
        else:
            mesh = _shell(_surface(model, k, kind), thickness)
    except (ValueError, MeshError) as error:
        raise ValueError(f"{name}: {error}") from None
    place = model.shape_transform.numpy()[k].astype(np.float64)
    return mesh.transformed(rotation_matrix(place[3:]), place[:3])


def union(meshes: list[TetMesh]) -> TetMesh:
    """All meshes as one; where they lie side by side, vertices in the same place are joined."""
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    tets = [mesh.tets + start for mesh, start in zip(meshes, first[:-1], strict=True)]
    whole = TetMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(tets))
    return whole.welded() if len(whole.seams) else whole


def _surface(model: Model, k: int, kind: GeoType) -> Surface:
    scale = model.shape_scale.numpy()[k].astype(np.float64)
    if kind == GeoType.PLANE:
        x = 0.5 * scale * [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
        return Surface(x, [[0, 1, 2], [0, 2, 3]])
    if kind == GeoType.CAPSULE:
        source, scale = Mesh.create_capsule(scale[0], scale[1], up_axis=2), np.ones(3)
    elif kind in (GeoType.MESH, GeoType.CONVEX_MESH):
        source = model.shape_source[k]
    else:
        known = "planes, boxes, spheres, cylinders, capsules and meshes are known"
        raise ValueError(f"{kind.name} has no tets; {known}")
    x = np.asarray(source.vertices, dtype=np.float64).reshape(-1, 3) * scale
    tris = np.asarray(source.indices).reshape(-1, 3)
    tris = tris if np.prod(scale) > 0.0 else tris[:, ::-1]
    return Surface(x, tris).welded(SEAM * float(np.linalg.norm(np.ptp(x, axis=0))))


def _shell(surface: Surface, thickness: float | None) -> TetMesh:
    if thickness is None:
        thickness = PART * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    try:
        return shell(surface, thickness, "inside")
    except MeshError as error:
        raise ValueError(f"{error}; give the solver a thickness") from None
