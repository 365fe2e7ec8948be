"""The meshes of all bodies, as the search for contacts reads them.

One struct, so that kernels have few arguments. Bodies are ranges of vertices, tets and triangles.
``warp_contact/data/model.py`` has the same arrays for the host.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.struct
class Mesh:
    """The meshes of all bodies, and the half-spaces."""

    n_body: int  # a body m >= n_body is half-space m - n_body
    bvh: wp.uint64  # Bvh over the triangles, grouped by body
    tets: wp.array[wp.vec4i]  # (n_tet,)
    tris: wp.array[wp.vec3i]  # (n_tri,) surface, outward
    tri_body: wp.array[int]  # (n_tri,)
    edges: wp.array[wp.vec4i]  # (n_edge,) surface edges and their two triangles
    vert_body: wp.array[int]  # (n_vert,)
    on_surface: wp.array[int]  # (n_vert,)
    body_vert: wp.array[int]  # (n_body + 1,) first vertex of each body
    body_edge: wp.array[float]  # (n_body,) mean edge [m]
    shortest_edge: wp.array[float]  # (n_body,) shortest mean edge of a body of the same world [m]
    vs_start: wp.array[int]  # (n_vert + 1,) first entry of each vertex in vs_tri
    vs_tri: wp.array[int]  # (3 n_tri,) surface triangles at each vertex
    vn_start: wp.array[int]  # (n_vert + 1,) first entry of each vertex in vn_vert
    vn_vert: wp.array[int]  # (2 n_link,) neighbours of each vertex along tet edges, ascending
    plane_n: wp.array[wp.vec3]  # (n_plane,) outward unit normals
    plane_h: wp.array[float]  # (n_plane,) offsets [m]
