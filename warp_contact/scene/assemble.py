"""From a scene to the flat arrays of a Model and a State."""

import numpy as np
import warp as wp

from warp_contact.data.model import Elements, Model
from warp_contact.data.state import State
from warp_contact.scene import placement
from warp_contact.scene.scene import Scene


def assemble(scene: Scene) -> tuple[Model, State]:
    """Lay the bodies of a scene out one behind the other, on the current device.

    Raises:
        ValueError: the scene has no body, or bodies where none can be, see ``placement``
    """
    bodies = scene.bodies
    if not bodies:
        raise ValueError("the scene has no body")
    placement.check(bodies)
    meshes = [body.mesh for body in bodies]
    vert0 = _prefix(len(mesh.vertices) for mesh in meshes)
    tet0 = _prefix(len(mesh.tets) for mesh in meshes)
    tri0 = _prefix(len(mesh.surface) for mesh in meshes)
    n_vert, n_tet, n_tri = int(vert0[-1]), int(tet0[-1]), int(tri0[-1])

    x = np.concatenate([body.x for body in bodies])
    tets = np.concatenate([m.tets + i for m, i in zip(meshes, vert0, strict=False)])
    tris = np.concatenate([m.surface + i for m, i in zip(meshes, vert0, strict=False)])
    edges = np.concatenate(
        [
            m.surface_edges + np.array([i, i, t, t], dtype=np.int32)
            for m, i, t in zip(meshes, vert0, tri0, strict=False)
        ]
    )
    links = np.concatenate([m.edges + i for m, i in zip(meshes, vert0, strict=False)])
    volume = np.concatenate([m.volumes for m in meshes])
    mass = np.zeros(n_vert)
    density = np.repeat([body.material.density for body in bodies], np.diff(tet0))
    np.add.at(mass, tets.ravel(), np.repeat(density * volume / 4.0, 4))
    fixed = np.concatenate([body.fixed for body in bodies])
    corner = x[tets]
    pose = np.linalg.inv(np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2))
    surf = np.unique(tris)
    on_surface = np.zeros(n_vert, dtype=np.int32)
    on_surface[surf] = 1
    lengths = [np.linalg.norm(np.diff(m.vertices[m.edges], axis=1), axis=2) for m in meshes]
    vt_start, vt_corner = _incidence(tets, n_vert, by_entry=True)
    vs_start, vs_tri = _incidence(tris, n_vert)
    ends = np.concatenate([links, links[:, ::-1]])
    ends = ends[np.lexsort((ends[:, 1], ends[:, 0]))]

    of_tet = np.repeat(np.arange(len(bodies)), np.diff(tet0))
    model = Model(
        labels=tuple(body.label for body in bodies),
        materials=tuple(body.material for body in bodies),
        elements=_elements(scene, tet0),
        gravity=scene.gravity,
        friction=scene.friction,
        n_body=len(bodies),
        n_vert=n_vert,
        n_tet=n_tet,
        n_tri=n_tri,
        n_edge=len(edges),
        n_surf=len(surf),
        n_plane=len(scene.planes),
        cell=float(np.concatenate(lengths).mean()),
        body_vert=_ints(vert0),
        body_tet=_ints(tet0),
        body_tri=_ints(tri0),
        body_world=_ints([body.world for body in bodies]),
        body_edge=_floats([length.mean() for length in lengths]),
        body_thickness=_floats([_thickness(mesh) for mesh in meshes]),
        vert_body=_ints(np.repeat(np.arange(len(bodies)), np.diff(vert0))),
        mass=_floats(mass),
        inv_mass=_floats(np.where(fixed, 0.0, 1.0 / mass)),
        surf=_ints(surf),
        on_surface=_ints(on_surface),
        tets=wp.array(tets, dtype=wp.vec4i),
        tet_body=_ints(np.concatenate([of_tet, len(bodies) + np.arange(len(scene.planes))])),
        pose=wp.array(pose, dtype=wp.mat33),
        volume=_floats(volume),
        tris=wp.array(tris, dtype=wp.vec3i),
        tri_body=_ints(np.repeat(np.arange(len(bodies)), np.diff(tri0))),
        edges=wp.array(edges, dtype=wp.vec4i),
        vt_start=vt_start,
        vt_corner=vt_corner,
        vs_start=vs_start,
        vs_tri=vs_tri,
        vn_start=_ints(_prefix(np.bincount(ends[:, 0], minlength=n_vert))),
        vn_vert=_ints(ends[:, 1]),
        plane_n=wp.array(np.array([n for n, _ in scene.planes]).reshape(-1, 3), dtype=wp.vec3),
        plane_h=_floats([h for _, h in scene.planes]),
    )
    v = np.concatenate([body.v for body in bodies])
    return model, State(x=wp.array(x, dtype=wp.vec3), v=wp.array(v, dtype=wp.vec3))


def _elements(scene: Scene, tet0: np.ndarray) -> tuple[Elements, ...]:
    """The tets of the scene by material model, in the order of first use."""
    groups: dict = {}
    for body in scene.bodies:
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
