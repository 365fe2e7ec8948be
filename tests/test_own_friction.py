"""Coefficients of friction of single bodies and planes: between two the mean of theirs counts."""

import numpy as np
import pytest

import warp_contact as wc

EDGE, G = 0.1, 9.81
RUBBER = wc.NeoHookean(2e5, 0.3, 1000.0, 4e-3)
FRAMES, FPS = 60, 120
ANGLE = 0.35  # of the slope; its tangent is 0.365
WAYS = {
    "explicit": {},
    "implicit": {"integrator": "implicit"},
    "penalty": {"response": wc.Penalty(2e4, 5.0)},
    "predicted": {"response": wc.PredictedForce()},
}


def slope(friction: float, floor: float | None, bodies, device, way: str) -> wc.Simulation:
    """Blocks on a floor that leans, each with a coefficient of its own; half a second."""
    gravity = G * np.array([np.sin(ANGLE), 0.0, -np.cos(ANGLE)])
    scene = wc.Scene(gravity, friction)
    scene.add_plane((0.0, 0.0, 1.0), friction=floor)
    for k, mu in enumerate(bodies):
        scene.add_body(wc.box(EDGE, 2), RUBBER, (0.0, 0.2 * k, 0.5 * EDGE), friction=mu)
    sim = wc.Simulation(scene, fps=FPS, device=str(device), **WAYS[way])
    for _ in sim.frames(FRAMES):
        pass
    return sim


@pytest.mark.parametrize("way", WAYS)
def test_a_block_slides_by_the_mean_of_both_coefficients(device, way):
    bodies = 0.1, 0.5, None
    sim = slope(0.9, 0.0, bodies, device, way)
    for k, mu in enumerate((0.05, 0.25, 0.45)):
        v = sim.velocities(k).mean(axis=0)
        wanted = max(np.sin(ANGLE) - mu * np.cos(ANGLE), 0.0) * G * FRAMES / FPS
        # 2 % of free fall: the block first sinks into its weight, and rocks while it slides.
        assert v[0] == pytest.approx(wanted, abs=0.02 * G * FRAMES / FPS), k


def test_one_coefficient_for_all_is_the_same_as_each_of_its_own(device):
    mu = 0.2
    one = slope(mu, None, (None, None), device, "explicit")
    each = slope(0.7, mu, (mu, mu), device, "explicit")
    np.testing.assert_array_equal(one.positions(), each.positions())


def test_another_coefficient_is_another_scene(device, tmp_path):
    one = slope(0.2, None, (None,), device, "explicit")
    one.save(tmp_path / "one.npz")
    with pytest.raises(ValueError, match="another scene"):
        slope(0.2, None, (0.3,), device, "explicit").load(tmp_path / "one.npz")


@pytest.mark.parametrize("wrong", [-0.1, np.nan, "0.3", (0.1, 0.2)])
def test_what_is_no_coefficient_is_refused(wrong):
    scene = wc.Scene()
    with pytest.raises(ValueError, match=r"body 'wheel': .*friction"):
        scene.add_body(wc.box(EDGE, 1), RUBBER, label="wheel", friction=wrong)
    with pytest.raises(ValueError, match="friction"):
        scene.add_plane((0.0, 0.0, 1.0), friction=wrong)
    assert not scene.bodies and not scene.planes and not scene.plane_friction
