"""narrow_phase.py, persistent contacts of edges: they go on from step to step, across frames."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, TetMesh, box
from warp_contact.frame import step_bounds
from warp_contact.step import broad_phase, impulse, narrow_phase, warm_start

RUBBER = NeoHookean(1e5, 0.3, 1000.0, damping=2e-3)
WEIGHT = 0.4 * 0.1 * 0.1 * 1000.0 * 9.81  # of a beam [N]
SIN, COS = np.sin(np.pi / 8.0), np.cos(np.pi / 8.0)  # a turn by 45 degrees
PLACED = 1.0 / np.sqrt(2.0) * 0.1 + 1e-5  # half a diagonal of a beam, and a hair


@pytest.fixture
def lying(device) -> Simulation:
    """A beam across another, which is held, both on an edge: no vertex is near the contact."""
    scene = Scene(friction=0.0)
    for k, size in enumerate(((0.4, 0.1, 0.1), (0.1, 0.4, 0.1))):
        q = [0.0, 0.0, 0.0, COS]
        q[k] = SIN  # about its own length
        cells = [3 if s > 0.1 else 1 for s in size]
        place = 0.01 * k, 0.007 * k, 2.0 * PLACED * k
        scene.add_body(box(size, cells), RUBBER, place, q, fixed=None if k else True)
    sim = Simulation(scene, device=str(device))
    for _ in sim.frames(10):
        pass
    assert sim._stepper.work.contacts.n_vertex.numpy()[0] == 0
    return sim


def kept(sim: Simulation) -> np.ndarray:
    """The contacts of edges that the last step leaves to the next."""
    warm = sim._stepper.work.warm
    return warm.edges.numpy()[: warm.n_edge.numpy()[0]]


def go_on(sim: Simulation) -> dict[str, np.ndarray]:
    """Begin a step: the contacts that go on, and the impulses that they start from."""
    model, x, work = sim.model, sim.state.x, sim._stepper.work
    narrow_phase.find_vertices(model, x, x, work)
    narrow_phase.continue_edges(model, x, work)
    impulse.begin(model, x, work)
    warm_start.recall_edges(work)
    return contacts_of(work)


def contacts_of(work) -> dict[str, np.ndarray]:
    """What contacts are, what holds them, and their normal impulses."""
    c, n = work.contacts, int(work.contacts.n.numpy()[0])
    record = c.record.numpy()[:n]
    found = {name: record[name].copy() for name in ("vert", "coef", "normal", "pair")}
    found["inv_mass"] = c.constraint.numpy()[:n]["inv_mass"].copy()
    return found | {"impulse": c.impulse.numpy()[:n]["normal"].copy()}


def test_a_contact_of_two_edges_goes_on_where_they_are_closest(lying):
    before, now = kept(lying), go_on(lying)
    pressed = before[before["kept"][:, 3] > 0.0]
    assert len(now["impulse"]) == len(pressed) > 0
    np.testing.assert_array_equal(now["impulse"], pressed["kept"][:, 3])
    x = lying.positions().astype(float)
    for vert, coef, normal in zip(now["vert"], now["coef"], now["normal"], strict=True):
        p, q, a, b = x[vert[:4]]
        n = np.cross(q - p, b - a)
        n /= np.linalg.norm(n)
        # float32, over two edges at a right angle
        assert abs(normal @ n) == pytest.approx(1.0, abs=1e-6)
        between = coef @ x[vert]
        np.testing.assert_allclose(np.cross(between, n), 0.0, atol=1e-7)
        assert 0.0 <= between @ normal < 1e-3 * 0.1  # the resting gap


def arranged(work) -> dict[str, np.ndarray]:
    """What the impulses see of the contacts."""
    graph = work.contacts.graph
    start = graph.start.numpy().copy()
    touched = np.sort(graph.touched.numpy()[: graph.n_touched.numpy()[0]])
    return contacts_of(work) | {
        "start": start,
        "entry": graph.entry.numpy()[: start[-1]].copy(),
        "touched": touched,
    }


def test_a_look_that_finds_nothing_new_leaves_the_contacts_alone(lying):
    work, x = lying._stepper.work, lying.state.x
    go_on(lying)
    before = arranged(work)
    assert (before["impulse"] > 0.0).any()
    narrow_phase.find_edges(lying.model, x, x, work)
    impulse.add_edges(lying.model, lying.state, work)
    assert work.narrow_phase.n_new.numpy()[0] == 0
    after = arranged(work)
    for name, value in before.items():
        np.testing.assert_array_equal(after[name], value)


def test_contacts_may_be_arranged_more_than_once(lying):
    work, x = lying._stepper.work, lying.state.x
    go_on(lying)
    impulse.begin(lying.model, x, work)
    before = arranged(work)
    assert len(before["touched"]) == np.count_nonzero(np.diff(before["start"])) > 0
    impulse.begin(lying.model, x, work)
    for name, value in arranged(work).items():
        np.testing.assert_array_equal(value, before[name])


def test_the_same_contact_carries_the_beam_from_frame_to_frame(lying):
    forces, names = [], []
    for _ in lying.frames(12):  # later it has rolled off the edge
        names.append({(h["edge"], h["body"]) for h in kept(lying) if h["kept"][3] > 0.0})
        forces.append(sum(lying.measure().forces.values()))
    print(names, forces)
    assert set.intersection(*names)
    assert np.mean(forces) == pytest.approx(WEIGHT, rel=0.1)  # it still swings


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.05), (0.3, 0.0, 0.0), (0.0, 0.45, 0.0)])
def test_what_was_moved_away_is_forgotten(lying, way):
    upper = slice(*lying.model.body_vert.numpy()[1:3])
    x = lying.positions()
    x[upper] += np.float32(way)
    lying.state.x.assign(x)
    assert len(go_on(lying)["impulse"]) == 0
    before = lying.measure().momentum[2]
    lying.step_frame()
    assert lying.measure().forces == {}
    # float32, over some tens of steps
    assert lying.measure().momentum[2] - before == pytest.approx(-WEIGHT / lying.fps, rel=1e-4)
    assert len(kept(lying)) == 0


def test_what_has_parted_counts_no_contacts(lying):
    assert lying.measure().n_contacts > 0
    x = lying.positions()
    x[slice(*lying.model.body_vert.numpy()[1:3]), 2] += np.float32(0.5)  # nothing is near
    lying.state.x.assign(x)
    lying.step_frame()
    assert lying.measure().n_contacts == 0
    assert (lying.contact_fields()["partner"] == -1).all()


def test_without_an_impulse_a_contact_does_not_go_on(lying):
    warm = lying._stepper.work.warm
    edges = warm.edges.numpy()
    edges["kept"][:, 3] = 0.0
    warm.edges.assign(edges)
    assert len(go_on(lying)["impulse"]) == 0


def test_a_frame_that_is_repeated_starts_from_the_same_impulses(lying, tmp_path, monkeypatch):
    lying.save(tmp_path / "run.npz")
    once = Simulation(lying.scene, device=str(lying.device))
    once.load(tmp_path / "run.npz")
    once.step_frame()
    stable = []  # the first attempt is not

    def same(before, *_):
        stable.append(True)
        return before

    monkeypatch.setattr(step_bounds, "stays_stable", lambda *_: bool(stable))
    monkeypatch.setattr(step_bounds, "raised", same)
    lying.step_frame()
    assert stable == [True]
    np.testing.assert_array_equal(lying.positions(), once.positions())
    for name in ("edge", "body", "vert", "n", "kept"):
        np.testing.assert_array_equal(kept(lying)[name], kept(once)[name])


def test_contacts_that_take_all_the_places_ask_for_more(lying):
    """Those of the last step keep their places also when they are over."""
    work = lying._stepper.work
    warm, room = work.warm, work.capacity.contacts
    edges = warm.edges.numpy()
    edges[:] = edges[0]
    edges["kept"][:, 3] = 0.0
    warm.edges.assign(edges)
    warm.n_edge.fill_(room)
    ahead = lying.positions()
    ahead[slice(*lying.model.body_vert.numpy()[1:3]), 2] -= np.float32(1e-4)
    go_on(lying)
    assert not work.overflow.all.numpy().any()
    x = wp.array(ahead, dtype=wp.vec3)
    narrow_phase.find_edges(lying.model, lying.state.x, x, work)
    impulse.add_edges(lying.model, lying.state, work)
    assert work.narrow_phase.n_crossing.numpy()[0] > 0
    assert work.overflow.all.numpy()[0] > room


def test_places_are_counted_from_none_in_every_step(lying):
    """Where no vertex is near, nobody else begins to count."""
    work = lying._stepper.work
    work.warm.n_edge.zero_()
    work.broad_phase.verts.n.zero_()
    for _ in range(2):
        work.narrow_phase.n_place.fill_(77)
        go_on(lying)
        assert work.narrow_phase.n_place.numpy()[0] == 0


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize(("t", "goes_on"), [(0.2, True), (0.8, False)])
def test_a_contact_with_a_face_ends_where_it_has_left_the_triangle(stages, t, goes_on, beside):
    """An edge that lies over both triangles of a top, with an impulse against the first."""
    scene = Scene()
    if beside:  # the edge is near another body too, which comes before
        scene.add_body(box(0.2, 1), RUBBER, (0.8, -0.0002, 0.6003))
    body = scene.add_body(box((2.0, 2.0, 1.0), 1), RUBBER).index
    x = [[-0.8, 0.1, 0.0], [0.8, 0.1, 0.0], [0.0, 0.3, 1.0], [0.0, -0.1, 1.0]]
    scene.add_body(TetMesh(x, [[0, 1, 2, 3]]), RUBBER, (0.0, 0.0, 0.5 + 1e-4))
    model, state, work = stages(scene)
    at, tris = state.x.numpy().astype(float), model.tris.numpy()
    of_body = np.flatnonzero(model.tri_body.numpy() == body)
    top = of_body[(at[tris[of_body], 2] > 0.4).all(axis=1)]
    first = model.n_vert - 4
    edge = np.flatnonzero((model.edges.numpy()[:, :2] == [first, first + 1]).all(axis=1))
    kept = work.warm.edges.numpy()
    kept["edge"][0], kept["body"][0], kept["t"][0] = edge[0], body, t
    kept["vert"][0] = tris[top[at[tris[top], 0].mean(axis=1).argmin()]]
    kept["n"][0], kept["kept"][0] = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)
    work.warm.edges.assign(kept)
    work.warm.n_edge.fill_(1)
    work.worlds.apart.fill_(1)
    broad_phase.refresh(model, state.x, state.x, work)
    pairs = work.broad_phase.edges.list
    bodies = pairs.pair.numpy()[slice(*pairs.start.numpy()[edge[0] : edge[0] + 2])][:, 1]
    assert bodies.tolist() == list(range(body + 1))
    narrow_phase.continue_edges(model, state.x, work)
    place = work.narrow_phase.place.numpy()[: work.broad_phase.edges.n.numpy()[0]]
    going = pairs.pair.numpy()[: len(place)][place >= 0].tolist()
    assert going == ([[edge[0], body]] if goes_on else [])
