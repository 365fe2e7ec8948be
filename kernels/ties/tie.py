"""What a tie is: a point of a body that is held at a point of another one, or of the world.

    C = sum w_k x_k - a                 gap of eight weighted vertices, three numbers     [m]
    e = sum u_k x_k                     line along which the first point may slide        [m]

The first four vertices are of the body that is attached, with weights of sum 1, the other four of
the one that it is attached to, of sum -1; a tie to the world has none there and its point a. A
vertex has one weight, a point of a tet four. Weights beyond 0 and 1 are of a point outside its tet,
which moves with it. Impulses w_k p at the vertices have no sum, and no torque where C is 0.

A tie that slides is held across e alone. The point of the other body is that beside the first one:
w_k - s u_k takes the place of w_k, with s = C . e / e . e at the start of the step.

A soft tie is a spring of stiffness k: the impulse of a step from C_0 to C is

    p = -h k ((1 - q) C_0 + q C),   q = z / (1 + z),   z = h^2 k / m                    [N s]

with 1 / m of J G J^T of a tie, and k of all ties of its attachment in z. It loses a part z^2 / 2 of
its motion in a step where z << 1, and 1 - 1 / sqrt(1 + z) where it is stiff: as bodies do.

An attachment is one tie or several. Those that hang together by a body that can move are solved as
one: a cluster.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import RigidMotion, as_vec3d
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

vec8i = wp.types.vector(length=8, dtype=wp.int32)
vec8 = wp.types.vector(length=8, dtype=wp.float32)

IDLE = wp.constant(0)  # broken, or nothing of it moves
HELD = wp.constant(1)


@wp.struct
class Ties:
    """All ties, those of a cluster one behind the other."""

    vert: wp.array[vec8i]  # (n_tie,) unused places repeat the first vertex, with weight 0
    weight: wp.array[vec8]  # (n_tie,) w_k at rest
    along: wp.array[vec8]  # (n_tie,) u_k, 0 where it does not slide or is tied to the world
    axis: wp.array[wp.vec3]  # (n_tie,) [m] e of one that slides along the world, else 0
    slides: wp.array[int]  # (n_tie,) 1 where it slides
    to_world: wp.array[int]  # (n_tie,) 1 where it is tied to the world
    point: wp.array[wp.vec3]  # (n_tie,) [m] a; 0 between bodies
    compliance: wp.array[float]  # (n_tie,) [m/N] 1 / k, 0 for a hard one
    number: wp.array[int]  # (n_tie,) ties of its attachment
    attachment: wp.array[int]  # (n_tie,) whose it is
    cluster: wp.array[int]  # (n_tie,) its number
    first: wp.array[int]  # (n_cluster + 1,) first tie of each cluster
    block: wp.array[int]  # (n_cluster,) first block of its matrix
    broken: wp.array[int]  # (n_attachment,) 1 where it is broken
    now: wp.array[vec8]  # (n_tie,) w_k of this step
    at: wp.array[wp.vec3]  # (n_tie,) [m] a of this step
    line: wp.array[wp.vec3]  # (n_tie,) e at the start of the step, of length 1 [-]; 0 if it is held
    state: wp.array[int]  # (n_tie,) HELD or IDLE in this step
    soft: wp.array[wp.float64]  # (n_tie,) [1/kg] 1 / (h^2 k q), 0 for a hard one
    before: wp.array[wp.vec3d]  # (n_tie,) [m] C_0 (1 - q) / q, 0 for a hard one
    pull: wp.array[wp.vec3d]  # (n_tie,) [kg y] what the last solve added
    since: wp.array[wp.vec3d]  # (n_tie,) [kg y] sum of them since the sweeps began
    held: wp.array[wp.vec3d]  # (n_tie,) [N s] impulse of the step, on the first body
    moved: wp.array[int]  # (n_cluster,) 1 where anything changed its velocities
    matrix: wp.array[wp.mat33d]  # (n_block,) [1/kg] blocks below the diagonal, see matrix.py
    added: wp.array[wp.vec3d]  # (n_tie,) [1/kg] what is added to its diagonal
    asked: wp.array[wp.vec3d]  # (n_tie,) [y] r of a cluster whose matrix is singular
    singular: wp.array[int]  # (n_cluster,) 1 where ties say what others say


@wp.struct
class Tied:
    """The vertices that have ties, and what these add at them."""

    start: wp.array[int]  # (n_body + 1,) first of each body in ``vert``
    vert: wp.array[int]  # (n_tied,) ascending
    first: wp.array[int]  # (n_tied + 1,) first entry of each
    entry: wp.array[int]  # (n_entry,) 8 t + k for vertex k of tie t
    p: wp.array[wp.vec3]  # (n_vert,) [kg y] what ties add at each vertex, 0 without ties
    z: wp.array[wp.vec3]  # (n_vert,) [kg y] the same, R^T p; p where masses are lumped
    busy: wp.array[int]  # (n_body,) 1 where they add anything
    motion: RigidMotion  # of each body by it


@wp.func
def gap(t: int, weight: vec8, point: wp.vec3, ties: Ties, x: wp.array[wp.vec3]) -> wp.vec3d:
    """C of tie t [m], relative to one of its points: float32 is coarse far from the origin."""
    v = ties.vert[t]
    origin = x[v[0]]
    if ties.to_world[t] != 0:
        origin = point
    c = wp.vec3d()
    for k in range(8):
        c += wp.float64(weight[k]) * as_vec3d(x[v[k]] - origin)
    return c


@wp.func
def direction(t: int, ties: Ties, x: wp.array[wp.vec3]) -> wp.vec3d:
    """Unit vector along e of tie t; 0 where it does not slide."""
    if ties.slides[t] == 0:
        return wp.vec3d()
    e = as_vec3d(ties.axis[t])
    v = ties.vert[t]
    u = ties.along[t]
    for k in range(4, 8):
        e += wp.float64(u[k]) * as_vec3d(x[v[k]] - x[v[4]])
    return wp.normalize(e)


@wp.func
def across(c: wp.vec3d, e: wp.vec3d) -> wp.vec3d:
    """The part of a vector across a unit vector, or all of it where that is 0."""
    return c - wp.dot(c, e) * e


@wp.func
def change(t: int, ties: Ties, y: wp.array[wp.vec3], before: wp.array[wp.vec3]) -> wp.vec3d:
    """How much tie t opens when its vertices go from ``before`` to y; positions or velocities."""
    v = ties.vert[t]
    w = ties.now[t]
    c = wp.vec3d()
    for k in range(8):
        c += wp.float64(w[k]) * as_vec3d(y[v[k]] - before[v[k]])
    return across(c, as_vec3d(ties.line[t]))


@wp.func
def speed(t: int, ties: Ties, v: wp.array[wp.vec3]) -> wp.vec3d:
    """Velocity by which tie t opens [m/s]."""
    i = ties.vert[t]
    w = ties.now[t]
    c = wp.vec3d()
    for k in range(8):
        c += wp.float64(w[k]) * as_vec3d(v[i[k]])
    return across(c, as_vec3d(ties.line[t]))
