"""Arrays of the model as structs that kernels take."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.mobility import Mobility


def mesh_of(model: Model, surface: wp.Bvh) -> Mesh:
    """What the search for contacts reads; ``surface`` is a Bvh over the triangles, by body."""
    mesh = Mesh()
    mesh.shortest_edge = float(model.body_edge.numpy().min())
    mesh.n_body, mesh.bvh = model.n_body, surface.id
    mesh.tets, mesh.tris, mesh.edges = model.tets, model.tris, model.edges
    mesh.tri_body, mesh.vert_body = model.tri_body, model.vert_body
    mesh.on_surface, mesh.body_vert = model.on_surface, model.body_vert
    mesh.body_edge = model.body_edge
    mesh.vs_start, mesh.vs_tri = model.vs_start, model.vs_tri
    mesh.vn_start, mesh.vn_vert = model.vn_start, model.vn_vert
    mesh.plane_n, mesh.plane_h = model.plane_n, model.plane_h
    return mesh


def lumped(model: Model) -> Mobility:
    """How the vertices answer an impulse: the only source for the contact solver."""
    mobility = Mobility()
    mobility.inv_mass = model.inv_mass
    return mobility
