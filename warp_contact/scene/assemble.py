"""From a scene to the flat arrays of a Model and a State."""

from collections.abc import Sequence

import numpy as np
import warp as wp

from warp_contact.data.model import Elements, Model, Solid
from warp_contact.data.state import State
from warp_contact.scene import placement
from warp_contact.scene.attachments import lay_out
from warp_contact.scene.materials import Rigid
from warp_contact.scene.scene import Body, Scene


def assemble(scene: Scene) -> tuple[Model, State]:
    """Lay the bodies of a scene out one behind the other, on the current device.

    Raises:
        ValueError: the scene has no body, or a placement that ``placement.check`` refuses
    """
    bodies = scene.bodies
    if not bodies:
        raise ValueError("the scene has no body")
    placement.check(bodies)
    placement.check_weights(bodies, np.array(scene.gravity))
    x = np.concatenate([body.x for body in bodies])
    v = np.concatenate([body.v for body in bodies])
    tets = _joined(bodies, "tets")
    tris = _joined(bodies, "surface")
    tet0 = _first(bodies, "tets")
    model = Model(
        labels=tuple(body.label for body in bodies),
        materials=tuple(body.material for body in bodies),
        solids=tuple(_solid(body) for body in bodies),
        elements=_elements(scene, tet0),
        gravity=np.array(scene.gravity),
        g=wp.array([scene.gravity], dtype=wp.vec3),
        friction=_floats(scene.coefficients("friction")),
        restitution=_floats(scene.coefficients("restitution")),
        n_body=len(bodies),
        n_vert=len(x),
        n_tet=len(tets),
        n_tri=len(tris),
        n_plane=len(scene.planes),
        **_of_bodies(bodies),
        **_of_tets(scene, x, tets, tet0),
        **_of_surface(bodies, tris, len(x)),
        **_neighbours(bodies, len(x)),
        plane_n=wp.array(np.array([n for n, _ in scene.planes]).reshape(-1, 3), dtype=wp.vec3),
        plane_h=_floats([h for _, h in scene.planes]),
        ties=lay_out(scene.attachments, scene.bodies),
    )
    starts = np.concatenate([body.starts for body in bodies])
    return model, State(x=wp.array(starts, dtype=wp.vec3), v=wp.array(v, dtype=wp.vec3))


def _first(bodies: Sequence[Body], part: str) -> np.ndarray:
    """Number of the first vertex, tet or surface triangle of each body, closed by their count."""
    return _prefix(len(getattr(body.mesh, part)) for body in bodies)


def _joined(bodies: Sequence[Body], part: str) -> np.ndarray:
    """Cells of all meshes, over the vertices of all."""
    first = _first(bodies, "vertices")
    return np.concatenate([getattr(b.mesh, part) + i for b, i in zip(bodies, first, strict=False)])


def _of_bodies(bodies: Sequence[Body]) -> dict:
    """Ranges, sizes and worlds of the bodies."""
    meshes = [body.mesh for body in bodies]
    vert0 = _first(bodies, "vertices")
    lengths = [np.linalg.norm(np.diff(m.vertices[m.edges], axis=1), axis=2) for m in meshes]
    return {
        "cell": float(np.concatenate(lengths).mean()),
        "body_vert": _ints(vert0),
        "body_tet": _ints(_first(bodies, "tets")),
        "body_tri": _ints(_first(bodies, "surface")),
        "body_world": _ints([body.world for body in bodies]),
        "body_edge": _floats([length.mean() for length in lengths]),
        "body_thickness": _floats([_thickness(mesh) for mesh in meshes]),
        "rest": np.concatenate([mesh.vertices for mesh in meshes]),
        "vert_body": _ints(np.repeat(np.arange(len(bodies)), np.diff(vert0))),
    }


def _of_tets(scene: Scene, x: np.ndarray, tets: np.ndarray, tet0: np.ndarray) -> dict:
    """The tets, their rest shapes, and the masses that they give to their vertices."""
    bodies = scene.bodies
    volume = np.concatenate([body.mesh.volumes for body in bodies])
    density = np.repeat([_density(body) for body in bodies], np.diff(tet0))
    mass = np.zeros(len(x))
    np.add.at(mass, tets.ravel(), np.repeat(density * volume / 4.0, 4))
    fixed = np.concatenate([body.fixed for body in bodies])
    corner = x[tets]
    pose = np.linalg.inv(np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2))
    of_tet = np.repeat(np.arange(len(bodies)), np.diff(tet0))
    vt_start, vt_corner = _incidence(tets, len(x), by_entry=True)
    return {
        "mass": _floats(mass),
        "inv_mass": _floats(np.where(fixed, 0.0, 1.0 / mass)),
        "tets": wp.array(tets, dtype=wp.vec4i),
        "tet_body": _ints(np.concatenate([of_tet, len(bodies) + np.arange(len(scene.planes))])),
        "pose": wp.array(pose, dtype=wp.mat33),
        "volume": _floats(volume),
        "vt_start": vt_start,
        "vt_corner": vt_corner,
    }


