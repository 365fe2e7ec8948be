"""stepper.py: frames that are repeated, and looks at the step within those with flat tets."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, SimulationError, box
from warp_contact.data.overflow import Capacity
from warp_contact.data.work import allocate_work
from warp_contact.frame import overlap, step_bounds, stepper
from warp_contact.frame.buffers import Buffers

DRY = NeoHookean(1e5, 0.3, 1000.0)  # without damping


def let_go(size: float, **options) -> Simulation:
    """A free block at ``size`` of its lengths, before its first frame."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    mesh = box(0.1, 2)
    scene.add_body(mesh, DRY)
    sim = Simulation(scene, fps=200, **options)
    sim.set_positions(0, size * mesh.vertices)
    return sim


@pytest.fixture
def looks(monkeypatch):
    """A frame of a run, looked at every ``part`` steps: what was found.

    What the second look finds, the first after the start, goes through ``second``.
    """

    def step(sim: Simulation, part: int, second=lambda found: found) -> list:
        rates, found = sim._stepper.spectrum.rates, []

        def look(x, of=None):
            found.append(tuple(rates(x, of)[:, 0].tolist()))
            now = second(found[-1]) if len(found) == 2 else found[-1]
            return np.array(now)[:, None]

        with monkeypatch.context() as patch:
            patch.setattr(sim._stepper.spectrum, "rates", look)
            patch.setattr(stepper, "PART", part)
            sim.step_frame()
        return found

    return step


def held(material: NeoHookean, fps: float) -> tuple[Simulation, np.ndarray]:
    """A block of edge 0.1 held at two faces, body 0, and the vertices of the upper one."""
    mesh = box(0.1, 3)
    z = mesh.vertices[:, 2]
    top, low = np.flatnonzero(z > 0.049), np.flatnonzero(z < -0.049)
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(mesh, material, fixed=np.r_[top, low])
    return Simulation(scene, fps=fps), top


def pressed(damping: float) -> Simulation:
    """A block that was driven from three tenths of its height to a twentieth in its first frame."""
    sim, top = held(NeoHookean(1e6, 0.45, 1000.0, damping), 60.0)
    sim.set_positions(0, sim.positions(0) * [1.0, 1.0, 0.3])
    sim.set_velocity(0, (0.0, 0.0, -0.025 * sim.fps), top)
    sim.step_frame()
    sim.set_velocity(0, (0.0, 0.0, 0.0), top)
    return sim


def test_a_frame_that_blows_up_is_tried_again_with_shorter_steps(monkeypatch):
    def pull() -> Simulation:  # to three lengths in one frame, stiffer than its start tells
        sim, top = held(NeoHookean(1e6, 0.45, 1000.0), 1.0)
        sim.set_velocity(0, (0.0, 0.0, 0.2), top)
        sim.step_frame()
        return sim

    sim = pull()
    assert np.isfinite(sim.positions()).all() and sim.measure().volume_ratio > 0.0
    monkeypatch.setattr(stepper, "HALVED", 0)
    with pytest.raises(SimulationError, match=r"body0', vertex \d+ is no longer"):
        pull()


def test_the_steps_of_other_worlds_stay_as_they_are():
    """One is pulled until it blows up, and takes twice as many steps."""

    def run(neighbours: int) -> Simulation:
        scene, mesh = Scene(gravity=(0.0, 0.0, 0.0)), box(0.1, 3)
        z = mesh.vertices[:, 2]
        for _ in range(neighbours):
            scene.add_body(mesh, NeoHookean(1e6, 0.45, 1000.0), fixed=abs(z) > 0.049, world=1)
        for k in range(2):
            place, velocity = (0.0, 0.0, 0.11 * k), (0.0, 0.0, -0.1 * k)
            scene.add_body(box(0.1, 2), DRY, place, velocity=velocity)
        sim = Simulation(scene, fps=1.0)
        for body in range(neighbours):
            sim.set_velocity(body, (0.0, 0.0, 0.2), np.flatnonzero(z > 0.049))
        sim.step_frame()
        return sim

    beside, alone = run(1), run(0)
    n = len(alone.positions())
    np.testing.assert_array_equal(beside.positions()[-n:], alone.positions())
    np.testing.assert_array_equal(beside.velocities()[-n:], alone.velocities())


