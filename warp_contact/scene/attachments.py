"""Attachments: points of a body that are held at points of another body, or of the world."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from warp_contact import checks
from warp_contact.data.tie_table import TieTable
from warp_contact.scene.body import Body
from warp_contact.scene.hinge_marks import marks_of
from warp_contact.scene.materials import Rigid
from warp_contact.scene.topology import HUGE

KINDS = "weld", "ball", "hinge", "slider"
OUTSIDE = -0.5  # weight of a point in the nearest tet, below which it is not of a body
THIN = 1e-3  # of their length: how far from a line the vertices of a weld lie at least
MOST = 256  # ties of attachments that hang together


@dataclass(frozen=True, eq=False)
class Attachment:
    """What ``Scene.attach`` makes.

    Attributes:
        index: its place in the scene
        label: its name, unique among the attachments of the scene
        kind: one of ``KINDS``
        a, b: the bodies; b is None for the world
        points: of b, or of the world, at the start [m], shape (n, 3)
        stiffness: of all points together [N/m]; None for a hard one
        breaking_force: above which it breaks [N]; None for never
        verts, weights: of the points, those of a, then those of b, shape (n, 8)
        along: weights that give the axis of a slider, of the vertices of b, shape (n, 8)
        axis: of a slider along the world, else 0, shape (3,)
    """

    index: int
    label: str
    kind: str
    a: Body
    b: Body | None
    points: np.ndarray = field(repr=False)
    stiffness: float | None
    breaking_force: float | None
    verts: np.ndarray = field(repr=False)
    weights: np.ndarray = field(repr=False)
    along: np.ndarray = field(repr=False)
    axis: np.ndarray = field(repr=False)


def make(index, label, a, b, kind, at, vertices, axis, stiffness, breaking_force) -> Attachment:
    """An attachment of bodies at their places; raises ValueError for what holds nothing."""
    checks.one_of(kind, KINDS, "kind")
    line = _axis(axis, kind)
    _check_pair(a, b)
    points, chosen = _points(a, b, kind, at, vertices, line)
    first = _within(a, points) if chosen is None else _of_vertices(chosen)
    second = None if b is None else _within(b, points)
    sites = first, second, points
    return hold(index, label, a, b, kind, sites, line, stiffness, breaking_force)


def hold(index, label, a, b, kind, sites, line, stiffness, breaking_force) -> Attachment:
    """An attachment of points that are known, at the same place or apart.

    ``sites`` are vertices and weights, of shape (n, 4) each, on a and, None for the world, on b,
    and the places of the latter [m], shape (n, 3). ``line`` is the direction of a slider or hinge.

    Raises:
        ValueError: it holds nothing, or a number is out of range
    """
    stiffness = None if stiffness is None else checks.positive(stiffness, "stiffness")
    if breaking_force is not None:
        breaking_force = checks.positive(breaking_force, "breaking_force")
    _check_pair(a, b)
    first, second, points = sites
    n = len(points)
    verts, weights, along = np.zeros((n, 8), dtype=int), np.zeros((n, 8)), np.zeros((n, 8))
    verts[:, :4], weights[:, :4] = first
    to_world = np.zeros(3)
    if b is not None:
        verts[:, 4:], own = second
        weights[:, 4:] = -own
        if kind == "slider":
            along[:, 4:] = _within(b, points + line)[1] - own
    elif kind == "slider":
        to_world = line
    _refuse_fixed(a, b, verts, weights)
    given = points, stiffness, breaking_force, verts, weights, along, to_world
    return Attachment(index, label, kind, a, b, *given)


def site_of(body: Body, given: dict, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and weights of points that are given by ``vertices``, in ``tets``, or by place.

    ``tets`` are those that the numbers mean, shape (m, 4); of each tet three ``coords``, the
    weights of its first vertices. ``points`` [m] are those of a rigid body, shape (n, 3).

    Raises:
        ValueError: there is no such vertex or tet
    """
    if "vertices" in given:
        return _of_vertices(checks.vertex_ids(given["vertices"], len(body.x), "vertices"))
    if "points" in given:
        return _within(body, checks.vectors(given["points"], len(given["points"]), "points", HUGE))
    n = len(given["tets"])
    chosen, coords = np.array(given["tets"]), checks.numbers(given["coords"], (n, 3), "coords")
    if not ((chosen >= 0) & (chosen < len(tets))).all():
        raise ValueError(f"tets {given['tets']}: body '{body.label}' has {len(tets)}")
    return tets[chosen], np.concatenate([coords, 1.0 - coords.sum(axis=1, keepdims=True)], axis=1)


