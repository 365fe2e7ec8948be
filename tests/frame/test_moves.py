"""Simulation.move_to: held vertices reach a place after so many frames, and stand still there."""

import numpy as np
import pytest

import warp_contact as wc

SOFT = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
KINDS = "explicit", "implicit"


def held(integrator: str = "explicit", worlds: int = 1, **settings) -> wc.Simulation:
    """A finger held at its top, and a rigid plate, in each world."""
    scene, tip = wc.Scene(), wc.box((0.03, 0.03, 0.06), (1, 1, 2))
    top = tip.vertices[:, 2] > 0.029
    for k in range(worlds):
        scene.add_body(tip, SOFT, (0.0, 0.0, 0.2), fixed=top, label=f"finger{k}", world=k)
        plate = wc.box((0.2, 0.1, 0.02), 1)
        scene.add_body(plate, wc.Rigid(1.0), fixed=True, label=f"plate{k}", world=k)
    return wc.Simulation(scene, integrator=integrator, **settings)


def top_of(sim: wc.Simulation) -> np.ndarray:
    return sim.scene.bodies[0].fixed


def run(sim: wc.Simulation, frames: int) -> wc.Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


@pytest.mark.parametrize("integrator", KINDS)
def test_vertices_go_straight_at_a_constant_speed_and_stand_still_where_they_should(
    integrator, rng
):
    sim = held(integrator)
    start = sim.positions(0)[top_of(sim)]
    goal = start + np.float32(rng.uniform(-0.02, 0.02, start.shape))
    sim.move_to(0, goal, over=7)
    steps = 0
    for k in range(1, 8):
        sim.step_frame()
        steps += sim.substeps
        # Each step rounds a position of 0.2 m by up to 8e-9, all of them the same way.
        np.testing.assert_allclose(
            sim.positions(0)[top_of(sim)], start + k / 7 * (goal - start), atol=1e-8 * (steps + 2)
        )
        speed = (goal - start) * 60 / 7
        near = 2e-5 + 60 * 1e-8 * steps  # a frame makes up for what the last ones rounded
        np.testing.assert_allclose(sim.velocities(0)[top_of(sim)], speed, atol=near)
    for _ in range(3):
        np.testing.assert_array_equal(sim.positions(0)[top_of(sim)], goal)
        sim.step_frame()
        np.testing.assert_array_equal(sim.velocities(0)[top_of(sim)], 0.0)


def about(axis, angle: float) -> np.ndarray:
    """A quaternion (x, y, z, w)."""
    return np.append(np.sin(0.5 * angle) * np.array(axis) / np.linalg.norm(axis), np.cos(angle / 2))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, 3.0])
def test_a_driven_rigid_body_turns_at_a_constant_rate_while_its_frame_goes_straight(angle, rng):
    sim, axis, way = held(), rng.normal(size=3), rng.uniform(-0.1, 0.1, 3)
    sim.move_to("plate0", pose=(way, about(axis, angle)), over=8)
    for k in range(1, 9):
        sim.step_frame()
        place, turn = sim.pose("plate0")
        np.testing.assert_allclose(place, way * k / 8, atol=1e-6)
        # Rounding of positions of 0.2 m over the arm of 0.1 m.
        np.testing.assert_allclose(turn, about(axis, angle * k / 8), atol=3e-6)
    run(sim, 2)
    np.testing.assert_allclose(sim.pose("plate0")[0], way, atol=1e-7)
    np.testing.assert_array_equal(sim.velocities("plate0"), 0.0)


def test_a_rigid_body_that_is_given_positions_keeps_its_shape_on_the_way():
    sim = held()
    start = sim.positions(1).astype(float)
    sim.move_to(1, start[:, [1, 0, 2]] * [-1.0, 1.0, 1.0], over=10)  # a quarter of a turn about z
    run(sim, 5)
    apart = np.linalg.norm(np.diff(sim.positions(1), axis=0), axis=1)
    np.testing.assert_allclose(apart, np.linalg.norm(np.diff(start, axis=0), axis=1), rtol=1e-5)


