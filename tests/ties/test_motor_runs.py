"""Motors in a run: worlds, what begins anew, several on a body, and when they are switched off."""

import numpy as np
import pytest

import warp_contact as wc

BOX, SOLID = wc.box(0.1, 1), wc.Rigid(1000.0)
NONE = (0.0, 0.0, 0.0)


def dragged(*speeds: float) -> wc.Simulation:
    """In each world a motor drags a body over rough ground; one beside it flies at a speed."""
    scene = wc.Scene(friction=0.5, gravity=(0.0, 0.0, -5.0))
    ground = wc.box((0.8, 0.2, 0.1), (2, 1, 1))
    for speed in speeds:
        world = int(speed)
        scene.add_body(ground, SOLID, (0.2, 0.0, -0.1), fixed=True, world=world)
        low = scene.add_body(BOX, SOLID, world=world, label=f"low{world}")
        rod = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.2), world=world)
        x, z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
        scene.attach(rod, kind="slider", at=(0.0, 0.0, 0.2), axis=x, label=f"motor{world}")
        scene.attach(low, rod, kind="slider", at=NONE, axis=z)
        flies = {"position": (0.0, 1.0, 1.0), "velocity": (0.0, 0.0, speed)}
        scene.add_body(wc.box(0.03, 1), SOLID, world=world, **flies)
    sim = wc.Simulation(scene)
    for speed in speeds:
        sim.set_motor(f"motor{int(speed)}", 0.2, 50.0)
    return sim


def test_motors_of_a_world_do_not_feel_how_many_steps_others_take():
    alone, both = dragged(0.0), dragged(0.0, 30.0)
    for sim in alone, both:
        for _ in sim.frames(4):
            pass
    assert both.substeps > alone.substeps
    np.testing.assert_array_equal(both.positions("low0"), alone.positions("low0"))
    assert both.motor_force("motor0") == alone.motor_force("motor0") > 1.0


def thrown(*worlds: int) -> wc.Simulation:
    """In each world a slider, and a small body on a hinge of what it leads."""
    scene = wc.Scene(gravity=NONE)
    for world in worlds:
        a = scene.add_body(BOX, SOLID, world=world)
        b = scene.add_body(wc.box(0.02, 1), SOLID, (0.2, 0.0, 0.0), world=world)
        scene.attach(a, kind="slider", at=NONE, axis=(1.0, 0.0, 0.0), label=f"slider{world}")
        place = {"at": (0.15, 0.0, 0.0), "axis": (0.0, 0.0, 1.0)}
        scene.attach(b, a, kind="hinge", label=f"hinge{world}", **place)
    return wc.Simulation(scene)


def test_steps_are_as_short_for_a_motor_whatever_others_do_to_its_body():
    one, both = thrown(0), thrown(0)
    one.set_motor("slider0", 20.0, 1e3)
    both.set_motor("slider0", 20.0, 1e3)
    both.set_motor("hinge0", 0.0, 1e3)
    one.step_frame()
    both.step_frame()
    assert both.substeps == one.substeps > 4


@pytest.mark.parametrize("end", ["reset", "detach", "off"])
def test_what_no_motor_leads_any_more_asks_for_no_short_steps(end):
    sim, fresh = thrown(0, 1), thrown(0, 1)
    sim.set_motor("slider0", 20.0, 1e-6)
    sim.step_frame()
    assert sim.substeps > 4
    if end == "reset":
        sim.reset([0])
    elif end == "detach":
        sim.detach("slider0")
    else:
        sim.set_motor("slider0", 20.0, 0.0)
    sim.step_frame()
    fresh.step_frame()
    assert sim.substeps == fresh.substeps == 4


def test_the_force_of_the_last_frame_is_there_when_motors_are_switched_off():
    sim = dragged(0.0)
    for _ in sim.frames(3):
        pass
    force = sim.motor_force("motor0")
    sim.set_motor("motor0", 0.0, 0.0)
    assert sim.motor_force("motor0") == force > 1.0
    sim.step_frame()
    assert sim.motor_force("motor0") == 0.0


def test_the_force_of_an_arm_asleep_is_that_of_its_last_frame_awake():
    scene = wc.Scene()
    scene.add_body(BOX, SOLID)
    held = scene.attach(0, kind="hinge", at=(0.03, 0.0, 0.1), axis=(0.0, 1.0, 0.0))
    scene.add_body(BOX, SOLID, (0.0, 0.0, 50.0), world=1)  # it falls on
    sim = wc.Simulation(scene, sleeping=True)
    sim.set_motor(held, 0.0, 10.0)
    torque = [sim.motor_force(held) for _ in sim.frames(45)]
    assert sim._stepper.sleeping.awake.bodies.numpy().tolist() == [0, 1]
    np.testing.assert_allclose(torque[-1], 0.03 * 9.81, rtol=2e-3)
    assert torque[-1] == torque[-2]


@pytest.mark.parametrize(
    "response", [wc.Penalty(1e4, 10.0), wc.VirtualSurface(1e4, 10.0), wc.PredictedForce()], ids=str
)
def test_other_responses_let_motors_act_too(response):
    scene = wc.Scene(gravity=NONE)
    wall = scene.add_body(BOX, SOLID, (0.12, 0.0, 0.0), fixed=True)
    scene.add_body(BOX, SOLID)
    held = scene.attach(1, kind="slider", at=NONE, axis=(1.0, 0.0, 0.0))
    sim = wc.Simulation(scene, response)
    sim.set_motor(held, 0.3, 5.0)
    for _ in sim.frames(60):
        pass
    assert sim.motor_force(held) == pytest.approx(5.0, rel=1e-3)
    assert sim.force_on(wall)[0] == pytest.approx(5.0, rel=0.02)