def _check_pair(a: Body, b: Body | None) -> None:
    if b is not None and b.world != a.world:
        raise ValueError(f"bodies of worlds {a.world} and {b.world} do not meet")
    if b is a:
        raise ValueError("a body cannot be attached to itself")


def lay_out(attachments: Sequence[Attachment], bodies: Sequence[Body]) -> TieTable | None:
    """All attachments of a scene in one table; None without any.

    Raises:
        ValueError: too many points hang together
    """
    if not attachments:
        return None
    of_attachment = _clusters(attachments, bodies)
    order = np.argsort(of_attachment, kind="stable")
    chosen = [attachments[k] for k in order]
    sizes = np.array([len(a.points) for a in chosen])
    whose, cluster = np.repeat(order, sizes), np.repeat(of_attachment[order], sizes)
    number = np.bincount(cluster)
    if number.max() > MOST:
        k = int(number.argmax())
        names = ", ".join(f"'{a.label}'" for a in np.array(chosen)[of_attachment[order] == k][:3])
        together = f"{number[k]} points hang together, more than {MOST}"
        raise ValueError(f"attachment {names}: {together}; attach fewer vertices")
    start = np.concatenate([[0], np.cumsum([len(body.x) for body in bodies])])
    joined = {name: np.concatenate([getattr(a, name) for a in chosen]) for name in PARTS}
    soft = [1.0 / a.stiffness * len(a.points) if a.stiffness else 0.0 for a in chosen]
    return TieTable(
        labels=tuple(a.label for a in attachments),
        body=np.array([(a.a.index, a.b.index if a.b else -1) for a in attachments]),
        limit=np.array([a.breaking_force or np.inf for a in attachments]),
        kind=tuple(a.kind for a in attachments),
        **marks_of(attachments, start),
        attachment=whose,
        cluster=cluster,
        first=np.concatenate([[0], np.cumsum(number)]),
        vert=np.concatenate([_numbered(a, start) for a in chosen]),
        weight=joined["weights"],
        along=joined["along"],
        axis=np.repeat([a.axis for a in chosen], sizes, axis=0),
        point=joined["points"] * (joined["weights"][:, 4:] == 0.0).all(axis=1)[:, None],
        slides=np.repeat([a.kind == "slider" for a in chosen], sizes),
        to_world=np.repeat([a.b is None for a in chosen], sizes),
        compliance=np.repeat(soft, sizes),
    )


PARTS = "weights", "along", "points"


def _numbered(a: Attachment, start: np.ndarray) -> np.ndarray:
    """Vertices of the ties among those of all bodies; unused places repeat the first one."""
    first = start[a.a.index]
    both = np.repeat([first, start[a.b.index] if a.b else first], 4)
    used = (a.weights != 0.0) | (a.along != 0.0)
    return np.where(used, a.verts + both, a.verts[:, :1] + first)


def _clusters(attachments: Sequence[Attachment], bodies: Sequence[Body]) -> np.ndarray:
    """Number of the cluster of each attachment; bodies that cannot move join nothing."""
    root = np.arange(len(bodies) + len(attachments))

    def find(k: int) -> int:
        while root[k] != k:
            k = root[k]
        return k

    for k, attachment in enumerate(attachments):
        for body in (attachment.a, attachment.b):
            if body is not None and not body.fixed.all():
                root[find(body.index)] = find(len(bodies) + k)
    roots = [find(len(bodies) + k) for k in range(len(attachments))]
    return np.unique(roots, return_inverse=True)[1]


def _axis(axis, kind: str) -> np.ndarray:
    if kind in ("ball", "weld"):
        if axis is not None:
            raise checks.refuse("axis", axis, f"none for a {kind}")
        return np.zeros(3)
    line = checks.numbers(axis, (3,), "axis")
    length = float(np.linalg.norm(line))
    if length < checks.SMALLEST:
        raise checks.refuse("axis", axis, "numbers that are not all zero")
    return line / length


