"""step_bounds.py: the number of steps in a frame, and what makes a frame be repeated."""

import math

import numpy as np
import pytest

from warp_contact import (
    NeoHookean,
    Penalty,
    Rigid,
    Scene,
    Simulation,
    SimulationError,
    VirtualSurface,
    box,
)
from warp_contact.frame import step_bounds
from warp_contact.frame.damping import RATE_MARGIN
from warp_contact.frame.diagnosis import flattest_tet

OMEGA = 1000.0  # [1/s]
# As promised in warp_contact/README.md: 0.6 of the stable step, a quarter of the thinnest body, a
# tenth of an edge or a fortieth, which take twice the stable number of steps at most.
STABLE = OMEGA / (2.0 * 0.6)  # steps [1/s] of a body that does not move
REACH, TRAVEL, LINGERING, PATIENCE = 0.25, 0.1, 0.025, 2.0
THICKNESS, EDGE = 0.1, 0.02  # [m]


def steps(speed: float, thickness: float = THICKNESS, overlaps: bool = False) -> float:
    return step_bounds.steps_per_second(OMEGA, speed, thickness, EDGE, overlaps)


def test_each_limit_sets_the_steps_where_it_is_the_tightest():
    assert steps(0.0) == STABLE
    for travel, overlaps in ((TRAVEL, False), (LINGERING, True)):
        fast = 1.5 * STABLE * travel * EDGE
        assert steps(fast, overlaps=overlaps) == pytest.approx(1.5 * STABLE)
        assert steps(2.0 * fast, overlaps=overlaps) == PATIENCE * STABLE
    assert steps(fast, thickness=1e-4) == pytest.approx(fast / (REACH * 1e-4))


def test_more_speed_never_takes_fewer_steps():
    wanted = [steps(0.01 * 2.0**k) for k in range(20)]
    assert wanted == sorted(wanted)
    assert steps(0.02 * 2.0**20) == pytest.approx(2.0 * steps(0.01 * 2.0**20))


def test_a_frame_has_a_step_and_hardly_fewer_than_the_last():
    assert step_bounds.steps_in_frame(0.0, 60.0, 0) == 1
    assert step_bounds.steps_in_frame(601.0, 60.0, 0) == 11
    assert step_bounds.steps_in_frame(601.0, 60.0, 100) == 90
    assert step_bounds.steps_in_frame(60.0 * 200, 60.0, 100) == 200


def test_a_penalty_adds_the_highest_frequency_of_masses_that_it_joins_in_a_row():
    stiffness, mass = 500.0, 1e-3
    shift = np.roll(np.eye(8), 1, axis=0)
    ring = stiffness / mass * (2.0 * np.eye(8) - shift - shift.T)
    highest = math.sqrt(np.linalg.eigvalsh(ring)[-1])
    assert step_bounds.with_penalty(0.0, stiffness, 0.0, 1.0 / mass) == pytest.approx(highest)
    assert step_bounds.with_penalty(OMEGA, stiffness, 9.0, 0.0) == OMEGA
    # A step below half of 1 / (damping inv_mass).
    dt = 2.0 * step_bounds.SAFETY / step_bounds.with_penalty(0.0, 1e-3, 50.0, 1.0 / mass)
    assert dt * 50.0 / mass == pytest.approx(0.6)


def test_a_step_is_refused_before_it_is_unstable():
    def stable(part: float, omega: float = OMEGA) -> bool:
        return step_bounds.stays_stable(part * 2.0 / OMEGA, omega)

    assert not stable(0.9999) and stable(0.97)
    assert not stable(1e-3, math.inf) and not stable(1e-3, math.nan)


def test_a_frame_is_repeated_with_a_higher_frequency_but_not_that_of_an_explosion():
    dt, most = 1.2 / 100.0, step_bounds.EXPLODED
    assert step_bounds.raised((100.0, 90.0), (50.0, 3.0), dt) == (100.0 * step_bounds.RAISED, 90.0)
    assert step_bounds.raised((100.0, 90.0), (50.0, 3.0), dt, 2.0) == (200.0, 90.0)
    assert step_bounds.raised((100.0, 90.0), (250.0, 99.0), dt) == (250.0, 99.0)
    assert step_bounds.raised((100.0, 90.0), (1e9, 1e9), dt) == (100.0 * most, 90.0 * most**2)
    # A step that was shorter than the frequency asked for, without damping at the start.
    assert step_bounds.raised((1.0, 0.0), (1e9, 1e9), dt) == pytest.approx(
        (100.0 * most, most**2 / dt)
    )


def test_a_frame_keeps_its_stages_until_the_margin_of_the_damping_is_used_up():
    dt = 1e-3
    rate = 4.0 / (RATE_MARGIN * dt)
    assert step_bounds.stays_damped(dt, rate, 0.999 * RATE_MARGIN * rate)
    assert not step_bounds.stays_damped(dt, rate, 1.03 * RATE_MARGIN * rate)  # rounded up by 2 %
    assert step_bounds.stays_damped(dt, 0.0, 0.0)


