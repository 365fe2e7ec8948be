"""Grippers of rigid fingers with soft pads that are welded to them, against the friction cone."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.data import launch

G = 9.81
RUBBER = wc.NeoHookean(2e5, 0.3, 1000.0, 2e-3)

PAD, FINGER = wc.box((0.01, 0.04, 0.04), (1, 3, 3)), wc.box((0.02, 0.04, 0.08), (1, 2, 4))
MASS = 1000.0 * 0.06**3


def gripper(friction: float, hand: bool = False) -> wc.Simulation:
    """A box between two soft pads on rigid fingers; with a ``hand`` these slide on it, pushed."""
    scene = wc.Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.box(0.06, 2), wc.Rigid(1000.0), (0.0, 0.0, 0.0301), label="box")
    if hand:
        bar = wc.box((0.2, 0.04, 0.02), (4, 1, 1))
        scene.add_body(bar, wc.Rigid(1000.0), (0.0, 0.0, 0.12), fixed=True, label="hand")
    for side, name in ((-1, "left"), (1, "right")):
        place = np.array([0.0505 * side, 0.0, 0.05])
        scene.add_body(FINGER, wc.Rigid(2000.0), place, fixed=not hand, label=f"{name} finger")
        scene.add_body(PAD, RUBBER, (0.0355 * side, 0.0, 0.03), label=f"{name} pad")
        back = side * PAD.vertices[:, 0] > 0.0049
        scene.attach(f"{name} pad", f"{name} finger", vertices=back, label=f"{name} weld")
        if hand:
            rail = {"at": place, "axis": (1.0, 0.0, 0.0), "label": f"{name} rail"}
            scene.attach(f"{name} finger", "hand", "slider", **rail)
    return wc.Simulation(scene)


def drive(sim: wc.Simulation, inwards: float, upwards: float, frames: int) -> None:
    """Move the fingers, the way that ``inwards`` and ``upwards`` [m/s] say."""
    for side, name in ((1.0, "left"), (-1.0, "right")):
        sim.set_velocity(f"{name} finger", (side * inwards, 0.0, upwards))
    for _ in sim.frames(frames):
        pass


@pytest.mark.parametrize(("friction", "holds"), [(0.5, True), (0.2, False)])
def test_a_gripper_lifts_what_its_friction_cone_holds(friction, holds):
    sim = gripper(friction)
    drive(sim, 0.006, 0.0, 6)
    drive(sim, 0.0, 0.0, 15)
    squeeze = sim.attachment_force("left weld")[0]
    # Two pads carry the weight where 2 mu N is more: here N is twice the weight.
    assert 1.8 * MASS * G < squeeze < 2.4 * MASS * G
    assert (2.0 * friction * squeeze > MASS * G) == holds
    drive(sim, 0.0, 0.1, 20)
    drive(sim, 0.0, 0.0, 15)
    z, moved = sim.pose("box")[0][2], 20 / 60 * 0.1
    if not holds:
        assert z < 0.0302  # it slipped out
        return
    # The pads shear by less than a millimetre; the box slips until it is as fast as they are.
    slip = 0.1**2 / (2.0 * (2.0 * friction * squeeze / MASS - G))
    assert 0.0301 + moved - 1e-3 - slip < z < 0.0301 + moved
    pads = sum(sim.attachment_force(f"{name} weld") for name in ("left", "right"))
    weight = MASS * G + 2.0 * 1000.0 * PAD.volume * G
    np.testing.assert_allclose(pads, [0.0, 0.0, weight], atol=5e-3 * weight)
    assert sim.measure().unsolved == 0


def push(sim: wc.Simulation, force: float, speeds) -> None:
    """Push the fingers inwards [N] while the hand goes up [m/s], a frame for each speed."""
    for speed in speeds:
        for side, name in ((1.0, "left"), (-1.0, "right")):
            sim.apply(f"{name} finger", (side * force, 0.0, 0.0))
        sim.set_velocity("hand", (0.0, 0.0, speed))
        sim.step_frame()


def test_fingers_pushed_by_a_force_hold_what_is_shaken_as_their_cone_says():
    force, friction = 4.0, 0.5
    most = 2.0 * friction * force / MASS - G  # [m/s^2] that it may be shaken by
    sim = gripper(friction, hand=True)
    push(sim, force, np.zeros(20))
    for side in ("left", "right"):  # no motion of the pads is left
        assert np.abs(sim.forces()["box", f"{side} pad"].normal[0]) == pytest.approx(
            force, rel=1e-3
        )
    push(sim, force, [0.004 * min(k, 20 - k) for k in range(20)])
    push(sim, force, np.zeros(15))
    lifted = 0.004 * 100 / 60
    assert sim.pose("box")[0][2] == pytest.approx(0.0301 + lifted, abs=5e-4)  # the pads shear
    rail = sim.attachment_force("left rail")
    carried = 0.5 * MASS * G + G * 1000.0 * (2.0 * FINGER.volume + PAD.volume)
    np.testing.assert_allclose(rail, [0.0, 0.0, carried], atol=5e-3 * carried)
    for shaken in (0.5 * most, 1.8 * most):
        before, w = sim.pose("box")[0][2] - sim.pose("hand")[0][2], 12.0 * np.pi
        push(sim, force, shaken / w * np.sin(w / 60 * np.arange(10)))
        slipped = before + sim.pose("hand")[0][2] - sim.pose("box")[0][2]
        # The speed of the hand changes in the first step of a frame: for that it is shaken harder.
        assert slipped < 3e-4 if shaken < most else slipped > 1e-3


def test_what_is_squeezed_without_friction_is_solved():
    """Light pads behind which a finger stands: by row sums of free ones it would take too long."""
    sim, unsolved = gripper(0.0), 0
    for inwards, frames in ((0.025, 6), (0.0, 14)):
        drive(sim, inwards, 0.0, 0)
        for _ in sim.frames(frames):
            unsolved += sim.measure().unsolved
    assert sim.measure().n_contacts > 10
    assert unsolved == 0


def test_threads_may_take_lists_of_ties_in_any_order(monkeypatch):
    def bits() -> list[bytes]:
        sim = gripper(0.4)
        drive(sim, 0.006, 0.0, 6)
        drive(sim, 0.0, 0.1, 3)
        assert sim.measure().n_contacts > 10
        return [sim.positions().tobytes(), sim.attachment_force("left weld").tobytes()]

    expected = bits()
    for threads in (5, 10**9):
        monkeypatch.setattr(launch, "ON_CPU", threads)
        assert bits() == expected
