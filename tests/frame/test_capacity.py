"""capacity.py: buffers that a frame outgrew, or would soon have outgrown; nothing is lost."""

from dataclasses import astuple, fields, replace

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box
from warp_contact.data import damping, warm_start
from warp_contact.data.overflow import Capacity
from warp_contact.data.work import allocate_work
from warp_contact.frame import capacity
from warp_contact.step import broad_phase, narrow_phase

RUBBER = NeoHookean(1e5, 0.3, 1000.0)
LISTS = ["verts", "tets", "edges", "tris", "near"]


def stacked(device) -> Simulation:
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(3):
        scene.add_body(box(0.1, 2), RUBBER, (0.01 * k, 0.0, 0.05 + 0.1001 * k))
    sim = Simulation(scene, device=str(device))
    for _ in sim.frames(3):
        pass
    return sim


def test_what_fits_stays(device):
    assert capacity.enlarged(stacked(device)._stepper.work) is None


def test_what_is_more_than_half_full_grows_with_what_did_not_fit(device):
    sim = stacked(device)
    work = sim._stepper.work
    broad = work.broad_phase
    used = [
        work.contacts.n.numpy()[0],
        (work.forces.pair_key.numpy() >= 0).sum(),
        broad.verts.n.numpy()[0],
        broad.verts.item_start.numpy()[-1],
        broad.edges.n.numpy()[0],
        broad.edges.item_start.numpy()[-1],
    ]
    assert min(used) > 0
    broad.near.part.zero_()
    near = broad.near.part.numpy()
    near["tris"][0, 0] = 10, 0.7 * work.capacity.near
    broad.near.part.assign(near)
    used.append(near["tris"][0, 0, 1])
    needed = np.zeros(7, dtype=int)
    needed[0] = work.capacity.contacts + 10
    work.overflow.all.assign(needed)
    got, have = astuple(capacity.enlarged(work)), astuple(work.capacity)
    assert got[0] == 2 * needed[0] and got[6] == 2 * used[6] and got[1] == have[1] > 2 * used[1]
    assert got[1:] == tuple(2 * n if 2 * n > h else h for n, h in zip(used, have, strict=True))[1:]