def test_a_step_that_the_user_chose_is_refused_where_it_is_unstable_or_jumps_through():
    def fault(dt, speed):
        return step_bounds.fault(dt, OMEGA, speed, THICKNESS)

    stable, still, fast = 2.0 / OMEGA, 0.0, 0.6 * THICKNESS * OMEGA  # with 0.68 some pass
    assert "unstable" in fault(1.06 * stable, still) and not fault(1.04 * stable, still)
    assert "thinnest body" in fault(1.01 / OMEGA, fast) and not fault(0.99 / OMEGA, fast)


def test_nothing_moves_by_more_than_a_quarter_of_the_thinnest_body():
    """The steps of a simulation, for plates of which one comes faster than the other."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for z, v in ((-3.0, 80.0), (3.0, -10.0)):
        plate = box((1.0, 1.0, 0.02), (4, 4, 1))
        scene.add_body(plate, NeoHookean(1e4, 0.3, 1000.0), (0.0, 0.0, z), velocity=(0.0, 0.0, v))
    sim = Simulation(scene)
    sim.step_frame()
    way = 90.0 / (sim.fps * sim.substeps)
    thickness = 2.0 * 0.02 / (2.0 + 4.0 * 0.02)  # twice the volume over the surface
    # No more than one step in hundreds is added to make them a whole number.
    assert 0.99 * 0.25 * thickness < way <= 0.25 * thickness


def test_a_body_that_begins_to_fall_makes_no_step_longer_than_others():
    """From rest, in frames so long that it ends them at a speed that matters."""
    scene = Scene()
    scene.add_body(box(0.1, 2), NeoHookean(1e3, 0.3, 1000.0))
    sim = Simulation(scene, fps=1)
    sim.step_frame()
    way = 9.81 / sim.substeps
    assert way <= 0.25 * 2.0 * 0.1**3 / (6.0 * 0.1**2)


@pytest.mark.parametrize("response", [Penalty(500.0), VirtualSurface(1000.0)])
def test_a_penalty_is_stable_on_the_lightest_vertex(response):
    """Of a light block, which presses on a heavy one."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for density, z in ((1e4, 0.0), (10.0, 0.1 - 0.002)):
        scene.add_body(box(0.1, 2), NeoHookean(1e3, 0.3, density), (0.0, 0.0, z))
    sim = Simulation(scene, response)
    sim.step_frame()
    light = sim.model.mass.numpy()[27:].min()
    # Of masses that penalties join in a row, the fastest mode has 2 sqrt(k / m).
    assert 2.0 * math.sqrt(500.0 / light) / (sim.fps * sim.substeps) < 2.0
    assert response.steepness == 500.0


def test_bodies_of_other_worlds_are_not_fast_against_each_other():
    def sim(*worlds):
        scene = Scene(gravity=(0.0, 0.0, 0.0))
        for k, world in enumerate(worlds):
            v = (20.0 * (-1.0) ** k, 0.0, 0.0)
            rubber = NeoHookean(1e5, 0.3, 1000.0)
            scene.add_body(box(0.05, 3), rubber, (k, 0.0, 0.0), velocity=v, world=world)
        return Simulation(scene, substeps=64)

    sim(0, 1).step_frame()
    with pytest.raises(SimulationError, match=r"substeps=64 is too few: bodies move 0\.0104 m"):
        sim(0, 0).step_frame()


@pytest.mark.parametrize(
    ("density", "speed", "words"),
    [
        (0.01, 0.0, "body 'block' vibrates at .* check density"),
        (1000.0, 1e5, "body 'block' moves at up to .* check its velocity"),
    ],
)
def test_a_frame_that_would_take_for_ever_ends_the_run_with_its_reason(density, speed, words):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    soft = NeoHookean(1e5, 0.3, 1000.0)
    scene.add_body(box(0.1, 2), soft, (1.0, 0.0, 0.0), label="other")
    material = NeoHookean(1e5, 0.3, density)
    scene.add_body(box(0.1, 2), material, velocity=(-speed, 0.0, 0.0), label="block")
    sim = Simulation(scene, max_substeps=2000)
    with pytest.raises(SimulationError, match=f"frame 1 needs .* max_substeps=2000: {words}"):
        sim.step_frame()
    assert sim.frame == 0
    with pytest.raises(ValueError, match="max_substeps 0: give a whole number"):
        Simulation(scene, max_substeps=0)


def test_flat_tets_of_what_does_not_deform_are_no_reason_of_an_end():
    def flattest(*others) -> str:
        scene, sheet = Scene(), box((0.1, 0.1, 1e-4), 1)
        scene.add_body(sheet, Rigid(1000.0), (0.0, 0.0, 0.3), label="sheet")
        for k, fixed in enumerate(others):
            mesh = sheet if fixed else box(0.1, 1)
            scene.add_body(mesh, NeoHookean(1e5, 0.3, 1000.0), (k, 0, 0), fixed=fixed, label=str(k))
        sim = Simulation(scene)
        return flattest_tet(sim.model, sim.state.x)

    assert flattest().startswith("body 'sheet', tet ")
    assert flattest(True, False).startswith("body '1', tet ")
