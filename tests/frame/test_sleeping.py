"""sleeping.py: bodies at rest sleep, wake before anything touches them, and change little."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Penalty, Scene, Simulation, box

RUBBER = NeoHookean(3e4, 0.3, 1000.0, 1e-2)
EDGE = 0.05  # m, about that of the blocks
STILL = 2e-3  # edges that a body at rest may move, as promised in warp_contact/README.md


def tower(blocks: int = 2) -> Scene:
    """Blocks on each other, slightly apart, and one that is alone."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(blocks):
        scene.add_body(box(0.1, 2), RUBBER, (0.01 * (k % 2), 0.0, 0.0502 + 0.1004 * k))
    scene.add_body(box(0.1, 2), RUBBER, (1.0, 0.0, 0.0502), label="alone")
    return scene


def asleep(sim: Simulation) -> int:
    return int((sim._stepper.work.awake.bodies.numpy() == 0).sum())


def run(sim: Simulation, frames: int) -> Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


def settled(scene: Scene) -> Simulation:
    """A simulation of which all bodies have fallen asleep."""
    sim = Simulation(scene, sleeping=True)
    for _ in sim.frames(600):
        if asleep(sim) == len(scene.bodies):
            return sim
    raise AssertionError(f"{asleep(sim)} bodies asleep after 10 s")


def test_a_tower_falls_asleep_and_stays_what_it_was():
    sim = settled(tower())
    other = run(Simulation(tower()), sim.frame)
    # What it still moved when it fell asleep, both ways.
    assert np.abs(sim.positions() - other.positions()).max() < 2.0 * STILL * EDGE
    # A block's weight squeezes it by 0.03 of its edge, 15 times what may still move.
    expected = other.measure().forces
    assert sim.measure().forces == pytest.approx(expected, rel=0.02) and len(expected) == 3
    before = sim.positions(), sim.contact_fields()["pressure"]
    energy = sim.measure().energy
    run(sim, 5)
    np.testing.assert_array_equal(sim.positions(), before[0])
    np.testing.assert_array_equal(sim.contact_fields()["pressure"], before[1])
    assert sim.measure().energy == energy
    assert not sim.velocities().any()


def test_what_sleeps_wakes_before_it_is_hit():
    """On a plane without friction: the momentum along it is that of the block that comes."""

    def scene() -> Scene:
        scene = Scene(friction=0.0)
        scene.add_plane((0.0, 0.0, 1.0), 0.0)
        scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.0502))
        scene.add_body(box(0.1, 2), RUBBER, (-1.0, 0.0, 0.0502), velocity=(0.7, 0.0, 0.0))
        return scene

    sim, other = Simulation(scene(), sleeping=True), Simulation(scene())
    slept = 0
    for _ in range(90):  # it arrives after 1.3 s
        sim.step_frame()
        other.step_frame()
        slept = max(slept, asleep(sim))
    assert slept == 1 and asleep(sim) == 0
    assert sim.velocities(0).mean(axis=0)[0] > 0.3
    # Nothing is lost by its sleep: a vibration that stopped in it moves the impact of two faces
    # that meet flush by 2e-5 m, and a thousandth of the speed goes sideways.
    np.testing.assert_allclose(sim.positions(), other.positions(), atol=2e-4)
    assert sim.measure().momentum[0] == pytest.approx(0.7, rel=1e-5)  # 1 kg


def test_a_velocity_that_is_given_wakes_up_and_a_slow_press_is_not_stopped():
    scene = tower(1)
    press = scene.add_body(box(0.1, 1), RUBBER, (0.0, 0.0, 0.16), fixed=True)
    sim = run(Simulation(scene, sleeping=True), 60)
    assert asleep(sim) == 3
    slow = 0.5 * STILL * EDGE  # m/s: less in half a second than a body at rest may move
    sim.set_velocity(press, (0.0, 0.0, -slow))
    start = sim.positions(press)
    run(sim, 90)
    assert asleep(sim) == 2
    moved = (start - sim.positions(press))[:, 2]
    np.testing.assert_allclose(moved, 1.5 * slow, rtol=0.1)  # rounding in each step
    sim.set_velocity(0, (0.0, 0.0, 1e-9))
    run(sim, 1)
    assert asleep(sim) == 1


