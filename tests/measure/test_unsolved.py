"""measure.py, worlds.py: solves that ran out of sweeps are counted."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.step import coupled, impulse

SOFT = wc.NeoHookean(5e4, 0.3, 1000.0, 2e-3)
BOTH = pytest.mark.parametrize("integrator", ["explicit", "implicit"])


def stack(integrator: str, worlds: int = 1, **settings) -> wc.Simulation:
    """Two blocks that fall on each other and on a plane, in each world a little faster."""
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    for k in range(worlds):
        for at in (0.0505, 0.152):
            v = 0.0, 0.0, -0.3 - 0.1 * k
            scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, at), velocity=v, world=k)
    return wc.Simulation(scene, integrator=integrator, **settings)


def counts(sim: wc.Simulation, n: int) -> list[int]:
    """``unsolved`` of the next frames."""
    return [sim.measure().unsolved for _ in sim.frames(n)]


@pytest.fixture
def few(monkeypatch):
    """Two sweeps of the impulses at most."""
    monkeypatch.setattr(impulse, "SWEEPS", 2)
    monkeypatch.setattr(coupled, "SWEEPS", 2)


@BOTH
def test_all_is_solved_where_blocks_fall_and_come_to_rest(integrator):
    sim = stack(integrator)
    assert counts(sim, 30) == [0] * 30
    assert sim.measure().n_contacts > 0


@BOTH
def test_impulses_that_run_out_of_sweeps_are_counted(few, integrator):
    sim = stack(integrator)
    found = []
    for _ in sim.frames(6):
        measured = sim.measure()
        found.append(measured.unsolved)
        # At most two solves of impulses and two of the closure in a step.
        assert measured.unsolved <= 4 * sim.substeps
    assert max(found) > 0


@BOTH
def test_the_closure_counts_where_no_place_is_free(integrator):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_plane((0.0, 0.0, -1.0), 3e-5)  # z <= -3e-5
    scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, 0.05))
    sim = wc.Simulation(scene, integrator=integrator, substeps=40)
    # The lower face has no place between them, until it is too deep in one for the closure.
    assert counts(sim, 1)[0] > 0


@BOTH
def test_what_is_read_between_frames_is_not_counted(few, integrator):
    sim = stack(integrator)
    while not sim.measure().unsolved:
        sim.step_frame()
    first = sim.measure().unsolved
    sim.velocities()
    assert sim.measure().unsolved == first


@BOTH
def test_worlds_count_one_by_one(few, integrator):
    together = counts(stack(integrator, worlds=3), 4)
    alone = []
    for k in range(3):
        scene = wc.Scene(friction=0.5)
        scene.add_plane((0.0, 0.0, 1.0))
        for at in (0.0505, 0.152):
            v = 0.0, 0.0, -0.3 - 0.1 * k
            scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, at), velocity=v)
        alone.append(counts(wc.Simulation(scene, integrator=integrator), 4))
    assert together == np.sum(alone, axis=0).tolist() and sum(together) > 0


def test_the_count_is_that_of_the_last_frame(few, tmp_path):
    sim = stack("explicit", sleeping=True)
    found = counts(sim, 4)
    assert found[-1] > 0
    sim.save(tmp_path / "it.npz")
    sim.load(tmp_path / "it.npz")
    assert sim.measure().unsolved == 0  # as there are no forces until the next frame
    after = counts(sim, 2)
    sim.reset()
    assert sim.measure().unsolved == 0
    assert counts(sim, 6) == found + after


def test_what_sleeps_counts_none():
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, 0.05002))
    sim = wc.Simulation(scene, sleeping=True)
    while sim.measure().n_contacts or sim.frame < 20:
        sim.step_frame()
    sim._stepper.work.forces.unsolved.fill_(1)
    sim.step_frame()
    assert sim.measure().unsolved == 0