def test_lists_that_grow_together_cost_few_frames(device, monkeypatch):
    sim, grown = stacked(device), []
    known = sim._stepper.work.capacity

    def enlarged(work, enlarged=capacity.enlarged):
        wanted = enlarged(work)
        if wanted:
            grown.append(wanted)
        return wanted

    monkeypatch.setattr("warp_contact.frame.stepper.enlarged", enlarged)
    least = [max(1, n // 4) for n in astuple(known)]
    sim._stepper.buffers.use(allocate_work(sim.model, sim.state, Capacity(*least)))
    sim.step_frame()
    # In the order of the stages, where one that does not fit hides what comes after it.
    assert 1 <= len(grown) <= 6
    assert not sim._stepper.work.overflow.all.numpy().any()


def crowd(rng, turned) -> Scene:
    scene = Scene()
    for _ in range(6):
        scene.add_body(box(0.2, 2), RUBBER, rng.uniform(-0.06, 0.06, 3), turned())
    scene.add_plane((0.0, 0.0, 1.0), -0.05)
    return scene


def n_inside(model, state, work) -> int:
    """Number of vertices inside other bodies; the broad phase looks first."""
    broad_phase.refresh(model, state.x, state.x, work)
    narrow_phase.find_vertices(model, state.x, state.x, work)
    return int(work.contacts.n_vertex.numpy()[0])


@pytest.mark.parametrize("name", ["contacts", *LISTS])
def test_what_does_not_fit_is_counted(rng, stages, turned, name):
    k = [field.name for field in fields(Capacity)].index(name)
    scene = crowd(rng, turned)
    room = Capacity(4096, 64, 4096, 65536, 4096, 65536, 65536)
    ample = stages(scene, room)
    assert n_inside(*ample) > 0 and not ample[2].overflow.all.numpy().any()
    model, state, work = stages(scene, replace(room, **{name: 2}))
    n_inside(model, state, work)
    needed = work.overflow.all.numpy()
    assert needed[k] > 2 and np.count_nonzero(needed) == 1
    if name in LISTS:  # then the list stays empty
        model, state, work = stages(scene, replace(room, **{name: int(needed[k])}))
        n_inside(model, state, work)
        assert not work.overflow.all.numpy().any()


@pytest.mark.parametrize("name", ["contacts", *LISTS])
def test_what_fits_exactly_fits(rng, stages, find_contacts, turned, name):
    scene = crowd(rng, turned)
    room = Capacity(4096, 64, 4096, 65536, 4096, 65536, 65536)
    model, state, work = stages(scene, room)
    expected = find_contacts(model, work, state.x, edges=True)
    b = work.broad_phase
    counts = {  # of the near triangles no list is longer than their last end
        "contacts": work.contacts.n,
        "verts": b.verts.n,
        "tets": b.verts.item_start[-1:],
        "edges": b.edges.n,
        "tris": b.edges.item_start[-1:],
    }
    near = int(b.near.part.numpy()["tris"].max())
    used = int(counts[name].numpy()[0]) if name in counts else near
    model, state, work = stages(scene, replace(room, **{name: used}))
    found = find_contacts(model, work, state.x, edges=True)  # it asks whether anything did not fit
    assert found.n == expected.n > 0
    np.testing.assert_array_equal(found.vert, expected.vert)
    model, state, work = stages(scene, replace(room, **{name: used - 1}))
    with pytest.raises(AssertionError):
        find_contacts(model, work, state.x, edges=True)
    needed = dict(zip([f.name for f in fields(Capacity)], work.overflow.all.numpy(), strict=True))
    assert needed[name] == used


def test_a_simulation_grows_its_buffers_and_loses_nothing(rng, turned):
    scene = crowd(rng, turned)
    tiny = Simulation(scene, fps=1000)
    ample = Simulation(scene, fps=1000)
    tight = Capacity(*[1] * 7)
    roomy = Capacity(8192, 64, 8192, 65536, 8192, 65536, 65536)
    tiny._stepper.buffers.use(allocate_work(tiny.model, tiny.state, tight))
    ample._stepper.buffers.use(allocate_work(ample.model, ample.state, roomy))
    for sim in (tiny, ample):
        sim.step_frame()
    np.testing.assert_array_equal(tiny.positions(), ample.positions())
    np.testing.assert_array_equal(tiny.velocities(), ample.velocities())
    assert tiny.measure().forces == ample.measure().forces
    assert min(astuple(tiny._stepper.work.capacity)) > 1


def test_buffers_that_grow_on_the_way_change_nothing(pile):
    tight, ample = Simulation(pile), Simulation(pile)
    shrunk = -1
    for frame in range(16):
        before = tight._stepper.work.warm  # with the impulses that the next frame starts from
        held = int(before.n_edge.numpy()[0])
        expected = damping.copied(tight._stepper.work.damping)
        if frame >= 4 and held > 0 and shrunk < 0:
            shrunk = frame
            tight._stepper.buffers.use(
                allocate_work(tight.model, tight.state, Capacity(held, *[1] * 6))
            )
            warm_start.copy(tight._stepper.work.warm, before)
            damping.copy(tight._stepper.work.damping, expected)
        for sim in (tight, ample):
            # Short steps, which lengthen by a part from frame to frame, not from try to try.
            sim._stepper.last = replace(sim._stepper.last, n=np.array([max(sim.substeps, 40)]))
            sim.step_frame()
        assert tight.substeps == ample.substeps
        assert (tight._stepper.last.rates == ample._stepper.last.rates).all()
        np.testing.assert_array_equal(tight.positions(), ample.positions())
        np.testing.assert_array_equal(tight.velocities(), ample.velocities())
        if shrunk >= 0 and frame >= shrunk + 3:
            break
    assert shrunk >= 0


def test_a_deep_overlap_beyond_the_first_buffer_is_searched_all_the_same():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(0.2, 1), RUBBER, (1.0, 0.0, 0.1 - 1e-6))  # four shallow contacts come first
    for k, z in enumerate((1.0, 1.18)):
        scene.add_body(box(0.2, 2), NeoHookean(1e5 * 10**k, 0.3, 1000.0), (0.0, 0.0, z))
    tiny, ample = Simulation(scene, fps=1000), Simulation(scene, fps=1000)
    tiny._stepper.buffers.use(allocate_work(tiny.model, tiny.state, Capacity(contacts=4)))
    for sim in (tiny, ample):
        sim.step_frame()
    np.testing.assert_array_equal(tiny.positions(), ample.positions())


@pytest.mark.parametrize("speed", [2.0, 4.0, 6.0])
def test_buffers_that_were_too_small_leave_no_trace(speed):
    """Frames in which the steps are too long as well: that is told by the repeat alone."""
    found = []
    for room in (Capacity(), Capacity(contacts=4, verts=4, edges=4)):
        scene = Scene()
        scene.add_plane((0.0, 0.0, 1.0))
        for k in range(2):
            place, rubber = (0.01 * k, 0.0, 0.051 + 0.102 * k), NeoHookean(5e4, 0.35, 1e3, 2e-3)
            scene.add_body(box(0.1, 2), rubber, place, velocity=(0.0, 0.0, -speed))
        sim = Simulation(scene)
        sim._stepper.buffers.replace(room)
        found.append([(sim.positions(), sim.velocities(), sim.substeps) for _ in sim.frames(4)])
    for roomy, tight in zip(*found, strict=True):
        assert all(np.array_equal(one, other) for one, other in zip(roomy, tight, strict=True))
    assert sim._stepper.work.capacity.contacts > 4


def test_a_frame_that_goes_back_finds_its_pairs_anew(device):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for k in range(2):
        scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.1001 * k))
    sim = Simulation(scene, device=str(device))
    sim.step_frame()
    pairs = sim._stepper.work.broad_phase.verts.n
    assert pairs.numpy()[0] > 0
    pairs.zero_()  # as where they did not fit
    sim._stepper._start.go_back(sim.state, sim._stepper.work)
    sim.step_frame()
    assert pairs.numpy()[0] > 0