def test_a_velocity_wakes_its_body_however_small_it_is():
    """In steps so short that the weight of half of one is no motion either."""
    sim = Simulation(tower(1), sleeping=True, substeps=100)
    for _ in sim.frames(120):
        if asleep(sim) == 2:
            break
    assert asleep(sim) == 2
    sim.set_velocity(0, (0.0, 0.0, 1e-9))
    run(sim, 1)
    assert asleep(sim) == 1


def test_without_weight_nothing_sleeps():
    floating = Scene(gravity=(0.0, 0.0, 0.0))
    floating.add_body(box(0.1, 2), RUBBER, velocity=(1e-5, 0.0, 0.0))
    sim = run(Simulation(floating, sleeping=True), 60)
    assert asleep(sim) == 0 and sim.measure().momentum[0] == pytest.approx(1e-5, rel=1e-6)


def test_a_checkpoint_holds_who_sleeps(tmp_path):
    def scene() -> Scene:
        scene = tower(1)
        high = scene.add_body(box(0.1, 2), RUBBER, (0.02, 0.0, 0.5), velocity=(0.0, 0.0, 7.4))
        assert high.index == 2
        return scene

    sim = Simulation(scene(), sleeping=True)
    run(sim, 86)
    assert asleep(sim) == 2
    sim.save(tmp_path / "run.npz")
    later = Simulation(scene(), sleeping=True)
    later.load(tmp_path / "run.npz")
    assert later.measure().forces == sim.measure().forces != {}
    run(sim, 10), run(later, 10)  # it falls on one of them
    assert asleep(sim) == asleep(later) == 1
    np.testing.assert_array_equal(sim.positions(), later.positions())
    assert sim.measure().forces == later.measure().forces


def test_a_velocity_given_to_what_sleeps_is_in_the_checkpoint(tmp_path):
    sim = settled(tower(1))
    sim.set_velocity(0, (0.0, 0.0, 1.0))
    sim.save(tmp_path / "run.npz")
    later = Simulation(tower(1), sleeping=True)
    later.load(tmp_path / "run.npz")
    for a in (sim, later):
        run(a, 3)
        assert asleep(a) == 1
    np.testing.assert_array_equal(sim.positions(), later.positions())
    for name, field in sim.contact_fields().items():
        np.testing.assert_array_equal(field, later.contact_fields()[name], err_msg=name)
    assert sim.measure().n_contacts == later.measure().n_contacts


def test_a_floor_that_sleeps_feels_the_weight_of_every_frame():
    """It sleeps by itself, for it is fixed; what lies on it is about to come to rest."""
    scene = Scene()
    floor = scene.add_body(box((0.3, 0.3, 0.1), 2), RUBBER, fixed=True)
    scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.1002))
    sim = Simulation(scene, sleeping=True)
    run(sim, 34)
    assert asleep(sim) == 1
    ids = np.arange(len(scene.bodies[floor.index].x))
    for _ in sim.frames(3):
        pressed = sim._stepper.work.forces.received.numpy()[ids].sum(axis=0)
        np.testing.assert_allclose(pressed[2], -9.81 / 60, rtol=0.02)


def on_a_floor(**third) -> Simulation:
    """A fixed floor, a block that comes to rest on it, and a third body that does not."""
    scene = Scene()
    scene.add_body(box((1.3, 0.3, 0.1), (4, 1, 1)), RUBBER, fixed=True, label="floor")
    scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.1002), label="block")
    scene.add_body(box(0.1, 2), RUBBER, label="third", **third)
    return Simulation(scene, sleeping=True)


def test_the_force_on_a_floor_that_sleeps_is_that_of_one_frame():
    """It sleeps before what lies on it, and both before the third body has come back."""
    sim = on_a_floor(position=(3.0, 0.0, 0.5), velocity=(0.0, 0.0, 30.0))
    run(sim, 20)
    slept = set()
    for _ in sim.frames(30):
        slept.add(asleep(sim))
        # What is left of its swing.
        assert sim.measure().forces == {("floor", "block"): pytest.approx(9.81, rel=0.01)}
    assert slept == {0, 1, 2}


