"""What ``integrator="auto"`` takes."""

import re

import numpy as np
import pytest

import warp_contact as wc


@pytest.mark.parametrize(("modulus", "kind"), [(1e4, "explicit"), (1e9, "implicit")])
def test_auto_takes_implicit_steps_where_a_body_is_stiff(modulus, kind):
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(modulus, 0.3, 1000.0))
    assert f"{kind} steps: " in wc.Simulation(scene, integrator="auto").summary()


@pytest.mark.parametrize(
    ("bodies", "height", "gravity", "speed", "kind"),
    [
        (2, 0.0, 9.81, 0.0, "implicit"),
        (2, 5.0, 0.0, 0.0, "implicit"),  # they stay there
        (2, 5.0, 9.81, 0.0, "explicit"),  # one comes to 10 m/s: implicit steps are as short then
        (1, 5.0, 9.81, 0.0, "implicit"),  # nothing is there to pass
        (2, 0.0, 9.81, 10.0, "explicit"),
    ],
)
def test_auto_reckons_with_a_fall_and_with_speed(bodies, height, gravity, speed, kind):
    scene = wc.Scene((0.0, 0.0, -gravity))
    scene.add_plane((0.0, 0.0, 1.0))
    rubber = wc.NeoHookean(5e5, 0.3, 1000.0)
    for k in range(bodies):
        place, v = (0.3 * k, 0.0, height + 0.0501), (0.0, speed * k, 0.0)
        scene.add_body(wc.box(0.1, 3), rubber, place, velocity=v)
    assert f"{kind} steps: " in wc.Simulation(scene, integrator="auto").summary()


def test_the_default_says_which_body_asks_for_most_steps():
    scene = wc.Scene()
    for k, young in enumerate((1e4, 1e9)):
        material = wc.NeoHookean(young, 0.3, 1000.0)
        scene.add_body(wc.box(0.1, 1), material, (0.0, 0.0, 0.2 * k), label=f"E{k}")
    sim = wc.Simulation(scene)
    said = sim.summary()
    asked = int(re.search(r"default; body 'E1' asks for (\d+) explicit steps a second", said)[1])
    # One frame has a whole number of steps, and a body that falls asks for no fewer.
    assert sim.next_substeps() == pytest.approx(asked / sim.fps, rel=0.05)


def test_auto_reckons_with_what_explicit_steps_could_pass():
    scene = wc.Scene((0.0, 0.0, 0.0))
    scene.add_body(wc.heightfield(np.zeros((3, 3)), 0.1, 1e-3), wc.Rigid(1e3), fixed=True)
    soft = wc.NeoHookean(1e4, 0.3, 1000.0)
    scene.add_body(wc.box(0.1, 3), soft, (0.0, 0.0, 0.06), velocity=(0.0, 0.0, -1.0))
    assert "implicit steps: body 'body0'" in wc.Simulation(scene, integrator="auto").summary()
