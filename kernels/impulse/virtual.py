"""Springs to a virtual contact surface between two overlapping bodies.

After Keiser, Mueller, Heidelberger, Teschner and Gross, "Contact handling for deformable
point-based objects" (VMV 2004). Where bodies overlap, their virtual contact surface lies where the
distances f_1, f_2 to both their surfaces agree. At each sample of it the closest points of the two
surfaces, at d_1 and d_2 from it, are pulled to it, and either body gets half of the difference:

    F_i = -k d_i - c (v_i . e_i) e_i,  F = (F_1 - F_2) / 2,  e_i = d_i / |d_i|

where v_i is the velocity of body i relative to the other.

Here each contact of depth d has one sample, on the way from its penetrating side to the other:

    f_1 = m_1 t,  f_2 = m_2 (d - t)               at t along n, 0 <= t <= d        [m]
    f = d m_1 m_2 / (m_1 + m_2)                   where both are the same          [m]
    lambda = h max(0, k f - c u . n)              normal impulse of a step         [N s]

m_1 and m_2 are the cosines of n with the normals of the faces of either side, as distances are to
planes of faces. Where these face each other, f is half the depth: ``Penalty`` of half the
stiffness. Where faces lean, as at a corner, the virtual surface is closer to both.

Differences to the paper: where several faces meet, that which faces the other side most counts, not
the closest; a wall beside would take the force from the rim of a block that lies flat. There a
softer body may give way further, by weights on f_1 and f_2; between flat faces the force does not
depend on them, as f_1 + f_2 = d. There forces are in proportion to the area of a sample, here each
contact has a spring, as in penalty.py. Friction is that of one_pass.py, none across an overlap too
deep for the torque.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.one_pass import give
from warp_contact.kernels.impulse.penalty import impulse_of_spring
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.contact import Contact, meets_edge, relative_velocity
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def facing(i: int, j: int, n: wp.vec3, mesh: Mesh, x: wp.array[wp.vec3]) -> float:
    """Largest cosine of n with the normal of a face that vertices i and j share; at least 0."""
    most = float(0.0)
    for e in range(mesh.vs_start[i], mesh.vs_start[i + 1]):
        t = mesh.tris[mesh.vs_tri[e]]
        if t[0] == j or t[1] == j or t[2] == j:
            most = wp.max(most, wp.dot(n, face_normal(t, x)))
    return most


@wp.func
def distance(at: Contact, mesh: Mesh, x: wp.array[wp.vec3]) -> float:
    """Distance f of the virtual surface from both surfaces [m]; 0 without an overlap."""
    if at.depth <= 0.0:
        return 0.0
    one = facing(at.vert[0], at.vert[1], -at.normal, mesh, x)
    other = float(1.0)
    if not at.on_plane:
        t = wp.vec3i(at.vert[2], at.vert[3], at.vert[4])
        if meets_edge(at):
            other = facing(t[0], t[1], at.normal, mesh, x)
        else:
            other = wp.max(wp.dot(at.normal, face_normal(t, x)), 0.0)
    if one * other == 0.0:
        return 0.0
    return at.depth * one * other / (one + other)


@wp.kernel
def virtual_impulses(
    # in
    threads: int,
    spring: wp.vec2,  # stiffness [N/m], damping [N s/m]
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    mesh: Mesh,
    x: wp.array[wp.vec3],  # (n_vert,) [m] at detection
    # out
    impulse: wp.array[Impulse],  # (capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """For each contact: the impulse of its spring to the virtual surface over one step."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        f = distance(at, mesh, x)
        u = relative_velocity(at, v)
        h = dt[at.vert[0]]
        to = constraint[c]
        given = impulse_of_spring(f, spring, to.friction, h, u, at.normal, to)
        impulse[c] = given
        give(c, given, at, to, part)
