"""Stage 3, narrow phase: which surface edges cross another body, and their contacts.

Edges are tested at the positions to which the impulses on the vertices lead.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.broad_phase.skins import CAREFUL
from warp_contact.kernels.geometry import projected_crossing, projected_weights
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.apart import Apart, pair_clearance
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact, edge_contact, is_same
from warp_contact.kernels.narrow_phase.vertex_contact import SLIP
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)

AHEAD = wp.constant(16.0)  # detection passes: a larger clearance need not be known exactly


@wp.func
def is_among(found: EdgeContact, first: int, contact: wp.array[EdgeContact]) -> bool:
    """Whether the list of contacts that begins at ``first`` has the one that was found."""
    k = first
    while k >= 0:
        if is_same(found, contact[k]):
            return True
        k = contact[k].next
    return False


@wp.kernel
def find_crossings(
    # in
    threads: int,
    mesh: Mesh,
    pairs: PairList,  # edges and bodies
    skin: wp.array[float],  # (n_body,) [m]
    recent: wp.array[float],  # (n_body,) [m] largest of the last motions
    travelled: wp.array[float],  # (n_body + n_plane,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    clear_until: wp.array[float],  # (capacity,) [m] travelled by both, before any crossing
    separated: Apart,  # by what, in the last pass that looked at the pair
    place: wp.array[int],  # (capacity,) of its first contact in ``contact``, -1 for none
    contact: wp.array[EdgeContact],  # (contacts,) in any order
    # out
    crossing: wp.array[int],  # (capacity + 1,) contacts of the edge with the body
    # out, added to
    n_place: wp.array[int],  # (1,)
    n_new: wp.array[int],  # (1,) contacts found
    worlds: Worlds,  # those with such contacts
):
    """For each pair: find a contact beside those that it has; 0 contacts for the unused capacity.

    Contacts that do not fit are left out; ``total_contacts`` counts them and asks for capacity.
    """
    for c in range(wp.tid(), crossing.shape[0], threads):
        crossing[c] = 0
        if c >= pairs.n[0]:
            continue
        last = place[c]
        if last >= 0:
            crossing[c] = 1
            while contact[last].next >= 0:
                last = contact[last].next
                crossing[c] = crossing[c] + 1
        e = mesh.edges[pairs.pair[c][0]]
        own = mesh.vert_body[e[0]]
        body = pairs.pair[c][1]
        spent = travelled[own] + travelled[body]
        reach = skin[own] + skin[body]
        if spent < clear_until[c]:
            continue
        among = pairs.items[c]
        enough = wp.min(AHEAD * (recent[own] + recent[body]), reach)
        clear = pair_clearance(
            c, among, enough, pairs.item, mesh.tris, x, x[e[0]], x[e[1]], separated
        )
        clear_until[c] = spent + CAREFUL * clear
        if clear > 0.0:
            continue
        edge = mesh.body_edge[body]
        apart = worlds.apart[worlds.of_vert[e[0]]] != 0
        found = edge_contact(
            mesh.bvh, body, edge, apart, reach, among, pairs.item, mesh.tris, x0, x, e
        )
        if not found.found or (last >= 0 and is_among(found, place[c], contact)):
            continue
        crossing[c] = crossing[c] + 1
        wp.atomic_add(n_new, 0, 1)
        worlds.has_new[worlds.of_vert[e[0]]] = 1
        k = wp.atomic_add(n_place, 0, 1)
        if k >= contact.shape[0]:
            continue
        found.edge = pairs.pair[c][0]
        found.body = body
        found.next = -1
        contact[k] = found
        if last < 0:
            place[c] = k
        else:
            contact[last].next = k


@wp.func
def at_start(c: EdgeContact, i: int, j: int, x: wp.array[wp.vec3]) -> EdgeContact:
    """The contact of the edge from i to j with its weights at the start of the step."""
    t = c.vert
    if c.ridge:
        start = projected_crossing(x[i], x[j], x[t[0]], x[t[1]], c.n)
        if wp.length(start - wp.vec2(c.t, c.w[1])) < SLIP:
            c.t = start[0]
            c.w = wp.vec3(1.0 - start[1], start[1], 0.0)
    else:
        own = x[i] + c.t * (x[j] - x[i])
        w = projected_weights(own, c.n, x[t[0]], x[t[1]], x[t[2]])
        if wp.length(w - c.w) < SLIP:
            c.w = w
    return c


@wp.kernel
def edge_contacts(
    # in
    threads: int,
    mesh: Mesh,
    pairs: PairList,  # edges and bodies
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    crossing_at: wp.array[int],  # (capacity + 1,) contacts before each pair
    place: wp.array[int],  # (capacity,)
    found: wp.array[EdgeContact],  # (contacts,) by place
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step, for the weights
    # out
    contact: wp.array[Contact],  # (contacts,)
    source: wp.array[int],  # (contacts,) place of each contact of an edge
):
    """For each pair: its contacts, behind those of the vertices."""
    for k in range(wp.tid(), pairs.n[0], threads):
        c = n_vertex[0] + crossing_at[k]
        end = n_vertex[0] + crossing_at[k + 1]
        e = mesh.edges[pairs.pair[k][0]]
        at = place[k]
        while c < wp.min(end, contact.shape[0]) and at >= 0:
            now = at_start(found[at], e[0], e[1], x0)
            to = Contact()
            to.vert[0] = e[0]
            to.vert[1] = e[1]
            to.coef[0] = 1.0 - now.t
            to.coef[1] = now.t
            for m in range(3):
                to.vert[2 + m] = now.vert[m]
                to.coef[2 + m] = -now.w[m]
            to.normal = now.n
            to.depth = now.d
            to.pair = wp.vec2i(mesh.vert_body[e[0]], pairs.pair[k][1])
            to.edge_length = mesh.body_edge[mesh.vert_body[e[0]]]
            contact[c] = to
            source[c] = at
            at = now.next
            c += 1
