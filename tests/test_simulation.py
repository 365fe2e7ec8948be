"""simulation.py: closed forms, conservation, repeatability and errors of whole runs."""

import numpy as np
import pytest

from warp_contact import (
    ContactSurface,
    NeoHookean,
    Penalty,
    PredictedForce,
    Scene,
    Simulation,
    SimulationError,
    TetMesh,
    box,
    sphere,
)
from warp_contact.frame import stepper
from warp_contact.frame.buffers import Buffers

G = 9.81
SOFT = NeoHookean(2e4, 0.3, 1000.0, 1e-3)
DRY = NeoHookean(1e5, 0.3, 1000.0)  # without damping
RESPONSES = [
    pytest.param(ContactSurface(), id="balanced"),
    pytest.param(ContactSurface("literal"), id="literal"),
    pytest.param(Penalty(500.0), id="penalty"),
    pytest.param(PredictedForce(), id="predicted"),
]


def heap(friction: float = 0.3, order=(0, 1, 2), damping: float = 0.0) -> Scene:
    """Two blocks and a ball that meet at once."""
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    material = NeoHookean(1e5, 0.3, 1000.0, damping)
    bodies = (
        (box(0.1, 2), (0.0, 0.0, 0.0), (0.0, 0.1, 0.4)),
        (box(0.1, 3), (0.013, 0.021, 0.106), (0.1, 0.0, -0.4)),
        (sphere(0.05, 41), (0.112, 0.03, 0.05), (-0.5, 0.0, 0.0)),
    )
    for k in order:
        mesh, place, v = bodies[k]
        scene.add_body(mesh, material, place, velocity=v, label=f"body{k}")
    return scene


def run(scene: Scene, frames: int, **options) -> Simulation:
    sim = Simulation(scene, **options)
    for _ in sim.frames(frames):
        pass
    return sim


def met(sim: Simulation) -> bool:
    """Whether the first body has been hit: nothing else can change its momentum."""
    before = sim.scene.bodies[0].v.mean(axis=0)
    return bool(np.abs(sim.velocities(0).mean(axis=0) - before).max() > 0.01)


@pytest.mark.parametrize("response", RESPONSES)
def test_two_runs_agree_in_every_bit(response):
    one, two = (run(heap(damping=1e-3), 12, response=response) for _ in range(2))
    assert met(one)
    np.testing.assert_array_equal(one.positions(), two.positions())
    np.testing.assert_array_equal(one.velocities(), two.velocities())
    assert one.measure().forces == two.measure().forces


def test_the_order_of_the_bodies_does_not_matter():
    one = run(heap(damping=1e-3), 4)
    two = run(heap(damping=1e-3, order=(2, 0, 1)), 4)
    assert met(one) and met(two)
    for k, at in ((0, 1), (1, 2), (2, 0)):
        # Sums over contacts round in another order; then a contact comes or goes a step earlier:
        # some resting gaps, 5e-5 m. Bodies have moved by 0.03 m.
        np.testing.assert_allclose(one.positions(k), two.positions(at), atol=2e-4)


def test_worlds_do_not_touch_each_other():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for world in (0, 1):
        scene.add_body(box(0.1, 2), DRY, (0.02 * world, 0.0, 0.0), world=world)
    sim = run(scene, 3)
    # Nothing but the rounding of the internal forces.
    np.testing.assert_allclose(sim.velocities(), 0.0, atol=1e-4)
    assert sim.measure().n_contacts == 0 and sim.measure().overlap == 0.0


def test_copies_of_a_scene_in_two_worlds_move_alike():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for world in (0, 1):
        for z, v in ((0.0, 0.5), (0.105, -0.5)):
            scene.add_body(box(0.1, 2), DRY, (0.0, 0.0, z), velocity=(0.1, 0.0, v), world=world)
    sim = run(scene, 6)
    assert met(sim)
    for k in (0, 1):
        np.testing.assert_array_equal(sim.positions(k), sim.positions(k + 2))


def test_two_blocks_that_collide_keep_their_momentum_and_gain_no_energy():
    sim = Simulation(heap(), fps=240)
    begun = sim.measure()
    scale = 1.0 * sum(0.5 * b.material.density * b.mesh.volume for b in sim.scene.bodies)
    worst = touched = 0.0
    for _ in sim.frames(24):
        now = sim.measure()
        touched = max(touched, now.n_contacts)
        worst = max(worst, now.energy / begun.energy)
        # Against the momentum of half a metre per second.
        assert np.abs(now.momentum - begun.momentum).max() < 1e-6 * scale
    print(f"energy at most {worst:.4f} of that before")
    assert touched > 0 and worst < 1.01


def test_a_block_at_rest_presses_with_its_weight():
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(0.1, 2), NeoHookean(1e5, 0.3, 1000.0, 5e-3), (0.0, 0.0, 0.05), label="block")
    sim = run(scene, 90)
    forces = [sim.measure().forces["block", "plane0"] for _ in sim.frames(30)]
    # The mean over half a second of what is left of the motion.
    assert np.mean(forces) == pytest.approx(1000.0 * 0.1**3 * G, rel=1e-3)
    assert sim.measure().overlap < 1e-3 * 0.05


def test_a_tet_too_flat_for_any_step_is_named():
    f = 1e-6
    x = 0.1 * np.array([[0.577, 0, -f], [-0.289, 0.5, -f], [-0.289, -0.5, -f], [0.0, 0.0, 0.0]])
    scene = Scene()
    scene.add_body(box(0.1, 1), DRY, (1.0, 0.0, 0.0))
    scene.add_body(TetMesh(x, [[0, 1, 2, 3]]), DRY, label="sliver")
    with pytest.raises(ValueError, match="body 'sliver', tet 0 is too flat: rounding"):
        Simulation(scene)