def test_a_fixed_floor_does_not_keep_awake_what_lies_on_it():
    sim = on_a_floor(position=(0.5, 0.0, 0.1002), velocity=(0.0, 0.0, 2.5))
    run(sim, 40)
    pressed = []
    for _ in sim.frames(10):
        assert sim._stepper.work.awake.bodies.numpy().tolist() == [0, 0, 1]
        pressed.append(("floor", "third") in sim.measure().forces)
    assert any(pressed)


def test_what_begins_to_fall_above_a_sleeper_wakes_it():
    """From rest, by its weight alone, over a gap that it closes within the frame."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.0502))
    scene.add_body(box(0.1, 2), RUBBER, (3.0, 0.0, 0.5), velocity=(0.0, 0.0, 30.0))
    sim = run(Simulation(scene, sleeping=True, fps=10), 12)
    assert asleep(sim) == 1
    x, v = sim.positions(), sim.velocities()
    above = box(0.1, 2).vertices + [0.0, 0.0, 0.1502 + 0.04]  # it falls by 0.049 m in a frame
    x[27:], v[27:] = above, 0.0
    sim.state.x.assign(x)
    sim.state.v.assign(v)
    run(sim, 1)
    assert asleep(sim) == 0
    assert sim.measure().overlap < 0.01 * EDGE
    # At 0.89 m/s onto an equal one.
    assert sim.velocities(0)[:, 2].mean() < -0.1


def test_what_sleeps_is_held():
    """A penalty holds it deep in the plane; asleep it has no contacts, and is none to be missed."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.048))
    sim = Simulation(scene, Penalty(500.0, 1.0), sleeping=True)
    for _ in sim.frames(90):
        now = sim.measure()
        assert now.unheld == 0
    assert asleep(sim) == 1 and now.n_contacts == 0
    assert now.overlap > 0.02 * EDGE  # twice what needs a contact


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_a_blow_that_is_passed_on_wakes_the_last_of_a_row(order):
    """The first hits the second, which reaches the third before the frame ends."""
    stiff = NeoHookean(3e6, 0.3, 1000.0, 1e-3)
    scene = Scene(friction=0.0)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    heavy = NeoHookean(3e6, 0.3, 8000.0, 1e-3)
    row = [(heavy, -0.115), (stiff, 0.0), (stiff, 0.2)]
    for k in order:
        material, x = row[k]
        scene.add_body(box(0.1, 2), material, (x, 0.0, 0.05002), label=f"block {k}")
    sim = Simulation(scene, fps=30, sleeping=True)
    for _ in sim.frames(200):
        if asleep(sim) == 3:
            break
    assert asleep(sim) == 3
    sim.set_velocity(order.index(0), (4.0, 0.0, 0.0))
    run(sim, 1)
    assert asleep(sim) == 0
    run(sim, 10)
    # Rounding, of 8 kg at 4 m/s.
    assert sim.measure().momentum[0] == pytest.approx(32.0, rel=1e-5)


@pytest.mark.parametrize("ascending", [True, False])
def test_a_push_at_one_end_of_a_row_wakes_it_to_the_other(ascending):
    """Of blocks that touch: none is near enough to the first but the second."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    places = np.arange(5) * 0.1002
    for x in places if ascending else places[::-1]:
        scene.add_body(box(0.1, 2), RUBBER, (x, 0.0, 0.0502))
    sim = settled(scene)
    sim.set_velocity(0 if ascending else 4, (0.1, 0.0, 0.0))
    run(sim, 1)
    assert asleep(sim) == 0


def test_a_buffer_that_grows_leaves_the_forces_of_those_asleep():
    sim = settled(tower(1))
    before = sim.measure().forces
    room = sim._stepper.work.capacity.pairs
    sim._stepper.work.overflow.all.fill_(room + 1)
    assert sim._stepper.grow() and sim._stepper.work.capacity.pairs > room
    assert sim.measure().forces == before != {}
