"""States that are lost are measured as numbers that are none, whatever bodies they hold."""

import numpy as np
import pytest

import warp_contact as wc

BLOCK = wc.box(0.1, 1)


def lost(material, value: float) -> wc.Simulation:
    """Two blocks of which the first has gone where ``value`` [m] says."""
    scene = wc.Scene()
    scene.add_body(BLOCK, material, label="lost")
    scene.add_body(BLOCK, wc.Rigid(1000.0), (0.0, 0.0, 0.15), label="other")
    sim = wc.Simulation(scene, integrator="implicit")
    sim.step_frame()
    x = sim.state.x.numpy()
    x[: len(BLOCK.vertices)] = value
    sim.state.x.assign(x)
    return sim


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("material", [wc.Rigid(1000.0), wc.NeoHookean(1e5, 0.3, 1000.0)])
def test_what_is_measured_of_a_state_that_is_not_finite_is_nan(material, value):
    sim = lost(material, value)
    for _ in range(2):  # also after the frame that says so
        now = sim.measure()
        sums = now.kinetic, now.gravitational, now.energy, *now.momentum, *now.angular_momentum
        assert np.isnan([*sums, now.overlap, now.self_overlap, now.volume_ratio]).all()
        assert (now.overlap_pair, now.self_overlap_body, now.unheld) == (None, None, 0)
        with pytest.raises(wc.SimulationError, match="'lost', vertex 0 is no longer finite"):
            sim.step_frame()
    pressure = sim.contact_fields()["pressure"]
    np.testing.assert_array_equal(np.isnan(pressure), ~np.isfinite(sim.positions()).all(axis=1))
    assert np.isnan(np.concatenate(sim.pose("lost"))).all()
    assert np.isfinite(np.concatenate(sim.pose("other"))).all()


def test_a_rigid_body_in_one_point_has_no_motion_that_could_be_measured():
    now = lost(wc.Rigid(1000.0), 1.0).measure()
    assert np.isnan([now.kinetic, now.energy, *now.momentum, *now.angular_momentum]).all()
    assert np.isfinite([now.elastic, now.overlap, now.volume_ratio]).all()