def test_held_vertices_of_a_soft_body_turn_with_a_pose():
    sim = held()
    start = sim.positions(0)[top_of(sim)].astype(float)
    sim.move_to(0, pose=((0.0, 0.0, 0.2), about((0.0, 0.0, 1.0), 0.5 * np.pi)), over=30)
    run(sim, 30)
    end = start[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(sim.positions(0)[top_of(sim)], end, atol=1e-7)


def test_some_vertices_move_while_others_do_not():
    sim, chosen = held(), np.flatnonzero(top_of(held()))[[0, 2]]
    start = sim.positions(0)
    sim.move_to(0, start[chosen] + np.float32([0.0, 0.0, 0.004]), chosen, over=2)
    run(sim, 2)
    moved = (sim.positions(0) - start)[top_of(sim)]
    # Rounding of a position of 0.2 m.
    np.testing.assert_allclose(np.sort(moved[:, 2]), [0.0, 0.0, 0.004, 0.004], atol=2e-8)


@pytest.mark.parametrize("integrator", KINDS)
def test_a_move_goes_on_from_a_checkpoint_with_the_same_bits(integrator, tmp_path):
    sim, again = held(integrator), held(integrator)
    sim.move_to(1, pose=((0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 1.0)), over=6)
    run(sim, 2).move_to(0, sim.positions(0)[top_of(sim)] + np.float32(0.003), over=3)
    sim.save(tmp_path / "on_the_way.npz")
    again.move_to(0, again.positions(0)[top_of(sim)] + np.float32(0.1), over=3)
    again.load(tmp_path / "on_the_way.npz")
    for _ in range(5):
        run(sim, 1), run(again, 1)
        np.testing.assert_array_equal(sim.positions(), again.positions())
        np.testing.assert_array_equal(sim.velocities(), again.velocities())


def test_nothing_is_on_its_way_after_a_reset():
    sim = held(worlds=2)
    start = sim.positions()
    for body in ("finger0", "finger1"):
        sim.move_to(body, sim.positions(body)[top_of(sim)] + np.float32(0.01), over=5)
    run(sim, 2).reset(worlds=[0])
    run(sim, 3)
    top = sim._bodies.range("finger0").start + np.flatnonzero(top_of(sim))
    np.testing.assert_array_equal(sim.positions()[top], start[top])
    reached = sim.positions("finger1")[top_of(sim)]
    np.testing.assert_array_equal(reached, start[sim._bodies.range("finger1")][top_of(sim)] + 0.01)
    sim.move_to("finger0", start[top] + np.float32(0.01), over=5)
    sim.reset()
    run(sim, 2)
    np.testing.assert_array_equal(sim.positions()[top], start[top])


def test_the_last_word_counts():
    sim = held()
    start = sim.positions(0)[top_of(sim)]
    sim.move_to(0, start + np.float32(0.05), over=5)
    run(sim, 1)
    sim.move_to(0, start, over=4)
    run(sim, 4)
    np.testing.assert_array_equal(sim.positions(0)[top_of(sim)], start)
    sim.move_to(0, start + np.float32(0.05), over=5)
    sim.set_velocity(0, (0.1, 0.0, 0.0), top_of(sim))
    run(sim, 6)
    # Rounding of 40 steps a frame.
    np.testing.assert_allclose(
        sim.positions(0)[top_of(sim)] - start, np.tile([0.01, 0, 0], (4, 1)), atol=1e-6
    )
    sim.move_to(0, start, over=5)
    run(sim, 1)
    sim.set_positions(0, start, top_of(sim))
    run(sim, 2)
    np.testing.assert_array_equal(sim.positions(0)[top_of(sim)], start)


def test_a_frame_that_fails_leaves_the_move_as_it_was(monkeypatch):
    sim, whole = held(), held()
    for each in (sim, whole):
        run(each, 1)
        each.move_to(0, each.positions(0)[top_of(sim)] + np.float32(0.01), over=2)
    before = sim.velocities()
    with monkeypatch.context() as m:
        m.setattr(sim._stepper.wrench, "finish", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            sim.step_frame()
    np.testing.assert_array_equal(sim.velocities(), before)
    np.testing.assert_array_equal(run(sim, 2).positions(), run(whole, 2).positions())


def test_a_sleeping_body_wakes_to_move():
    sim = run(held(sleeping=True), 120)
    assert not sim._stepper.work.awake.bodies.numpy().any()
    goal = sim.positions(0)[top_of(sim)] + np.float32(0.01)
    sim.move_to(0, goal, over=3)
    np.testing.assert_array_equal(run(sim, 3).positions(0)[top_of(sim)], goal)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"positions": np.zeros((3, 3))}, "positions of body 'finger0' of shape"),
        ({"positions": np.full((4, 3), np.nan)}, "at (0, 0) it is nan"),
        ({"positions": np.zeros((4, 3)), "over": 0}, "over 0: give a whole number"),
        ({}, "body 'finger0': give positions, or a pose, not both"),
        ({"pose": ((0, 0, 0), (0, 0, 0, 1)), "positions": 1}, "give positions, or a pose"),
        ({"pose": (0, 0, 0)}, "pose (0, 0, 0): give a position [m] and a rotation"),
        ({"pose": ((0, 0, 0), (0, 0, 0, 0))}, "rotation [0.0, 0.0, 0.0, 0.0]"),
        ({"positions": np.zeros((1, 3)), "vertices": [0]}, "vertex 0 of body 'finger0' is not"),
        ({"positions": np.zeros((0, 3)), "vertices": []}, "no vertex of body 'finger0' is"),
        ({"positions": np.full((4, 3), 1e9)}, "is 1e+09 m from the origin"),
        (
            {"pose": ((0, 0, 0), (1, 0, 0, 0)), "over": 6},
            "'finger0': it would turn by 0.52 rad",
        ),
    ],
)
def test_what_cannot_be_is_refused(given, words):
    with pytest.raises(ValueError) as error:
        held().move_to("finger0", **given)
    assert words in str(error.value)


def test_a_rigid_body_is_not_moved_out_of_its_shape():
    sim = held()
    with pytest.raises(ValueError, match="'plate0' is rigid: positions change its shape"):
        sim.move_to(1, sim.positions(1) * 1.1)
    with pytest.raises(ValueError, match="'plate0' is rigid"):
        sim.move_to(1, sim.positions(1)[:1] + 0.1, [0])