def _solid(body) -> Solid | None:
    if body.fixed.any() or not isinstance(body.material, Rigid):
        return None
    return body.material.solid(body.mesh.vertices, body.mesh.tets)


def _density(body) -> float:
    if body.material.density is None:
        return body.material.mass / body.mesh.volume
    return body.material.density


def _of_surface(bodies: Sequence[Body], tris: np.ndarray, n_vert: int) -> dict:
    """Surface vertices, triangles and edges."""
    vert0, tri0 = _first(bodies, "vertices"), _first(bodies, "surface")
    edges = np.concatenate(
        [
            body.mesh.surface_edges + np.array([i, i, t, t], dtype=np.int32)
            for body, i, t in zip(bodies, vert0, tri0, strict=False)
        ]
    )
    surf = np.unique(tris)
    on_surface = np.zeros(n_vert, dtype=np.int32)
    on_surface[surf] = 1
    vs_start, vs_tri = _incidence(tris, n_vert)
    return {
        "n_edge": len(edges),
        "n_surf": len(surf),
        "surf": _ints(surf),
        "on_surface": _ints(on_surface),
        "tris": wp.array(tris, dtype=wp.vec3i),
        "tri_body": _ints(np.repeat(np.arange(len(bodies)), np.diff(tri0))),
        "edges": wp.array(edges, dtype=wp.vec4i),
        "vs_start": vs_start,
        "vs_tri": vs_tri,
    }


def _neighbours(bodies: Sequence[Body], n_vert: int) -> dict:
    """The vertices that each one is joined to by an edge of a tet, ascending."""
    links = _joined(bodies, "edges")
    ends = np.concatenate([links, links[:, ::-1]])
    ends = ends[np.lexsort((ends[:, 1], ends[:, 0]))]
    return {
        "vn_start": _ints(_prefix(np.bincount(ends[:, 0], minlength=n_vert))),
        "vn_vert": _ints(ends[:, 1]),
    }


def _elements(scene: Scene, tet0: np.ndarray) -> tuple[Elements, ...]:
    """The tets of the scene by material model, in the order of first use.

    Those of a body that is fixed as a whole push nothing: an obstacle may be driven into any shape.
    """
    groups: dict = {}
    for body in scene.bodies:
        if body.material.kernels is not None and not body.fixed.all():
            groups.setdefault(body.material.kernels, []).append(body)
    out = []
    for kernels, bodies in groups.items():
        tet = np.concatenate([np.arange(tet0[b.index], tet0[b.index + 1]) for b in bodies])
        rows = [b.material.parameters(b.mesh.vertices, b.mesh.tets) for b in bodies]
        damped = any(b.material.damping > 0.0 for b in bodies)
        param = wp.array(np.concatenate(rows), dtype=kernels.ROW)
        out.append(Elements(kernels, _ints(tet), param, damped))
    return tuple(out)


def _thickness(mesh) -> float:
    a, b, c = np.moveaxis(mesh.vertices[mesh.surface], 1, 0)
    return 4.0 * mesh.volume / np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def _prefix(counts) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.fromiter(counts, dtype=np.int64))]).astype(np.int32)


def _incidence(cells: np.ndarray, n: int, by_entry: bool = False) -> tuple[wp.array, wp.array]:
    """Rows of ``cells`` (or entries of its flat view) at each vertex, ascending, as CSR."""
    order = np.argsort(cells.ravel(), kind="stable")
    start = _prefix(np.bincount(cells.ravel(), minlength=n))
    return _ints(start), _ints(order if by_entry else order // cells.shape[1])


def _ints(values) -> wp.array:
    return wp.array(np.asarray(values, dtype=np.int32), dtype=int)


def _floats(values) -> wp.array:
    return wp.array(np.asarray(values, dtype=np.float32), dtype=float)