def test_a_nan_stops_the_run_and_names_frame_and_body():
    sim = run(heap(), 2)
    x = sim.state.x.numpy()
    before = x.copy()
    x[30] = np.nan  # the first block has 27 vertices
    sim.state.x.assign(x)
    with pytest.raises(SimulationError, match=r"frame 3: body 'body1', vertex \d+ is no longer"):
        sim.step_frame()
    assert sim.frame == 2
    sim.state.x.assign(before)
    sim.step_frame()
    assert sim.frame == 3 and np.isfinite(sim.positions()).all()


def test_set_velocity_moves_pinned_vertices_and_leaves_them_to_nothing_else():
    scene = Scene(gravity=(0.0, 0.0, -G))
    pinned = np.flatnonzero(box(0.1, 2).vertices[:, 2] > 0.049)
    body = scene.add_body(box(0.1, 2), SOFT, fixed=pinned)
    sim = run(scene, 2)
    np.testing.assert_array_equal(sim.positions(body)[pinned], np.float32(body.x[pinned]))
    sim.set_velocity(body, (0.3, 0.0, 0.0), pinned)
    for _ in sim.frames(3):
        pass
    moved = sim.positions(body)[pinned] - body.x[pinned]
    # Rounding of some hundred steps.
    np.testing.assert_allclose(moved, [[0.3 * 3 / 60, 0.0, 0.0]] * len(pinned), atol=2e-6)
    np.testing.assert_array_equal(sim.velocities(body)[pinned], np.float32([[0.3, 0, 0]] * 9))


def test_set_velocity_of_one_body_leaves_the_others(rng):
    sim = Simulation(heap())
    before = sim.velocities()
    v = rng.normal(size=(3, 3)).astype(np.float32)
    sim.set_velocity(1, v, [0, 5, 7])
    np.testing.assert_array_equal(sim.velocities(1)[[0, 5, 7]], v)
    others = np.setdiff1d(np.arange(sim.model.n_vert), [27, 32, 34])
    np.testing.assert_array_equal(sim.velocities()[others], before[others])
    with pytest.raises(ValueError, match=r"velocity of body 'body1' .*: give finite numbers"):
        sim.set_velocity(1, (0.0, np.inf, 0.0))
    with pytest.raises(ValueError, match=r"velocity of body 'body1' .*: give .* shape \(1, 3\)"):
        sim.set_velocity(1, v[:2], [4])
    with pytest.raises(ValueError, match="there is no body -1"):
        sim.set_velocity(-1, v)
    with pytest.raises(ValueError, match="body 'alien' is of another scene"):
        sim.set_velocity(Scene().add_body(box(1.0, 1), DRY, label="alien"), v)


def test_frames_number_and_time_advance():
    sim = Simulation(heap(), fps=100)
    assert list(sim.frames(3)) == [1, 2, 3]
    assert sim.frame == 3 and sim.time == 0.03 and sim.substeps >= 1


def test_contact_fields_tell_who_touches_whom():
    sim = Simulation(heap(), fps=1000)
    while not (sim.measure().n_contacts and met(sim)):
        sim.step_frame()
    fields = sim.contact_fields()
    owner = sim.model.vert_body.numpy()
    touching = fields["partner"] >= 0
    assert touching.any() and not (fields["partner"][touching] == owner[touching]).any()
    assert (fields["penetration"][~touching] == 0.0).all()
    assert {a.shape[0] for a in fields.values()} == {sim.model.n_vert}
    assert (fields["pressure"] >= 0.0).all() and (fields["pressure"] > 0.0).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fps": 0}, "fps 0: give a number"),
        ({"fps": float("nan")}, "fps nan: give a number"),
        ({"fps": float("inf")}, "fps inf: give a number"),
        ({"substeps": 0}, "substeps 0: give a whole number"),
        ({"substeps": 1.5}, "substeps 1.5: give a whole number"),
        ({"device": "abacus"}, "unknown device 'abacus'; this machine has cpu"),
    ],
)
def test_options_that_make_no_run_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Simulation(heap(), **options)


def test_an_empty_scene_is_refused():
    with pytest.raises(ValueError, match="the scene has no body"):
        Simulation(Scene())


def test_without_memory_for_larger_buffers_the_last_frame_stays(monkeypatch):
    sim = Simulation(heap())
    for _ in sim.frames(2):
        pass
    x, measured = sim.positions(), sim.measure()
    allocate = Buffers._allocate

    def allocate_no_more(self, capacity):
        if capacity.contacts > 10_000:
            raise RuntimeError("no memory")
        return allocate(self, capacity)

    def outgrow(self, *rates):
        self._state.x.fill_(1.0)  # a frame that is not finished
        self.work.overflow.all.fill_(10_000)
        self._n, self._dt = np.array([1]), np.array([1.0])
        return np.zeros((2, 1)), ""

    with monkeypatch.context() as patch:
        patch.setattr(Buffers, "_allocate", allocate_no_more)
        patch.setattr(stepper.Stepper, "_run", outgrow)
        with pytest.raises(RuntimeError, match="no memory"):
            sim.step_frame()
    np.testing.assert_array_equal(sim.positions(), x)
    assert sim.measure().elastic == measured.elastic
    sim.step_frame()
    assert sim.frame == 3
