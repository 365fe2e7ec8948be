"""Bodies that take implicit steps: their present shape, as far as their mobility depends on it.

    R_i = polar part of F_i,  F_i = sum of volume times deformation gradient of its tets     [m^3]

R_i turns the rest shape into the present one around vertex i.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LUMPED = wp.constant(0)  # takes explicit steps, or is fixed as a whole
FREE = wp.constant(1)
HELD = wp.constant(2)  # some of its vertices are fixed
RIGID = wp.constant(3)

FOUR = wp.constant(4)  # vertices whose answers are summed together: vectors fit into a CPU's
vec12 = wp.types.vector(length=12, dtype=float)
mat3x12 = wp.types.matrix(shape=(3, 12), dtype=float)

UPRIGHT = wp.constant(0.05)  # determinant, of a gradient of size 1: above it Newton is fast
ROUNDS = wp.constant(8)
EXACT = wp.constant(1.0e-4)  # a last change this small leaves an error of its square


@wp.struct
class Solids:
    """The bodies that are rigid, see masses.py. All arrays are empty where there is none."""

    inertia: wp.array[wp.mat33d]  # (n_body,) [kg m^2] I_0
    inverse: wp.array[wp.mat33d]  # (n_body,) [1/(kg m^2)] of I_0
    middle: wp.array[wp.vec3d]  # (n_body,) [m] q_m
    spread: wp.array[wp.mat33d]  # (n_body,) [1/(kg m^2)] F
    inverse_of_vertices: wp.array[wp.mat33d]  # (n_body,) [1/(kg m^2)] of J_0
    at: wp.array[wp.vec3d]  # (n_body,) [m] x_m
    turn: wp.array[wp.mat33d]  # (n_body,) R
    v: wp.array[wp.vec3d]  # (n_body,) [m/s] v_c
    w: wp.array[wp.vec3d]  # (n_body,) [1/s]


@wp.struct
class Implicit:
    """What kernels know of the bodies that take implicit steps."""

    h: wp.array[float]  # (n_body,) [s] length of the step that its blocks belong to
    kind: wp.array[int]  # (n_body,)
    awake: wp.array[int]  # (n_body,) 0 asleep
    body_vert: wp.array[int]  # (n_body + 1,)
    vert_body: wp.array[int]  # (n_vert,)
    mass: wp.array[float]  # (n_vert,) [kg]; weights of the vertices of a rigid body
    inv_mass: wp.array[float]  # (n_vert,) [1/kg], 0 for a fixed vertex
    first: wp.array[int]  # (n_body,) first block of its shape, for its step
    block: wp.array[mat3x12]  # (n_block,) B_ji of the shapes, by rows i, four at once [1/kg]
    norm: wp.array[wp.vec4]  # (n_block,) spectral norms of (A0^-1)_ij [1/kg]
    rest: wp.array[wp.vec3]  # (n_vert,) [m] from the centre of mass at rest, as the shape was made
    rest_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)] the same, inverted
    placed: wp.array[wp.mat33]  # (n_body,) rotation of its shape when it was placed
    turn: wp.array[wp.mat33]  # (n_vert,) R_i
    centre: wp.array[wp.vec3]  # (n_body,) [m] of mass
    inv_total: wp.array[float]  # (n_body,) [1/kg] of its mass; 0 for one that is held or lumped
    inv_inertia: wp.array[wp.mat33]  # (n_body,) [1/(kg m^2)]; as inv_total
    force: wp.array[wp.vec3]  # (n_body,) [N] from outside
    torque: wp.array[wp.vec3]  # (n_body,) [N m] from outside
    solids: Solids


@wp.struct
class RigidMotion:
    """The rigid motion of each body."""

    v: wp.array[wp.vec3]  # (n_body,) [m/s] of its centre
    w: wp.array[wp.vec3]  # (n_body,) [1/s]


@wp.func
def moves(b: int, d: Implicit) -> bool:
    """Whether a body takes implicit steps, and is awake."""
    return d.kind[b] != LUMPED and d.awake[b] != 0


@wp.func
def floats(b: int, d: Implicit) -> bool:
    """Whether a body has no fixed vertices: its rigid motion is its own."""
    return d.kind[b] == FREE or d.kind[b] == RIGID


@wp.func
def acts(p: wp.vec3) -> bool:
    """Whether it is not 0; the square of what acts on a body of a micrometre would be."""
    return p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0


@wp.func
def is_pushed(b: int, d: Implicit) -> bool:
    """Whether a force or torque from outside acts on a lumped body, and it is awake."""
    if d.kind[b] != LUMPED or d.awake[b] == 0:
        return False
    return acts(d.force[b]) or acts(d.torque[b])


@wp.func
def deforms(b: int, d: Implicit) -> bool:
    """Whether a body takes implicit steps, and is not rigid."""
    return moves(b, d) and d.kind[b] != RIGID


@wp.func
def block_of(i: int, d: Implicit) -> int:
    """First block of the four vertices to which vertex i belongs; one follows for each vertex."""
    b = d.vert_body[i]
    first = d.body_vert[b]
    return d.first[b] + (i - first) // FOUR * (d.body_vert[b + 1] - first)


@wp.func
def rigid_at(i: int, b: int, x: wp.vec3, d: Implicit, motion: RigidMotion) -> wp.vec3:
    """Velocity [m/s] of the rigid motion of body b at its vertex i."""
    return motion.v[b] + wp.cross(motion.w[b], x - d.centre[b])


@wp.func
def acceleration(i: int, b: int, x: wp.vec3, d: Implicit) -> wp.vec3:
    """By the force and torque from outside, at vertex i of body b [m/s^2]."""
    return d.inv_total[b] * d.force[b] + wp.cross(d.inv_inertia[b] * d.torque[b], x - d.centre[b])


@wp.func
def as_vec3d(a: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.float64(a[0]), wp.float64(a[1]), wp.float64(a[2]))


@wp.func
def as_vec3(a: wp.vec3d) -> wp.vec3:
    return wp.vec3(wp.float32(a[0]), wp.float32(a[1]), wp.float32(a[2]))


@wp.func
def as_mat33d(a: wp.mat33) -> wp.mat33d:
    out = wp.mat33d()
    for k in range(3):
        for l in range(3):
            out[k, l] = wp.float64(a[k, l])
    return out


@wp.func
def as_mat33(a: wp.mat33d) -> wp.mat33:
    out = wp.mat33(0.0)
    for k in range(3):
        for l in range(3):
            out[k, l] = wp.float32(a[k, l])
    return out


@wp.func
def rotation(a: wp.vec3d) -> wp.mat33d:
    """Rotation by the vector a (Rodrigues)."""
    one = wp.float64(1.0)
    sq = wp.dot(a, a)
    s = one - sq / wp.float64(6.0)
    c = wp.float64(0.5) - sq / wp.float64(24.0)
    if sq > wp.float64(1.0e-4):
        t = wp.sqrt(sq)
        s = wp.sin(t) / t
        c = (one - wp.cos(t)) / sq
    k = wp.skew(a)
    return wp.identity(n=3, dtype=wp.float64) + s * k + c * (k @ k)


@wp.kernel
def find_gradients(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    volume: wp.array[float],  # (n_tet,) [m^3]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    gradient: wp.array[wp.mat33],  # (n_tet,) [m^3]
):
    """One thread per tet: its deformation gradient times its volume."""
    q = wp.tid()
    if deforms(d.vert_body[tets[q][0]], d):
        gradient[q] = volume[q] * element.rate(q, tets, pose, x)


@wp.func
def polar(f: wp.mat33) -> wp.mat33:
    """The rotation nearest to f."""
    size = wp.sqrt(wp.ddot(f, f) / 3.0)
    r = f / size
    if wp.determinant(r) > UPRIGHT:  # Newton's iteration (Higham 1986)
        for _ in range(ROUNDS):
            other = wp.transpose(wp.inverse(r))
            off = 0.5 * (other - r)
            r += off
            if wp.ddot(off, off) < EXACT * EXACT:
                return r
    u = wp.mat33()
    s = wp.vec3()
    v = wp.mat33()
    wp.svd3(f, u, s, v)
    r = u @ wp.transpose(v)
    if wp.determinant(r) < 0.0:  # the smallest singular value is the last
        flip = wp.diag(wp.vec3(1.0, 1.0, -1.0))
        r = u @ flip @ wp.transpose(v)
    return r


@wp.kernel
def find_turns(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    gradient: wp.array[wp.mat33],  # (n_tet,) [m^3]
    # in, out
    d: Implicit,
):
    """One thread per vertex: R_i."""
    i = wp.tid()
    b = d.vert_body[i]
    if not deforms(b, d):
        return
    f = wp.mat33(0.0)
    for k in range(vt_start[i], vt_start[i + 1]):
        f += gradient[vt_corner[k] // 4]
    d.turn[i] = polar(f) @ d.placed[b]