def _points(a: Body, b: Body | None, kind: str, at, vertices, line):
    """Points [m], shape (n, 3), and the vertices of a that they are, None where they are none."""
    if vertices is not None:
        if kind not in ("ball", "weld") or at is not None:
            raise checks.refuse("vertices", vertices, f"at=, a point, for a {kind}, or no at=")
        ids = checks.vertex_ids(vertices, len(a.x), f"vertices of body '{a.label}'")
        _check_number(kind, a.x[ids])
        return a.x[ids], ids
    stiff = [_is_rigid(body) for body in (a, b) if body is not None]
    if kind != "ball" and not all(stiff):
        soft = a if not _is_rigid(a) else b
        if kind == "weld":
            raise ValueError(f"body '{soft.label}' deforms: name its vertices, with it as a")
        raise ValueError(
            f"body '{soft.label}' deforms: a {kind} takes rigid bodies; weld one to it"
        )
    if at is None and kind == "weld":
        at = a.x.mean(axis=0)
    at = checks.numbers(at, (3,), "at", HUGE)
    if kind == "ball":
        return at[None], None
    size = 0.5 * np.ptp(a.mesh.vertices, axis=0).max()  # however it is turned
    if kind == "hinge":
        return at + size * np.outer([-1.0, 1.0], line), None
    if kind == "weld":  # corners of a tetrahedron: springs there have no torque
        corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]
        return at + size / np.sqrt(3.0) * np.array(corners), None
    beside = np.cross(line, np.eye(3)[np.abs(line).argmin()])
    beside /= np.linalg.norm(beside)
    return at + size * np.stack([-line, line, -beside, beside]), None  # nor tilts nor turns


def _check_number(kind: str, points: np.ndarray) -> None:
    if kind == "ball" and len(points) != 1:
        raise ValueError(f"a ball holds one vertex, not {len(points)}: a weld holds several")
    if kind == "weld":
        wide = len(points) >= 3
        if wide:
            size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
            wide = size[1] >= THIN * size[0]
        if not wide:
            text = f"three vertices or more that are not on a line, and has {len(points)}"
            raise ValueError(f"a weld needs {text}")


def _is_rigid(body: Body) -> bool:
    return isinstance(body.material, Rigid)


def _of_vertices(ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and weights of ties that are vertices themselves, shape (n, 4)."""
    return np.repeat(ids[:, None], 4, axis=1), np.tile([1.0, 0.0, 0.0, 0.0], (len(ids), 1))


def _within(body: Body, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices of a body, and their weights, that have points [m] in their midst, shape (n, 4)."""
    if _is_rigid(body):  # all of it moves as four of its vertices do
        ids = _spread(body.x)
        return np.tile(ids, (len(points), 1)), _weights(body.x[ids], points)
    verts, weights = np.zeros((len(points), 4), dtype=int), np.zeros((len(points), 4))
    corners = body.x[body.mesh.tets]
    for k, point in enumerate(points):
        found = _weights(corners, point)
        tet = int(found.min(axis=1).argmax())
        verts[k], weights[k] = body.mesh.tets[tet], found[tet]
        if weights[k].min() < OUTSIDE:
            where = np.array2string(point, precision=4)
            raise ValueError(f"point {where} is not in body '{body.label}': move one of the two")
    return verts, weights


def _weights(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Barycentric weights of points in tets, shape (n, 4)."""
    edges = np.swapaxes(corners[..., 1:, :] - corners[..., :1, :], -1, -2)
    others = np.linalg.solve(edges, (points - corners[..., 0, :])[..., None])[..., 0]
    return np.concatenate([1.0 - others.sum(axis=-1, keepdims=True), others], axis=-1)


def _spread(x: np.ndarray) -> np.ndarray:
    """Four vertices that are far from each other."""
    first = int(np.linalg.norm(x - x.mean(axis=0), axis=1).argmax())
    second = int(np.linalg.norm(x - x[first], axis=1).argmax())
    area = np.linalg.norm(np.cross(x - x[first], x[second] - x[first]), axis=1)
    third = int(area.argmax())
    normal = np.cross(x[second] - x[first], x[third] - x[first])
    return np.array([first, second, third, int(np.abs((x - x[first]) @ normal).argmax())])


def _refuse_fixed(a: Body, b: Body | None, verts: np.ndarray, weights: np.ndarray) -> None:
    """Raise ValueError where a tie has fixed vertices alone."""
    moves = ((weights[:, :4] != 0.0) & ~a.fixed[verts[:, :4]]).any(axis=1)
    if b is not None:
        moves |= ((weights[:, 4:] != 0.0) & ~b.fixed[verts[:, 4:]]).any(axis=1)
    if not moves.all():
        raise ValueError("all that it would hold is fixed")
