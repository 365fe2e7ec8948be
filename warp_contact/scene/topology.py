"""What must hold for the tets of a body, and the surface that follows from them.

A tet (a, b, c, d) is positive when (b - a) x (c - a) points to d. Its outward faces are then
(b, c, d), (a, d, c), (a, b, d), (a, c, b).
"""

import numpy as np

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])  # outward, opposite to corner 0..3
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
HUGE = 1e12  # beyond it a position [m] has no place in float32
MOST = 2**29  # vertices or tets: corners of tets are counted in int32
FLAT = 1e-7  # |volume| over longest edge^3 [-]: below it a tet has no shape in float32


class MeshError(ValueError):
    """A mesh that cannot be simulated; the message names the element."""


def unique(key: np.ndarray) -> np.ndarray:
    """Unique values, ascending: one sort, several times faster than the hashing of np.unique."""
    key = np.sort(key)
    return key[np.concatenate([[True], key[1:] != key[:-1]])]


def signed_volumes(x: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Volume of each tet [m^3], negative where it is mirrored."""
    a, b, c, d = (x[tets[:, k]] for k in range(4))
    return np.einsum("mi,mi->m", np.cross(b - a, c - a), d - a) / 6.0


def as_arrays(vertices, tets) -> tuple[np.ndarray, np.ndarray]:
    """Own copies, with the types, the shape and the range checked."""
    try:
        x, raw = np.asarray(vertices), np.asarray(tets)
    except (TypeError, ValueError) as error:
        raise MeshError(f"vertices or tets are not arrays of numbers: {error}") from error
    if x.dtype.kind not in "fiu":
        raise MeshError(f"vertices have type {x.dtype}, expected real numbers")
    if x.ndim != 2 or x.shape[1] != 3 or not 0 < len(x) <= MOST:
        raise MeshError(f"vertices have shape {x.shape}, expected (n, 3) with n > 0")
    if raw.ndim != 2 or raw.shape[1] != 4 or not 0 < len(raw) <= MOST:
        raise MeshError(f"tets have shape {raw.shape}, expected (m, 4) with m > 0")
    if raw.dtype.kind not in "iu":
        raise MeshError(f"tets have type {raw.dtype}, expected integers")
    bad = np.flatnonzero(((raw < 0) | (raw >= len(x))).any(axis=1))
    if len(bad):
        raise MeshError(f"tet {bad[0]} is {raw[bad[0]].tolist()}: index outside 0..{len(x) - 1}")
    return x.astype(np.float64), raw.astype(np.int32)


def check_elements(x: np.ndarray, tets: np.ndarray) -> None:
    """Check each vertex and each tet by itself."""
    bad = np.flatnonzero(~(np.abs(x) < HUGE).all(axis=1))
    if len(bad):
        raise MeshError(f"vertex {bad[0]} is not finite or beyond {HUGE:g} m: {x[bad[0]].tolist()}")
    bad = np.flatnonzero((tets[:, EDGES[:, 0]] == tets[:, EDGES[:, 1]]).any(axis=1))
    if len(bad):
        raise MeshError(f"tet {bad[0]} repeats a vertex: {tets[bad[0]].tolist()}")
    bad = np.flatnonzero(np.bincount(tets.ravel(), minlength=len(x)) == 0)
    if len(bad):
        raise MeshError(f"vertex {bad[0]} belongs to no tet ({len(bad)} such vertices)")
    l2 = np.zeros(len(tets))
    for p, q in EDGES:
        edge = x[tets[:, q]] - x[tets[:, p]]
        np.maximum(l2, np.einsum("mi,mi->m", edge, edge), out=l2)
    bad = np.flatnonzero(np.abs(signed_volumes(x, tets)) <= FLAT * l2**1.5)
    if len(bad):
        raise MeshError(f"tet {bad[0]} has no volume: {tets[bad[0]].tolist()}")


def boundary(tets: np.ndarray, n: int) -> np.ndarray:
    """The faces that belong to one tet only."""
    face = tets[:, FACES].reshape(-1, 3)
    key = np.sort(face, axis=1).astype(np.int64)
    pair = key[:, 0] * n + key[:, 1]
    if n > 2**21:  # n^3 would not fit 63 bits
        pair = np.searchsorted(unique(pair), pair)
    key = pair * n + key[:, 2]
    order = np.argsort(key, kind="stable")
    same = key[order[1:]] == key[order[:-1]]
    bad = np.flatnonzero(same[1:] & same[:-1])
    if len(bad):
        raise _shared_face_error(tets, face, order[bad[0] : bad[0] + 3])
    first, second = order[:-1][same], order[1:][same]
    a, b = face[first], face[second]
    turn = np.argmax(b == a[:, :1], axis=1)  # where b continues from a's first vertex
    bad = np.flatnonzero(b[np.arange(len(b)), (turn + 1) % 3] == a[:, 1])
    if len(bad):
        raise _shared_face_error(tets, face, [first[bad[0]], second[bad[0]]])
    inner = np.zeros(len(face), dtype=bool)
    inner[first] = inner[second] = True
    return face[~inner]


def _shared_face_error(tets: np.ndarray, face: np.ndarray, ids) -> MeshError:
    owner = [int(i) // 4 for i in ids]
    for k, a in enumerate(owner):
        for b in owner[k + 1 :]:
            if set(tets[a].tolist()) == set(tets[b].tolist()):
                return MeshError(f"tets {a} and {b} are the same: {tets[a].tolist()}")
    vertices = sorted(face[ids[0]].tolist())
    if len(owner) > 2:
        return MeshError(f"face {vertices} is shared by more than two tets: {owner}")
    return MeshError(f"tets {owner[0]} and {owner[1]} overlap: same side of face {vertices}")


def pair_edges(surface: np.ndarray, n: int) -> np.ndarray:
    """Each surface edge with its two triangles."""
    p, q = surface.ravel(), np.roll(surface, -1, axis=1).ravel()
    low, high = np.minimum(p, q).astype(np.int64), np.maximum(p, q)
    key = low * n + high
    order = np.lexsort((p > q, key))  # the triangle with p -> q, p < q, comes first
    key = key[order]
    count = np.diff(np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1], [True]])))
    if (count != 2).any():
        k = int(np.argmax(count != 2))
        at = order[count[:k].sum()]
        edge, number = [int(low[at]), int(high[at])], int(count[k])
        raise MeshError(f"surface edge {edge} is not manifold: {number} triangles meet there")
    t = order.reshape(-1, 2) // 3
    at = order[::2]
    return np.stack([low[at], high[at], t[:, 0], t[:, 1]], axis=1).astype(np.int32)


def check_fans(surface: np.ndarray, edges: np.ndarray) -> None:
    """The triangles of each vertex form one closed fan."""
    n_tri = len(surface)
    start = np.arange(3 * n_tri).reshape(-1, 3)  # half-edge 3 t + k leaves corner k of t
    twin = np.empty(3 * n_tri, dtype=np.int64)
    p, q, t1, t2 = edges.T
    ahead = start[t1, np.argmax(surface[t1] == p[:, None], axis=1)]
    back = start[t2, np.argmax(surface[t2] == q[:, None], axis=1)]
    twin[ahead], twin[back] = back, ahead
    jump = twin // 3 * 3 + (twin + 1) % 3  # the next corner about the same vertex
    label = np.arange(3 * n_tri)
    vertex = surface.ravel()
    for _ in range(int(np.bincount(vertex).max()).bit_length()):
        label = np.minimum(label, label[jump])
        jump = jump[jump]
    low = np.full(int(vertex.max()) + 1, 3 * n_tri)
    np.minimum.at(low, vertex, label)
    bad = np.flatnonzero(label != low[vertex])
    if len(bad):
        v = int(vertex[bad].min())
        raise MeshError(f"surface vertex {v} is not manifold: its triangles form several fans")


def morton_codes(x: np.ndarray) -> np.ndarray:
    """Place of each point along a Z-order curve through their box, shape (n,), uint64.

    The bits of the three coordinates in turns (Morton 1966), 21 of each.
    """
    low, size = x.min(axis=0), np.ptp(x, axis=0).max()
    cell = ((x - low) / (size or 1.0) * (2**21 - 1)).astype(np.uint64)
    code = np.zeros(len(x), dtype=np.uint64)
    for bit in range(21):
        for axis in range(3):
            one = (cell[:, axis] >> np.uint64(bit)) & np.uint64(1)
            code |= one << np.uint64(3 * bit + axis)
    return code
