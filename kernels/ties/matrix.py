"""The matrix of the ties of a cluster, and its factors.

    K = J G J^T + 1 / (h^2 k q),   J v = sum w_k v_k of each tie                        [1/kg]
    K = L L^T                                                       (Cholesky)

G is the mobility of implicit/mobility.py as touched.py has it, without P: K is as good as J G J^T
where bodies are little strained, and what is left is solved again. It has blocks of 3 x 3. Some
ties say what others say, such as the length between two points of a rigid body; there K is
singular, and E, a millionth of its diagonal, is added, which costs another round. What they say
against each other is rounding, of which a millionth would make huge impulses: there

    p = (K + E)^-1 (r - E (K + E)^-1 r)

leaves it out. Where a tie slides, and where it is idle, a row keeps its diagonal alone.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    FOUR,
    LUMPED,
    RIGID,
    Implicit,
    as_mat33d,
    as_vec3d,
    block_of,
)
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.tie import HELD, IDLE, Ties, across, direction, gap

wp.set_module_options(OPTIONS)

ADDED = wp.constant(wp.float64(1.0e-6))  # part of the diagonal
GOLDEN = wp.constant(wp.float64(0.6180339887498949))
SINGULAR = wp.constant(wp.float64(1.0e-5))  # of s, which is left where K is singular


@wp.func
def block33(i: int, j: int, d: Implicit) -> wp.mat33:
    """B_ij of two vertices of a body that deforms [1/kg]."""
    first = d.body_vert[d.vert_body[i]]
    rows = d.block[block_of(i, d) - first + j]
    at = 3 * ((i - first) % FOUR)
    out = wp.mat33(0.0)
    for k in range(3):
        for l in range(3):
            out[k, l] = rows[l, at + k]
    return out


@wp.func
def response(i: int, j: int, x: wp.array[wp.vec3], d: Implicit) -> wp.mat33d:
    """G_ij: velocity of vertex i by an impulse on vertex j [1/kg]; 0 between two bodies."""
    b = d.vert_body[i]
    none = wp.mat33d()
    if b != d.vert_body[j] or d.awake[b] == 0 or d.inv_mass[i] == 0.0 or d.inv_mass[j] == 0.0:
        return none
    one = wp.identity(n=3, dtype=wp.float64)
    if d.kind[b] == LUMPED:
        if i == j:
            return wp.float64(d.inv_mass[i]) * one
        return none
    spin = wp.skew(as_vec3d(x[i] - d.centre[b])) @ as_mat33d(d.inv_inertia[b])
    g = wp.float64(d.inv_total[b]) * one - spin @ wp.skew(as_vec3d(x[j] - d.centre[b]))
    if d.kind[b] != RIGID:
        g += as_mat33d(d.turn[i] @ block33(i, j, d) @ wp.transpose(d.turn[j]))
    return g


@wp.func
def entry(s: int, t: int, ties: Ties, x: wp.array[wp.vec3], d: Implicit) -> wp.mat33d:
    """Block of ties s and t of J G J^T [1/kg]."""
    v = ties.vert[s]
    u = ties.vert[t]
    a = ties.now[s]
    b = ties.now[t]
    sum = wp.mat33d()
    corners = int(8)  # a variable: 64 copies of what follows would take minutes to compile for CUDA
    for k in range(corners):
        for l in range(corners):
            w = wp.float64(a[k]) * wp.float64(b[l])  # exact: K stays positive
            if w != wp.float64(0.0):
                sum += w * response(v[k], u[l], x, d)
    return sum


@wp.func
def held_across(e: wp.vec3) -> wp.mat33d:
    """Projection across a unit vector; the identity where it is 0."""
    c = as_vec3d(e)
    return wp.identity(n=3, dtype=wp.float64) - wp.outer(c, c)


@wp.kernel
def begin_ties(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    ties: Ties,
):
    """One thread per tie: what it is in the step that begins at x."""
    t = wp.tid()
    h = wp.float64(dt[ties.vert[t][0]])
    none = wp.float64(0.0)
    w = ties.weight[t]
    e = direction(t, ties, x)
    s = wp.float32(wp.dot(gap(t, w, ties.point[t], ties, x), e))
    u = ties.along[t]
    for k in range(4, 8):
        w[k] = w[k] - s * u[k]
    ties.now[t] = w
    ties.line[t] = wp.vec3(wp.float32(e[0]), wp.float32(e[1]), wp.float32(e[2]))
    ties.at[t] = ties.point[t] + s * ties.axis[t]
    ties.held[t] = wp.vec3d()
    ties.since[t] = wp.vec3d()
    ties.moved[ties.cluster[t]] = 1
    ties.state[t] = IDLE
    ties.soft[t] = none
    ties.before[t] = wp.vec3d()
    if ties.broken[ties.attachment[t]] == 0 and h != none:
        g = wp.trace(entry(t, t, ties, x, d)) / wp.float64(3.0)
        if g > none:
            ties.state[t] = HELD
            soft = wp.float64(ties.compliance[t]) / (h * h)
            if soft > none:
                z = g / soft * wp.float64(ties.number[t])
                q = z / (wp.float64(1.0) + z)
                ties.soft[t] = soft / q
                c = across(gap(t, w, ties.at[t], ties, x), e)
                ties.before[t] = c * (wp.float64(1.0) - q) / q


@wp.kernel
def assemble(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    ties: Ties,
):
    """One thread per tie: its row of blocks, up to the diagonal."""
    s = wp.tid()
    c = ties.cluster[s]
    first = ties.first[c]
    row = ties.block[c] + (s - first) * (ties.first[c + 1] - first)
    own = held_across(ties.line[s])
    for t in range(first, s + 1):
        k = wp.mat33d()
        if ties.state[s] == HELD and ties.state[t] == HELD:
            k = own @ entry(s, t, ties, x, d) @ held_across(ties.line[t])
        if s == t:
            one = wp.identity(n=3, dtype=wp.float64)
            if ties.state[s] == HELD:
                e = as_vec3d(ties.line[s])
                k += ties.soft[s] * one + wp.trace(k) * wp.outer(e, e)
            else:
                k = one
        ties.matrix[row + t - first] = k


@wp.func
def lower(a: wp.mat33d, least: wp.vec3d) -> wp.mat33d:
    """Inverse of L, L L^T = a of a diagonal block; a pivot is no less than ``least``."""
    l = wp.mat33d()
    for i in range(3):
        for j in range(i + 1):
            s = wp.float64(0.5) * (a[i, j] + a[j, i])
            for k in range(j):
                s -= l[i, k] * l[j, k]
            if i == j:
                l[i, i] = wp.sqrt(wp.max(s, least[i]))
            else:
                l[i, j] = s / l[j, j]
    return wp.inverse(l)


@wp.kernel
def factorise(
    # in, out
    ties: Ties,
):
    """One thread per cluster: L in place of K; of its diagonal blocks the inverse."""
    c = wp.tid()
    first = ties.block[c]
    n = ties.first[c + 1] - ties.first[c]
    for i in range(n):
        row = first + i * n
        for j in range(i + 1):
            other = first + j * n
            s = ties.matrix[row + j]
            least = wp.vec3d(s[0, 0], s[1, 1], s[2, 2]) * ADDED
            for k in range(j):
                s -= ties.matrix[row + k] @ wp.transpose(ties.matrix[other + k])
            if i == j:
                l = lower(s + wp.diag(least), least)
                ties.matrix[row + j] = l
                ties.added[ties.first[c] + i] = least
            else:
                ties.matrix[row + j] = s @ wp.transpose(ties.matrix[other + j])


@wp.func
def substitute(c: int, ties: Ties):
    """(K + E)^-1 r in place of r in the pulls of cluster c."""
    first = ties.first[c]
    n = ties.first[c + 1] - first
    for i in range(n):
        row = ties.block[c] + i * n
        s = ties.pull[first + i]
        for j in range(i):
            s -= ties.matrix[row + j] * ties.pull[first + j]
        ties.pull[first + i] = ties.matrix[row + i] * s
    for k in range(n):
        i = n - 1 - k
        s = ties.pull[first + i]
        for j in range(i + 1, n):
            s -= wp.transpose(ties.matrix[ties.block[c] + j * n + i]) * ties.pull[first + j]
        ties.pull[first + i] = wp.transpose(ties.matrix[ties.block[c] + i * n + i]) * s


@wp.kernel
def find_singular(
    # in, out
    ties: Ties,
):
    """One thread per cluster: whether K is singular, from (K + E)^-1 E (K + E)^-1 E s.

    What a singular K leaves of s stays as it is, all else becomes 1e-6 of it or less. The numbers s
    are of no direction that ties have by symmetry. One pivot of L would not do: it may be large
    where that of another tie is not yet small.
    """
    c = wp.tid()
    first = ties.first[c]
    for t in range(first, ties.first[c + 1]):
        for k in range(3):
            s = GOLDEN * wp.float64(3 * (t - first) + k)
            ties.pull[t][k] = s - wp.floor(s) - wp.float64(0.5)
    twice = int(2)  # a variable: two copies of what follows would take longer to compile
    for _ in range(twice):
        for t in range(first, ties.first[c + 1]):
            ties.pull[t] = wp.cw_mul(ties.added[t], ties.pull[t])
        substitute(c, ties)
    ties.singular[c] = 0
    for t in range(first, ties.first[c + 1]):
        if wp.length(ties.pull[t]) > SINGULAR:
            ties.singular[c] = 1
