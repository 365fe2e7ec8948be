"""The triangles beside the vertex of each pair: found by the Bvh now and then, and kept.

A list has all triangles within twice the reach. It holds those within the reach until both bodies
together have travelled the reach.
"""

import warp as wp

from warp_contact.kernels.broad_phase.skins import CAREFUL
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.surface_query import Hit, closer
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

MOST = wp.constant(8)  # triangles in a list

few_tris = wp.types.vector(length=8, dtype=wp.int32)


@wp.struct
class Beside:
    """The lists of all pairs of vertices and bodies, since these were found."""

    until: wp.array[float]  # (pairs,) [m] travelled by both, up to which the list holds
    n: wp.array[int]  # (pairs,) its length; above MOST there is no list
    tri: wp.array[few_tris]  # (pairs,)


@wp.func
def list_beside(
    pair: int,
    p: wp.vec3,
    root: int,
    reach: float,  # [m]
    spent: float,  # [m] travelled by both bodies
    mesh: Mesh,
    x: wp.array[wp.vec3],
    beside: Beside,
):
    """Find the triangles within twice the reach of p, unless the list of the pair holds."""
    if spent <= beside.until[pair]:
        return
    within = Hit()
    within.tri = -1
    within.t = 2.0 * reach
    n = int(0)
    k = int(0)
    grow = wp.vec3(within.t, within.t, within.t)
    query = wp.bvh_query_aabb(mesh.bvh, p - grow, p + grow, root)
    while wp.bvh_query_next(query, k):
        if closer(within, k, mesh.tris, x, p).tri >= 0:
            if n < MOST:
                beside.tri[pair][n] = k
            n += 1
    beside.n[pair] = n
    beside.until[pair] = spent + CAREFUL * reach
