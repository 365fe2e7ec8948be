"""capacity.py: buffers that a frame outgrew, and those that it would soon have outgrown."""

from dataclasses import astuple

import numpy as np

from warp_contact import NeoHookean, Scene, Simulation, box
from warp_contact.data.contacts import Capacity
from warp_contact.data.work import allocate_work
from warp_contact.frame import capacity

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


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
    used = [
        work.contacts.n.numpy()[0],
        (work.pair_key.numpy() >= 0).sum(),
        work.candidates.verts.n.numpy()[0],
        work.candidates.verts.item_start.numpy()[-1],
        work.candidates.edges.n.numpy()[0],
        work.candidates.edges.item_start.numpy()[-1],
    ]
    assert min(used) > 0
    work.near.tris.zero_()
    near = work.near.tris.numpy()
    near[0, 0] = 10, 0.7 * work.capacity.near
    work.near.tris.assign(near)
    used.append(near[0, 0][1])
    needed = np.zeros(7, dtype=int)
    needed[0] = work.capacity.contacts + 10
    work.contacts.needed.assign(needed)
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
    sim._stepper.use(allocate_work(sim.model, sim.state, Capacity(*least)))
    sim.step_frame()
    # In the order of the stages, where one that does not fit hides what comes after it.
    assert 1 <= len(grown) <= 6
    assert not sim._stepper.work.contacts.needed.numpy().any()
