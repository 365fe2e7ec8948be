"""Attachments over a run: checkpoints, reset, worlds, sleeping, buffers that grow, refusals."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.frame import implicit_shapes
from warp_contact.step import ties

G = 9.81
SOLID, SOFT = wc.Rigid(1000.0), wc.NeoHookean(2e5, 0.3, 1000.0, 2e-3)
DIE = wc.box((0.1, 0.06, 0.03), 2)


def mobile(world: int, scene: wc.Scene, height: float = 0.12, limit: float = 1.0) -> None:
    """A soft block that hangs from a rigid one on a ball, which a weak weld holds at the world."""
    of = {"world": world}
    scene.add_body(wc.box(0.1, 2), SOLID, (0.0, 0.0, height), **of, label=f"upper{world}")
    scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, height - 0.1), **of, label=f"lower{world}")
    pin = {"at": (0.03, 0.0, height - 0.05), "label": f"pin{world}"}
    scene.attach(f"lower{world}", f"upper{world}", "ball", **pin)
    hook = {"breaking_force": 2.0 * G * limit, "label": f"hook{world}"}
    scene.attach(f"upper{world}", kind="weld", **hook)


def scene_of(*worlds: int, **given) -> wc.Simulation:
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    for world in worlds:
        mobile(world, scene, 0.2 + 0.01 * world, **given)
    return wc.Simulation(scene)


def seen(sim: wc.Simulation, world: int) -> np.ndarray:
    parts = [sim.positions(f"{name}{world}").ravel() for name in ("upper", "lower")]
    parts += [sim.velocities(f"{name}{world}").ravel() for name in ("upper", "lower")]
    parts += [sim.attachment_force(f"{name}{world}") for name in ("pin", "hook")]
    held = [sim.is_attached(f"{name}{world}") for name in ("pin", "hook")]
    return np.concatenate([*parts, held])


def episode(sim: wc.Simulation, frames: int, world: int = 0) -> list[np.ndarray]:
    return [seen(sim, world) for _ in sim.frames(frames)]


def test_the_hook_breaks_and_all_falls():
    sim = scene_of(0)
    last = episode(sim, 20)[-1]
    assert sim.is_attached("pin0") and not sim.is_attached("hook0")
    assert last[2] < 0.2


def test_a_checkpoint_and_a_reset_know_what_is_broken(tmp_path):
    sim = scene_of(0)
    first = episode(sim, 12)
    sim.reset()
    assert sim.is_attached("hook0")
    again = episode(sim, 6)
    assert not sim.is_attached("hook0")
    sim.save(tmp_path / "run.npz")
    other = scene_of(0)
    other.load(tmp_path / "run.npz")
    assert not other.is_attached("hook0")
    np.testing.assert_array_equal(np.array(again + episode(other, 6)), np.array(first))


def test_another_attachment_is_another_scene(tmp_path):
    scene_of(0).save(tmp_path / "run.npz")
    with pytest.raises(ValueError, match="another scene"):
        scene_of(0, limit=1.1).load(tmp_path / "run.npz")


def test_a_world_has_the_same_bits_alone_and_beside_others():
    one, both, other = scene_of(1), scene_of(0, 1), scene_of(1, 2)
    alone = np.array(episode(one, 15, 1))
    assert not one.is_attached("hook1")
    np.testing.assert_array_equal(np.array(episode(both, 15, 1)), alone)
    np.testing.assert_array_equal(np.array(episode(other, 15, 1)), alone)


def test_a_reset_of_a_world_mends_its_attachments_alone():
    sim = scene_of(0, 1)
    episode(sim, 12)
    assert not sim.is_attached("hook0") and not sim.is_attached("hook1")
    sim.reset([1])
    assert not sim.is_attached("hook0") and sim.is_attached("hook1")
    assert np.abs(sim.positions("upper1")[:, 2].mean() - 0.21) < 1e-6


def test_buffers_that_grow_within_a_frame_change_nothing():
    small, large = scene_of(0), scene_of(0)
    work = large._stepper.work
    assert small._stepper.work.capacity == work.capacity
    from dataclasses import replace

    small._stepper.buffers.replace(replace(work.capacity, contacts=1, verts=2, tets=2, edges=2))
    np.testing.assert_array_equal(np.array(episode(small, 30)), np.array(episode(large, 30)))
    assert small._stepper.work.capacity.contacts > 1


def test_what_hangs_at_rest_sleeps_and_wakes_together():
    scene = wc.Scene()
    scene.add_body(DIE, SOLID, (0.0, 0.0, 0.0), label="upper")
    scene.add_body(DIE, SOLID, (0.5, 0.0, -1.0), label="lower")  # far from the other
    scene.attach("upper", kind="weld", label="hook")
    scene.attach("lower", "upper", "weld", label="arm")
    sim = wc.Simulation(scene, sleeping=True)
    awake = []
    for _ in sim.frames(50):
        awake.append(sim._stepper.sleeping.awake.bodies.numpy().sum())
    assert awake[0] == 2 and awake[-1] == 0
    weight = 1000.0 * DIE.volume * G
    # Rounding of a metre over the square of a step, as it was in the last frame awake.
    assert sim.attachment_force("arm")[2] == pytest.approx(weight, rel=0.02)
    sim.apply("lower", (0.0, 0.1, 0.0))
    sim.step_frame()
    assert sim._stepper.sleeping.awake.bodies.numpy().sum() == 2
    for _ in sim.frames(60):
        pass
    sim.detach("hook")
    for _ in sim.frames(3):
        pass
    assert sim.positions("upper")[:, 2].mean() < -0.005


@pytest.mark.parametrize("response", [wc.Penalty(2e4), wc.PredictedForce()], ids=str)
def test_other_responses_hold_attachments_too(response):
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), -0.2)
    scene.add_body(wc.box(0.1, 2), SOLID, label="upper")
    scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, -0.14), label="lower")  # on the floor soon
    scene.attach("upper", kind="ball", at=(0.0, 0.0, 0.05))
    scene.attach("lower", "upper", "ball", at=(0.0, 0.0, -0.09))
    sim = wc.Simulation(scene, response)
    for _ in sim.frames(20):
        pass
    assert np.abs(sim.pose("upper")[0]).max() < 1e-5
    assert sim.measure().kinetic < 1e-3


def test_a_body_too_large_for_implicit_steps_is_held_beside_them(monkeypatch):
    monkeypatch.setattr(implicit_shapes, "LARGEST", 30)
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 2), SOLID, label="upper")
    large = wc.box(0.1, 3)
    scene.add_body(large, SOFT, (0.0, 0.0, -0.1), label="lower")
    scene.attach("upper", kind="weld", label="hook")
    top = large.vertices[:, 2] > 0.049
    scene.attach("lower", "upper", vertices=top, label="weld")
    sim = wc.Simulation(scene)
    assert "explicit" in sim.summary()
    for _ in sim.frames(90):
        pass
    weight = G * 1000.0 * large.volume
    # What is left of the swing.
    assert sim.attachment_force("weld")[2] == pytest.approx(weight, rel=0.02)
    assert sim.attachment_force("hook")[2] == pytest.approx(2.0 * weight, rel=0.02)
    assert np.abs(sim.positions("lower")[top][:, 2] + 0.05).max() < 1e-6


def test_points_that_stay_apart_are_counted_as_not_solved(monkeypatch):
    sim = scene_of(0, limit=10.0)
    assert max(sim.measure().unsolved for _ in sim.frames(3)) == 0
    monkeypatch.setattr(ties, "ROUNDS", 0)  # nothing is held
    other = scene_of(0, limit=10.0)
    other.step_frame()
    assert other.measure().unsolved > 0


REFUSED = [
    ({"kind": "glue"}, "kind 'glue': give 'weld' or 'ball'"),
    ({"kind": "ball"}, "at None: give finite numbers"),
    ({"a": "nobody", "at": (0, 0, 0), "kind": "ball"}, "body 'nobody': give a body of this scene"),
    ({"b": "die", "kind": "ball", "at": (0, 0, 0)}, "a body cannot be attached to itself"),
    ({"b": "far", "kind": "ball", "at": (0, 0, 0)}, "bodies of worlds 0 and 1 do not meet"),
    ({"a": "soft"}, "body 'soft' deforms: name its vertices"),
    ({"b": "soft"}, "body 'soft' deforms: name its vertices"),
    ({"a": "soft", "kind": "hinge", "at": (0, 0, 0), "axis": (1, 0, 0)}, "a hinge takes rigid"),
    ({"kind": "hinge", "at": (0, 0, 0)}, "axis None: give finite numbers"),
    ({"kind": "slider", "at": (0, 0, 0), "axis": (0, 0, 0)}, "not all zero"),
    ({"axis": (1, 0, 0)}, "axis .*: give none for a weld"),
    ({"a": "soft", "vertices": [0, 1]}, "three vertices or more that are not on a line, and has 2"),
    ({"a": "soft", "vertices": np.zeros(27, dtype=bool)}, "on a line, and has 0"),
    ({"a": "soft", "vertices": [0, 1, 2]}, "three vertices or more that are not on a line"),
    ({"a": "soft", "vertices": [0, 99, 2]}, "vertices of body 'soft' .*names vertex 99"),
    ({"a": "soft", "vertices": [0, 1], "kind": "ball"}, "a ball holds one vertex, not 2"),
    ({"a": "soft", "kind": "ball", "at": (9, 0, 0)}, r"point \[9. 0. 0.\] is not in body 'soft'"),
    ({"stiffness": 0.0}, "stiffness 0.0"),
    ({"breaking_force": -1.0}, "breaking_force -1.0"),
    ({"a": "table"}, "all that it would hold is fixed"),
    ({"label": "one"}, "attachment 'one': another one has this label"),
    ({"label": ""}, "label ''"),
]


@pytest.mark.parametrize(("given", "message"), REFUSED, ids=str)
def test_what_holds_nothing_is_refused_and_named(given, message):
    scene = wc.Scene()
    scene.add_body(DIE, SOLID, label="die")
    scene.add_body(wc.box(0.1, 2), SOFT, (0.0, 0.0, 0.2), label="soft")
    scene.add_body(DIE, SOLID, (0.0, 0.0, 0.5), label="far", world=1)
    scene.add_body(DIE, SOFT, (0.0, 0.0, -0.5), label="table", fixed=True)
    scene.attach("die", label="one")
    if given.get("a") == "table":
        given = given | {"vertices": np.arange(10)}
    with pytest.raises(ValueError, match=message) as caught:
        scene.attach(**{"a": "die"} | given)
    assert "attachment" in str(caught.value) or "label" in str(caught.value)
    assert len(scene.attachments) == 1


def test_explicit_steps_and_too_many_points_are_refused():
    scene = wc.Scene()
    mesh = wc.box(0.1, 7)
    for k in range(2):
        scene.add_body(mesh, SOFT, (0.0, 0.0, 0.1 * k), label=f"body{k}")
    scene.attach("body1", "body0", vertices=mesh.vertices[:, 2] < -0.0499, label="glue")
    with pytest.raises(ValueError, match="attachment 'glue' needs implicit steps: take integrator"):
        wc.Simulation(scene)
    assert "attachment 'glue' needs them" in wc.Simulation(scene, integrator="auto").summary()
    more = wc.Scene()
    for k in range(2):
        more.add_body(mesh, SOFT, (0.0, 0.0, 0.1 * k), label=f"body{k}")
    more.attach("body1", vertices=np.arange(300), label="all")
    with pytest.raises(ValueError, match="'all': 300 points hang together, more than 256"):
        wc.Simulation(more, integrator="implicit")


def test_no_attachment_of_another_name_is_known():
    sim = scene_of(0)
    for call in (sim.attachment_force, sim.is_attached, sim.detach):
        with pytest.raises(ValueError, match="no attachment 'glue': the scene has pin0, hook0"):
            call("glue")
        with pytest.raises(ValueError, match="attachment 3: give an attachment or its label"):
            call(3)
