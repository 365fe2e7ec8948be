"""depth.py: consistent penetration depths, contact triangles, edges across bodies."""

from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, TetMesh, box, sphere
from warp_contact.kernels.narrow_phase import shallow
from warp_contact.scene.scene import rotation_matrix
from warp_contact.step import depth, narrow_phase

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def penetrations(work) -> dict[tuple[int, int], tuple[int, float, np.ndarray]]:
    n = int(work.contacts.n_vertex.numpy()[0])
    p = work.narrow_phase.penetration.numpy()[:n]
    fields = ("vert", "body", "layer", "depth", "direction")
    rows = zip(*(p[name] for name in fields), strict=True)
    return {(int(i), int(b)): (int(layer), float(d), r) for i, b, layer, d, r in rows}


def dipped(jittered, turn=(0.0, 0.0, 0.0, 1.0), shift=(0.0, 0.0, 0.0)) -> Scene:
    """A jittered block, four cells of 0.25 high, 0.6 deep in the flat top of a wider block."""
    scene = Scene()
    rotate = rotation_matrix(turn)
    for mesh, height in ((box((3.0, 3.0, 1.0), (3, 3, 1)), -0.5), (jittered(1.0, 4), -0.1)):
        scene.add_body(mesh, RUBBER, rotate @ (0.0, 0.0, height) + shift, turn)
    return scene


def test_depth_is_exact_under_a_flat_side_on_every_layer(stages, find_contacts, jittered):
    model, state, work = stages(dipped(jittered))
    find_contacts(model, work, state.x)
    x = state.x.numpy()
    layers = []
    for (i, body), (layer, d, r) in penetrations(work).items():
        if body == 0:
            layers.append(layer)
            # Ten roundings of coordinates of order 1.
            assert d == pytest.approx(-x[i, 2], abs=1e-6)
            np.testing.assert_allclose(r, [0.0, 0.0, 1.0], atol=1e-6)
    # Nine lie inside the lower side; what lies at its rim may look along, and follows them.
    assert len(layers) >= 2 * 25 and layers.count(0) >= 9 and max(layers) >= 1


def test_depth_and_direction_turn_with_the_frame(rng, stages, find_contacts, turned):
    scenes = []
    places = rng.uniform(-0.1, 0.1, (2, 3))
    places[1, 2] += 0.65
    turn, shift = turned(), rng.uniform(-2.0, 2.0, 3)
    for q, by in (((0.0, 0.0, 0.0, 1.0), np.zeros(3)), (turn, shift)):
        scene = Scene()
        for place in places:
            scene.add_body(sphere(0.5, 147), RUBBER, rotation_matrix(q) @ place + by, q)
        scenes.append(scene)
    found = [(find_contacts(m, w, s.x), penetrations(w)) for m, s, w in map(stages, scenes)]
    (one, plain), (two, rotated) = found
    assert plain.keys() == rotated.keys() and len(plain) > 10
    r = rotation_matrix(turn)
    rows = [np.hstack([*p[:2], r @ p[2], *rotated[k]]) for k, p in plain.items()]
    off = np.abs(np.array(rows) @ np.vstack([np.eye(5), -np.eye(5)]))
    # Coordinates of order 3 round to 2e-7; weights 1/d^2 of edges very near enlarge it. Where an
    # edge crosses between two triangles, rounding says whose normal counts: 1 draw in 20.
    far = (off > (0.0, 1e-4, 5e-3, 5e-3, 5e-3)).any(axis=1)
    assert far.sum() <= 2 and (off <= (0.0, 0.02, 0.3, 0.3, 0.3)).all()
    np.testing.assert_allclose(one.depth, two.depth, atol=0.02)


