"""Stage 6, region: the deformation region, and where its vertices would go to resolve overlaps.

Displacement vector of a vertex, eq. (1) of Spillmann & Teschner 2005. Its own penetration vector d
points out of the other body. The vertices whose contact triangle it belongs to have vectors d_i
that push it the other way, hence the minus sign. With the plus sign as printed they would cancel:

    s = (d - sum w_i d_i) / (sum w_i + 1)                                               [m]
"""

import warp as wp

from warp_contact.kernels.mobility import Mobility, mobility_of
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)


@wp.kernel
def displacement_vectors(
    # in
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    residual: wp.array[float],  # (capacity,) [m]
    bodies: Mobility,
    worlds: Worlds,
    moves: wp.array[int],  # (n_world,) not 0 where there is something to resolve
    # out
    s: wp.array[wp.vec3],  # (n_vert,) [m], zero outside the region
):
    """One thread per vertex: eq. (1); the end of an edge counts with its weight on the edge."""
    i = wp.tid()
    s[i] = wp.vec3(0.0, 0.0, 0.0)
    if mobility_of(i, bodies) == 0.0 or moves[worlds.of_vert[i]] == 0:
        return
    own = wp.vec3(0.0, 0.0, 0.0)
    own_weight = float(0.0)
    others = wp.vec3(0.0, 0.0, 0.0)
    others_weight = float(0.0)
    for e in range(graph.start[i], graph.start[i + 1]):
        c = graph.entry[e] // 5
        k = graph.entry[e] - 5 * c
        w = wp.abs(contact[c].coef[k])
        if residual[c] > 0.0:
            if k < 2:
                own += w * residual[c] * contact[c].normal
                own_weight += w
            else:
                others += w * residual[c] * contact[c].normal
                others_weight += w
    if own_weight > 1.0:
        own = own / own_weight
    s[i] = (own - others) / (others_weight + 1.0)


@wp.kernel
def touching_tets(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    mask: wp.array[int],  # (n_tet,) 1 for a tet with a vertex of the region
):
    """One thread per tet: whether its forces change during the search."""
    q = wp.tid()
    mask[q] = 0
    for k in range(4):
        if wp.length_sq(s[tets[q][k]]) > 0.0:
            mask[q] = 1