@pytest.mark.parametrize("times", [1, 4])
def test_so_is_one_whose_end_has_no_finite_stiffness(monkeypatch, times):
    sim, other = let_go(0.9), let_go(0.9)
    sim.step_frame()
    for _ in other.frames(2):
        pass
    ends = [np.full((2, 1), np.inf)] * times
    rates = sim._stepper.spectrum.rates
    monkeypatch.setattr(
        sim._stepper.spectrum, "rates", lambda x, of=None: ends.pop() if ends else rates(x)
    )
    if times > stepper.HALVED:
        with pytest.raises(SimulationError, match=r"frame 2: stiffness .* flattest is body 'bo"):
            sim.step_frame()
        assert sim.frame == 1
        return
    sim.step_frame()
    # Twice the rates, to a whole number of steps.
    assert 2 * other.substeps - 1 <= sim.substeps <= 2 * other.substeps


def test_looks_within_a_frame_change_nothing_where_its_steps_do(looks):
    often, once = let_go(0.5), let_go(0.5)
    found = looks(often, 3)
    assert len(found) == 1 + -(-often.substeps // 3) > 2
    assert len(looks(once, 1000)) == 2  # the start and the end
    np.testing.assert_array_equal(often.positions(), once.positions())
    np.testing.assert_array_equal(often.velocities(), once.velocities())


def test_there_are_none_where_no_tet_is_flat_or_the_steps_are_fixed(looks):
    assert len(looks(let_go(0.7), 3)) == 2
    assert len(looks(let_go(0.5, substeps=20), 3)) == 2


def test_a_frame_that_ends_flat_is_done_again_with_looks(looks):
    sim = let_go(0.7)
    sim.set_velocity(0, -100.0 * sim.positions(0))  # within a frame to about half of its lengths
    found = looks(sim, 1)
    assert sim._stepper.spectrum.flat
    assert len(found) >= 2 + sim.substeps


def test_a_step_that_is_too_long_within_a_frame_cuts_it_short_and_repeats_it(looks):
    sim = let_go(0.5)
    found = looks(sim, 3, lambda found: (1e9, found[1]))
    assert len(found) == 2 + -(-sim.substeps // 3)  # the start, the one too long, the repeat
    usual, same = let_go(0.5), let_go(0.5, substeps=sim.substeps)
    usual.step_frame()
    same.step_frame()
    assert sim.substeps > 2 * usual.substeps
    np.testing.assert_array_equal(sim.positions(), same.positions())


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_a_block_is_pressed_flat_within_a_frame(damping):
    sim = pressed(damping)
    assert 0.0 < sim.measure().volume_ratio < 0.05  # J of its mean is 0.05
    assert sim.substeps < 10_000  # some 900 to 2000; those of an exploded state were 266 469


def test_a_run_with_flat_tets_goes_on_from_its_checkpoint_with_the_same_bits(tmp_path):
    through = pressed(0.0)  # it goes on to vibrate: every look finds other rates
    through.save(tmp_path / "flat")
    later, _ = held(NeoHookean(1e6, 0.45, 1000.0), 60.0)
    later.load(tmp_path / "flat")
    for sim in (through, later):
        for _ in sim.frames(2):
            assert sim._stepper.spectrum.flat
    np.testing.assert_array_equal(through.positions(), later.positions())
    np.testing.assert_array_equal(through.velocities(), later.velocities())
    one, other = through._stepper.last.values(), later._stepper.last.values()
    assert all((one[name] == other[name]).all() for name in one)


def test_buffers_outgrown_within_a_frame_end_it_at_once(looks, monkeypatch):
    sim, calm = let_go(0.5), let_go(0.5)
    expected = looks(calm, 3)
    enlarged, asked = stepper.enlarged, []

    def outgrown(work):
        asked.append(len(asked))
        if len(asked) == 2:  # first after the look for overlaps at the start, then after a part
            work.overflow.all.fill_(work.capacity.contacts + 1)
        return enlarged(work)

    monkeypatch.setattr(stepper, "enlarged", outgrown)
    # One more, at what the outgrown buffers left: it may have exploded, then nothing grows.
    assert looks(sim, 3) == expected[:2] + expected[1:]
    assert sim._stepper.work.capacity.contacts > calm._stepper.work.capacity.contacts
    np.testing.assert_array_equal(sim.positions(), calm.positions())


@pytest.mark.parametrize("damping", [3e-4, 1e-3])
def test_a_block_that_vibrates_loses_its_energy_at_the_rate_of_its_damping(damping):
    scene, mesh = Scene(gravity=(0.0, 0.0, 0.0)), box(0.1, 3)
    scene.add_body(mesh, NeoHookean(1e5, 0.0, 1000.0, damping))
    sim = Simulation(scene, fps=500)
    sim.set_positions(0, mesh.vertices * [1.02, 1.0, 1.0])
    energy = [sim.measure().energy for _ in sim.frames(25)]
    # The first mode of a bar at 10 m/s of sound, of which the others have gone after five frames.
    rate = damping * (np.pi * 10.0 / 0.1) ** 2
    t = np.arange(25) / sim.fps
    found = -np.polyfit(t[5:], np.log(energy[5:]), 1)[0]
    assert found == pytest.approx(rate, rel=0.15)  # three cells, and a step of a tenth of the time


def test_damping_that_grows_within_a_frame_does_not_outrun_its_stages():
    """A block is drawn to four lengths: its largest rate is then some 16 times as high."""
    sim, top = held(NeoHookean(1e4, 0.3, 1000.0, 0.05), 10.0)
    sim.set_velocity(0, (0.0, 0.0, 3.0), top)
    before = sim._stepper.spectrum.damping_rate(sim.state.x)
    sim.step_frame()
    now = sim.measure()
    assert sim._stepper.spectrum.damping_rate(sim.state.x) > 8.0 * before
    # It follows what draws it, at most as fast, and no tet turns over.
    assert np.abs(sim.velocities()).max() < 1.01 * 3.0 and now.volume_ratio > 0.5


def stack() -> Scene:
    """Blocks that fall onto each other, so that a frame has many steps."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(3):
        place = (0.0, 0.0, 0.05 + 0.11 * k)
        scene.add_body(box(0.1, 2), NeoHookean(1e5, 0.3, 1000.0, 1e-3), place)
    return scene


@pytest.mark.parametrize("sleeping", [False, True])
def test_a_frame_that_is_interrupted_anywhere_has_not_begun(rng, monkeypatch, sleeping):
    interrupted, whole = (Simulation(stack(), sleeping=sleeping) for _ in range(2))
    launch, left = wp.capture_launch, [10**9]

    def stops(graph) -> None:
        launch(graph)
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(wp, "capture_launch", stops)
    for _ in range(6):
        left[0] = 10**9
        before = interrupted.positions(), interrupted.velocities(), interrupted.measure().forces
        left[0] = int(rng.integers(0, 3))  # the steps, or a graph of the rates
        try:
            interrupted.step_frame()
        except KeyboardInterrupt:
            assert interrupted.frame == whole.frame
            np.testing.assert_array_equal(interrupted.positions(), before[0])
            np.testing.assert_array_equal(interrupted.velocities(), before[1])
            assert interrupted.measure().forces == before[2]
            left[0] = 10**9
            interrupted.step_frame()
        left[0] = 10**9
        whole.step_frame()
        np.testing.assert_array_equal(interrupted.positions(), whole.positions())
        np.testing.assert_array_equal(interrupted.velocities(), whole.velocities())
        assert interrupted.substeps == whole.substeps


def test_a_frame_that_explodes_is_repeated_before_its_buffers_grow(looks, monkeypatch):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for z in (0.0, 0.102):
        scene.add_body(box(0.1, 3), DRY, (0.0, 0.0, z), velocity=(0.0, 0.0, -20.0 * z))
    sim = Simulation(scene)
    tight = allocate_work(sim.model, sim.state, Capacity(contacts=1, verts=1, edges=1))
    sim._stepper.buffers.use(tight)
    done, raised, replaced = [], step_bounds.raised, Buffers.replace

    def remember(name, function):
        def call(*arguments):
            done.append(name)
            return function(*arguments)

        return call

    monkeypatch.setattr(step_bounds, "raised", remember("repeat", raised))
    monkeypatch.setattr(overlap, "overlaps", lambda *_: np.zeros(1, dtype=bool))
    monkeypatch.setattr(Buffers, "replace", remember("grow", replaced))
    looks(sim, 1000, lambda found: (100.0 * found[0], found[1]))  # as if it had exploded
    assert done[0] == "repeat" and "grow" in done