def test_an_enclosed_body_is_pushed_to_the_nearest_side(stages, find_contacts, jittered):
    scene = Scene()
    scene.add_body(box(2.0, 4), RUBBER)
    scene.add_body(jittered(0.3, 2), RUBBER, (0.2, 0.1, 0.6))
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x)
    x = state.x.numpy()
    inner = np.flatnonzero((model.vert_body.numpy() == 1) & (model.on_surface.numpy() == 1))
    used = c.depth > 0.0
    np.testing.assert_array_equal(c.vert[used, 0], inner)
    # Distances of order 1 in float32.
    np.testing.assert_allclose(c.depth[used], 1.0 - x[inner, 2], atol=1e-6)
    # The triangle beside may be as near in float32: the direction is off by sqrt(2 eps) then.
    np.testing.assert_allclose(c.normal[used], [[0.0, 0.0, 1.0]] * len(inner), atol=5e-4)


def test_contact_weights_sum_to_zero_and_directions_are_unit(
    rng, stages, find_contacts, jittered, turned
):
    scene = Scene()
    for place in rng.uniform(-0.3, 0.3, (3, 3)):
        scene.add_body(jittered(1.0, 3), RUBBER, place, turned())
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x, edges=True)
    used = (c.coef != 0.0).any(axis=1)
    on_surface = model.on_surface.numpy()
    assert used.sum() > 20
    # A few roundings of numbers of order 1.
    np.testing.assert_allclose(c.coef[used, :2].sum(axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(c.coef[used].sum(axis=1), 0.0, atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(c.normal[used], axis=1), 1.0, atol=1e-6)
    assert (c.depth >= -2e-3 * model.body_edge.numpy().max()).all()  # the speculative margin
    assert on_surface[c.vert[used]].all()
    owner = model.vert_body.numpy()[c.vert[used]]
    np.testing.assert_array_equal(owner[:, 0], c.pair[used, 0])
    np.testing.assert_array_equal(owner[:, 2:], np.repeat(c.pair[used, 1:], 3, axis=1))
    assert not (c.coef[~used] != 0.0).any()


def test_a_contact_point_lies_along_the_direction_at_the_depth(stages, find_contacts):
    scene = Scene()
    for z in (0.0, 0.9):
        scene.add_body(sphere(0.5, 147), RUBBER, (0.03, 0.02 * z, z))
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x)
    used = c.depth > 0.0
    gap = -np.einsum("ck,cki->ci", c.coef, state.x.numpy()[c.vert])
    # Weights are good to 1e-6 on edges of 0.2.
    np.testing.assert_allclose(gap[used], (c.depth[:, None] * c.normal)[used], atol=2e-6)


def test_a_vertex_goes_back_by_the_side_it_came_in_by(rng, stages, find_contacts, turned):
    """Down through the top, close to a side by which all its edges leave."""
    scene, rotate = Scene(), rotation_matrix(turn := turned())
    scene.add_body(box(1.0, 2), RUBBER, rotation=turn)
    tip = TetMesh([[0, 0, 0], [1.0, -0.3, 0.2], [1.0, 0.3, 0.2], [1.0, 0, 0.5]], [[0, 1, 2, 3]])
    before, depth = 0.002, 0.05
    place = np.array([0.49, rng.uniform(0.1, 0.2), 0.5 + before])
    scene.add_body(tip, RUBBER, rotate @ place, turn)
    model, state, work = stages(scene)
    x = state.x.numpy() + rng.uniform(-0.5, 0.5, 3).astype(np.float32)  # both fly
    x[-4:] -= (before + depth) * rotate[:, 2].astype(np.float32)
    c = find_contacts(model, work, state.x, wp.array(x, dtype=wp.vec3), apart=True)
    (k,) = np.flatnonzero(c.vert[:, 0] == len(x) - 4)
    np.testing.assert_allclose(c.normal[k], rotate[:, 2], atol=1e-5)  # float32
    assert c.depth[k] == pytest.approx(depth, abs=1e-6)


@pytest.mark.parametrize(("rise", "by_ray"), [(0.5, True), (0.12, False)])
def test_a_ray_much_longer_than_the_depth_gives_way_to_the_closest_point(
    rng, stages, find_contacts, turned, monkeypatch, rise, by_ray
):
    """A direction that leans so much that it leads out far away."""
    scene, rotate = Scene(), rotation_matrix(turn := turned())
    depth = 0.05
    scene.add_body(box(2.0, 4), RUBBER, rotation=turn)
    tip = TetMesh([[0, 0, 0], [0.3, 0, 1.0], [-0.2, 0.3, 1.0], [-0.2, -0.3, 1.0]], [[0, 1, 2, 3]])
    place = np.array([*rng.uniform(-0.2, 0.2, 2), 1.0 - depth])
    scene.add_body(tip, RUBBER, rotate @ place, turn)
    model, state, work = stages(scene)
    lean = rotate @ [np.sqrt(1.0 - rise**2), 0.0, rise]
    first, find_depths = model.n_vert - 4, narrow_phase.find_depths

    def leaning(model, x, work) -> None:
        find_depths(model, x, work)
        penetration = work.narrow_phase.penetration.numpy()
        own = penetration["vert"] == first
        assert own.any()
        penetration["direction"][own], penetration["depth"][own] = lean, depth
        work.narrow_phase.penetration.assign(penetration)

    monkeypatch.setattr(narrow_phase, "find_depths", leaning)
    c = find_contacts(model, work, state.x)
    (k,) = np.flatnonzero(c.vert[:, 0] == first)
    # A ray is good for three depths; the flat one would take eight.
    np.testing.assert_allclose(c.normal[k], lean if by_ray else rotate[:, 2], atol=1e-5)  # float32
    assert c.depth[k] == pytest.approx(depth / rise if by_ray else depth, abs=3e-6)


class Reference:
    """Heidelberger et al. (2004), all triangles, double precision; what is inside one body."""

    def __init__(self, model, x: np.ndarray, inside: set[int], body: int):
        self.x, self.inside = x, inside
        tris = model.tris.numpy()[model.tri_body.numpy() == body]
        self.corner = x[tris]
        a, b, c = np.moveaxis(self.corner, 1, 0)
        self.area = 0.5 * np.cross(b - a, c - a)
        self.tris = tris
        every = model.tris.numpy()
        n = np.cross(x[every[:, 1]] - x[every[:, 0]], x[every[:, 2]] - x[every[:, 0]])
        n /= np.linalg.norm(n, axis=1)[:, None]
        self.own = {i: n[(every == i).any(axis=1)] for i in inside}
        start, ends = model.vn_start.numpy(), model.vn_vert.numpy()
        self.neighbours = [ends[i:j] for i, j in pairwise(start)]

    def normal(self, t: int, w: np.ndarray) -> np.ndarray:
        """Corner normals over the triangles within the crease angle, whose cosine is 0.6."""
        face = self.area[t] / np.linalg.norm(self.area[t])
        n = np.zeros(3)
        for i, wi in zip(self.tris[t], w, strict=True):
            s = self.area[(self.tris == i).any(axis=1)]
            near = s @ face > 0.6 * np.linalg.norm(s, axis=1)
            corner = s[near].sum(axis=0)
            n += wi * corner / np.linalg.norm(corner)
        return n / np.linalg.norm(n)

    def entry(self, p: np.ndarray, u: np.ndarray) -> tuple[int, float, np.ndarray] | None:
        """The crossing into the body that is nearest to p."""
        facing = np.flatnonzero(self.area @ u < -1e-9 * np.linalg.norm(u))
        a, b, c = np.moveaxis(self.corner[facing], 1, 0)
        tvw = np.linalg.solve(
            np.stack([np.broadcast_to(u, a.shape), a - b, a - c], axis=2), (a - p)[:, :, None]
        )[:, :, 0]
        t, v, w = tvw.T
        ok = np.flatnonzero((v >= -1e-5) & (w >= -1e-5) & (v + w <= 1 + 1e-5) & (t >= 0) & (t <= 1))
        if not len(ok):
            return None
        k = ok[np.argmin(t[ok])]
        return facing[k], t[k], np.array([1.0 - v[k] - w[k], v[k], w[k]])

    def border(self, i: int) -> tuple[float, np.ndarray] | None:
        weight, depth, r = 0.0, 0.0, np.zeros(3)
        for j in self.neighbours[i]:
            u = self.x[i] - self.x[j]
            found = None if j in self.inside else self.entry(self.x[j], u)
            if found:
                n = self.normal(found[0], found[2])
                gap = self.x[j] + found[1] * u - self.x[i]
                own = self.own[i] @ n  # faces that do not look against n are no way out
                if gap @ n > 0.0 and (not len(own) or own.min() < -0.1):
                    w = 1.0 / (gap @ gap)
                    weight, depth, r = weight + w, depth + w * (gap @ n), r + w * n
        return (depth / weight, r / np.linalg.norm(r)) if weight else None

    def depths(self) -> dict[int, tuple[float, np.ndarray]]:
        done = {i: self.border(i) for i in self.inside}
        done = {i: value for i, value in done.items() if value}
        while True:
            layer = {}
            for i in self.inside - done.keys():
                js = [j for j in self.neighbours[i] if j in done]
                if js:
                    gap = self.x[js] - self.x[i]
                    w = 1.0 / np.sum(gap * gap, axis=1)
                    r = np.array([done[j][1] for j in js])
                    d = np.array([done[j][0] for j in js]) + np.sum(gap * r, axis=1)
                    mean = w @ r
                    layer[i] = (w @ d / w.sum(), mean / np.linalg.norm(mean))
            if not layer:
                return done
            done |= layer


def test_depths_are_those_of_the_published_formulas(
    rng, stages, find_contacts, jittered, turned, monkeypatch
):
    monkeypatch.setattr(depth, "SHALLOW", 0.0)  # the edges of all
    scene = Scene()
    scene.add_body(sphere(0.5, 309), RUBBER)
    scene.add_body(jittered(0.9, 4), RUBBER, (0.0, 0.0, 0.55), turned())
    model, state, work = stages(scene)
    find_contacts(model, work, state.x)
    found = penetrations(work)
    off = []
    for body in (0, 1):
        inside = {i for i, b in found if b == body}
        reference = Reference(model, state.x.numpy().astype(float), inside, body).depths()
        for i, (d, r) in reference.items():
            off.append((abs(found[i, body][1] - d), np.abs(found[i, body][2] - r).max()))
    # Weights 1 / gap^2 carry the rounding of a gap of a thousandth of an edge, now and then less.
    assert len(off) > 20
    depth_off, turned_off = np.sort(off, axis=0).T
    assert depth_off[-3] < 1e-4 and turned_off[-3] < 2e-3
    assert depth_off[-1] < 1e-3 and turned_off[-1] < 2e-2


def test_depths_next_to_a_smooth_surface_are_those_of_the_published_formulas(
    rng, stages, find_contacts, turned
):
    """To the order of the depth: the edges need not be followed there."""
    turn, shift = rotation_matrix(turned()), rng.uniform(-1.0, 1.0, 3)
    scene = Scene()
    mesh = box(1.0, 6)
    inner = np.tile(np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.4, 2)  # at no rim
    for k in (0, 1):
        x = mesh.vertices + rng.uniform(-0.02, 0.02, mesh.vertices.shape) * [1.0, 1.0, 0.0]
        x[:, 2] += 0.998 * k
        x[:, 2] += 0.01 * np.sin(4.0 * x[:, 0]) + 0.01 * np.cos(3.0 * x[:, 1])
        scene.add_body(TetMesh(x @ turn.T + shift, mesh.tets), RUBBER)
    model, state, work = stages(scene)
    find_contacts(model, work, state.x)
    records = work.narrow_phase.penetration.numpy()[: work.contacts.n_vertex.numpy()[0]]
    edge = model.body_edge.numpy()
    x = state.x.numpy().astype(float)
    n = 0
    for body in (0, 1):
        of_body = records[records["body"] == body]
        reference = Reference(model, x, set(of_body["vert"].tolist()), body)
        of_body = of_body[inner[of_body["vert"]]]
        for at in of_body[of_body["side"] == shallow.BELOW]:
            n += 1
            d, r = reference.border(int(at["vert"]))
            assert at["depth"] == pytest.approx(d, abs=0.02 * d + 1e-4 * edge[body])
            np.testing.assert_allclose(at["direction"], r, atol=0.02)
        for at in of_body[of_body["side"] == shallow.ABOVE]:
            assert not reference.border(int(at["vert"]))
    assert n > 30
