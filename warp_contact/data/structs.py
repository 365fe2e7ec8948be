"""Arrays of the model as structs that kernels take."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.surface import Surface
from warp_contact.kernels.lengths import NEGLIGIBLE
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.mobility import Mobility
from warp_contact.kernels.worlds import Worlds


def mesh_of(model: Model, surface: wp.Bvh) -> Mesh:
    """What the search for contacts reads; ``surface`` is a Bvh over the triangles, by body."""
    mesh = Mesh()
    of_body, shortest = _shortest_edges(model)
    mesh.shortest_edge = wp.array(shortest[of_body], dtype=float)
    mesh.n_body, mesh.bvh = model.n_body, surface.id
    mesh.tets, mesh.tris, mesh.edges = model.tets, model.tris, model.edges
    mesh.tri_body, mesh.vert_body = model.tri_body, model.vert_body
    mesh.on_surface, mesh.body_vert = model.on_surface, model.body_vert
    mesh.body_edge = model.body_edge
    mesh.vs_start, mesh.vs_tri = model.vs_start, model.vs_tri
    mesh.vn_start, mesh.vn_vert = model.vn_start, model.vn_vert
    mesh.plane_n, mesh.plane_h = model.plane_n, model.plane_h
    return mesh


def mobilities_of(model: Model, rows: bool) -> Mobility:
    """How the vertices answer an impulse; with ``rows`` where some bodies take implicit steps."""
    mobility = Mobility()
    mobility.inv_mass = model.inv_mass
    mobility.row = wp.zeros(model.n_vert if rows else 0, dtype=float)
    return mobility


def n_world(model: Model) -> int:
    """How many worlds there are."""
    return len(np.unique(model.body_world.numpy()))


def worlds_of(model: Model, surface: Surface, has_new: wp.array, unsolved: wp.array) -> Worlds:
    """What a step knows of each world; bodies may overlap. Arrays given are as in ``Worlds``."""
    of_body, shortest = _shortest_edges(model)
    of_vert = of_body[model.vert_body.numpy()].astype(np.int32)
    worlds = Worlds()
    worlds.of_vert = wp.array(of_vert, dtype=int)
    worlds.negligible = wp.array(NEGLIGIBLE * shortest, dtype=float)
    worlds.apart, worlds.doing, worlds.asking = (
        wp.zeros(len(shortest), dtype=int) for _ in range(3)
    )
    worlds.sweep = wp.zeros(1, dtype=int)
    worlds.open, worlds.old, worlds.was_old = surface.open, surface.old, surface.was_old
    worlds.has_new, worlds.unsolved = has_new, unsolved
    return worlds


def _shortest_edges(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Number of the world of each body, and the shortest mean edge [m] of one in each world."""
    names, of_body = np.unique(model.body_world.numpy(), return_inverse=True)
    shortest = np.full(len(names), np.inf)
    np.minimum.at(shortest, of_body, model.body_edge.numpy())
    return of_body, shortest
