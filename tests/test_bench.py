"""The timer of ``tools/bench.py``: it sees every launch, knows its stage, and changes nothing."""

import pkgutil
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import warp_contact as wc
import warp_contact.step

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

from clock.figures import figures, step_figures
from clock.scenes import Case, copies, pile
from clock.timer import ALONE, MEMORY, OTHER, StageTimer, held
from clock.window import Cost, Timing, measure

from warp_contact.scenes import load


@pytest.fixture
def touching(device) -> wc.Simulation:
    """A block that lies on another one, which lies on a plane."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for x, z in ((0.0, 0.05), (0.04, 0.15)):
        scene.add_body(wc.box(0.1, 1), wc.NeoHookean(2e4, 0.3, 1000.0, 1e-3), (x, 0.0, z))
    sim = wc.Simulation(scene, device=str(device))
    sim.step_frame()
    return sim


def test_every_launch_belongs_to_a_stage(touching):
    timing = measure(touching, repeats=2, steps=3)
    assert timing.contacts > 0
    modules = {module.name for module in pkgutil.iter_modules(warp_contact.step.__path__)}
    found = set(timing.stages) - {ALONE}
    assert {"forces", "broad_phase", "narrow_phase", "impulse"} <= found <= modules - {"step"}
    assert all(cost.launches > 0.0 for cost in timing.stages.values())
    assert timing.step_ms > 0.0
    assert timing.elastic_ms > 0.0


def test_shares_are_those_of_the_time_and_none_without_any(touching):
    for times, shares in (((3.0, 1.0), (0.75, 0.25)), ((0.0, 0.0), (0.0, 0.0))):
        stages = {key: Cost(2.0, ms) for key, ms in zip("ab", times, strict=True)}
        found = step_figures(Timing(1, 1.0, 1.0, 0.0, 0, stages), touching.model)
        assert (found["a.share"], found["b.share"]) == shares
        assert found["a.launches"] == 2.0 and found["step.launches"] == 4.0


def test_a_launch_outside_of_a_step_is_seen_as_such(device):
    a, b = (wp.zeros(5, dtype=float, device=device) for _ in range(2))
    with StageTimer(device) as timer:
        a.fill_(2.0)
        wp.copy(b, a)
    assert [stage for stage, _ in timer.operations] == [OTHER, OTHER]
    np.testing.assert_array_equal(b.numpy(), 2.0)


def test_measuring_leaves_simulation_and_warp_as_they_were(touching):
    kept = [getattr(owner, name) for owner, name in (*MEMORY, (wp, "launch"))]
    x, v = touching.positions(), touching.velocities()
    measure(touching, repeats=1, steps=2)
    np.testing.assert_array_equal(touching.positions(), x)
    np.testing.assert_array_equal(touching.velocities(), v)
    assert [getattr(owner, name) for owner, name in (*MEMORY, (wp, "launch"))] == kept


def test_bytes_of_shared_memory_count_once(device):
    whole = wp.zeros(100, dtype=wp.vec3, device=device)
    assert held((whole, whole[10:20])) == 1200
    assert held((whole[:10], whole[5:20])) == 240


def test_the_spheres_of_a_pile_just_touch():
    below, above = pile(300).bodies[:2]
    assert above.x[:, 2].min() == pytest.approx(below.x[:, 2].max())


def test_copies_do_not_share_a_world():
    scene = copies(3)
    assert [body.world for body in scene.bodies] == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    np.testing.assert_allclose(scene.bodies[1].x, scene.bodies[7].x)


def test_a_case_is_timed_as_a_whole():
    case = Case(load("squeezed_sphere").build, 2)
    found = figures(case, None, 1, "explicit", None)
    assert found["step.ms"] > 0.0 and 0.0 < found["frame.choice_of_step_share"] < 1.0
    assert found["substeps"] > 10
