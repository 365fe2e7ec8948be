"""Mass, centre and inertia of rigid bodies: of the solid, or as they are given."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

INERTIA = np.array([[2e-3, 2e-4, -1e-4], [2e-4, 2.5e-3, 3e-4], [-1e-4, 3e-4, 1.5e-3]])
CENTRE = np.array([0.02, -0.01, 0.03])
SOLID, LOADED = wc.Rigid(1000.0), wc.Rigid(mass=0.5, centre=CENTRE, inertia=INERTIA)


def alone(material, mesh=None, gravity=(0.0, 0.0, 0.0), **where):
    scene = wc.Scene(gravity=gravity)
    scene.add_body(mesh or wc.box(0.1, 2), material, **where)
    return wc.Simulation(scene, substeps=8)


def test_a_density_gives_the_moments_of_the_solid(jittered, turned):
    size = np.array([0.3, 0.2, 0.1])
    box = wc.box(tuple(size), 1)
    solid = wc.Rigid(500.0).solid(box.vertices, box.tets)
    mass = 500.0 * size.prod()
    np.testing.assert_allclose(solid.mass, mass, rtol=1e-12)
    moments = mass * ((size**2).sum() - size**2) / 12.0
    np.testing.assert_allclose(solid.inertia, np.diag(moments), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(solid.centre, 0.0, atol=1e-15)

    # Any other mesh: a rule with four points a tet, exact for squares (Hammer and Stroud 1956).
    mesh = jittered(0.1, 2)
    x, tets = mesh.vertices @ rotation_matrix(turned()).T + [0.3, -2.0, 1.0], mesh.tets
    a, b = 0.5854101966249685, 0.1381966011250105
    points = np.einsum("kc,qci->qki", b + (a - b) * np.eye(4), x[tets])
    edges = x[tets][:, 1:] - x[tets][:, :1]
    m = 500.0 * np.linalg.det(edges)[:, None] / 24.0 * np.ones(4)
    found = wc.Rigid(500.0).solid(x, tets)
    centre = np.einsum("qk,qki->i", m, points) / m.sum()
    r = points - centre
    inertia = np.einsum("qk,qkl,qkl->", m, r, r) * np.eye(3) - np.einsum("qk,qki,qkj->ij", m, r, r)
    np.testing.assert_allclose(found.mass, m.sum(), rtol=1e-12)
    np.testing.assert_allclose(found.centre, centre, rtol=1e-12)
    np.testing.assert_allclose(found.inertia, inertia, rtol=1e-10, atol=1e-10 * np.trace(inertia))


def test_what_is_measured_is_that_of_the_body(turned):
    turn, place = turned(), np.array([0.3, 0.1, -0.2])
    v, w, g = np.array([0.4, 0.1, -0.3]), np.array([2.0, -1.0, 3.0]), np.array([1.0, 0.0, -9.0])
    sim = alone(LOADED, gravity=g, position=place, rotation=turn, velocity=v, angular_velocity=w)
    r = rotation_matrix(turn)
    centre, spin = place + r @ CENTRE, r @ INERTIA @ r.T @ w
    now = sim.measure()
    # Rounding of float32 positions and velocities.
    near = {"rtol": 1e-5, "atol": 1e-7}
    np.testing.assert_allclose(now.momentum, 0.5 * v, **near)
    np.testing.assert_allclose(now.angular_momentum, np.cross(centre, 0.5 * v) + spin, **near)
    np.testing.assert_allclose(now.kinetic, 0.25 * v @ v + 0.5 * w @ spin, **near)
    np.testing.assert_allclose(now.gravitational, -0.5 * g @ centre, **near)
    assert sim.model.mass.numpy().sum() == pytest.approx(0.5, rel=1e-6)


def test_a_force_turns_it_about_the_given_centre(turned):
    sim = alone(LOADED)
    sim.apply(0, (0.0, 0.3, 0.0), at=CENTRE)
    sim.step_frame()
    speed = 0.3 / 0.5 / 60.0
    np.testing.assert_allclose(sim.velocities(), np.tile([0, speed, 0], (27, 1)), atol=1e-7)
    turned = turned()
    r = rotation_matrix(turned)
    sim, inertia, arm = alone(LOADED, rotation=turned), r @ INERTIA @ r.T, -r @ CENTRE
    sim.apply(0, (0.0, 0.003, 0.0), at=(0.0, 0.0, 0.0))
    sim.step_frame()
    w = np.linalg.solve(inertia, np.cross(arm, [0.0, 0.003, 0.0])) / 60.0
    v = [0.0, 0.01 * speed, 0.0] + np.cross(w, sim.positions() + arm)
    # Float32 velocities; it has turned by 5e-5 and moved by 1e-6 m.
    np.testing.assert_allclose(sim.velocities(), v, atol=1e-3 * np.abs(v).max())


def test_a_torque_like_that_of_a_spring_lets_it_swing():
    inertia = np.diag([1e-3, 2e-3, 2.5e-3])
    sim = alone(wc.Rigid(mass=0.5, centre=CENTRE, inertia=inertia), position=(0.4, 0.0, 0.0))
    spring, h, angle, rate, off = 0.4, 1.0 / 60.0, 0.0, 2.0, []
    sim.set_velocity(0, np.cross([0.0, 0.0, rate], sim.positions() - CENTRE - [0.4, 0.0, 0.0]))
    for _ in range(60):
        torque = -spring * angle
        sim.apply(0, torque=(0.0, 0.0, torque))
        sim.step_frame()
        angle += h * (rate + 0.5 * h * torque / 2.5e-3)
        rate += h * torque / 2.5e-3
        _, _, z, w = sim.pose(0)[1]
        off.append(2.0 * np.arctan2(z, w) - angle)
    assert np.abs(off).max() < 1e-5
    place, turn = sim.pose(0)
    centre = place + rotation_matrix(turn) @ CENTRE
    np.testing.assert_allclose(centre, CENTRE + [0.4, 0.0, 0.0], atol=1e-6)


def test_a_body_that_is_set_elsewhere_keeps_the_motion_of_its_centre():
    v, w = np.array([0.1, 0.0, 0.2]), np.array([0.0, 4.0, 0.0])
    sim = alone(LOADED, velocity=v, angular_velocity=w)
    sim.set_pose(0, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0, 1.0))
    centre = rotation_matrix((0.0, 0.0, 1.0, 1.0)) @ CENTRE + [0.0, 1.0, 0.0]
    np.testing.assert_allclose(
        sim.velocities(), v + np.cross(w, sim.positions() - centre), atol=1e-6
    )


def test_a_needle_away_from_the_origin_keeps_its_spin_and_energy():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    needle, moves = wc.box((0.3, 0.004, 0.002), 2), (0.1, 0.0, 0.0)
    scene.add_body(needle, SOLID, (1, 0, 0), velocity=moves, angular_velocity=(1, 2, 3))
    sim = wc.Simulation(scene, substeps=64)
    start = sim.measure()
    for _ in sim.frames(30):
        pass
    now = sim.measure()
    away = np.abs(now.angular_momentum - start.angular_momentum).max()
    # A walk of 1920 steps: positions round by 6e-8 m, and the needle is 0.001 m thick.
    assert away < 5e-5 * np.abs(start.angular_momentum).max()
    assert abs(now.kinetic / start.kinetic - 1.0) < 1e-5


def test_a_run_goes_on_with_the_same_body_only(tmp_path):
    sim = alone(LOADED, angular_velocity=(1, 2, 3))
    for _ in sim.frames(2):
        pass
    sim.save(tmp_path / "two.npz")
    again = alone(LOADED, angular_velocity=(1, 2, 3))
    again.load(tmp_path / "two.npz")
    for each in (sim, again):
        each.step_frame()
    np.testing.assert_array_equal(again.positions(), sim.positions())
    other = wc.Rigid(mass=0.5, centre=CENTRE, inertia=1.1 * INERTIA)
    with pytest.raises(ValueError, match="another scene"):
        alone(other).load(tmp_path / "two.npz")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": 0.0}, r"mass 0\.0: give a number above 0"),
        ({"mass": None}, "give a density, or mass, centre and inertia"),
        ({"density": 1000.0}, r"mass 0\.5: give it, or a density"),
        ({"centre": (0.0, 0.0)}, r"centre .*shape \(3,\)"),
        ({"centre": (0.0, np.nan, 0.0)}, r"centre .*at \(1,\) it is nan"),
        ({"inertia": INERTIA + np.triu(np.ones((3, 3)), 1)}, "inertia .*: give a symmetric matrix"),
        ({"inertia": np.diag([1.0, 1.0, -1.0])}, "give main moments above 0, here they are -1, 1"),
        ({"inertia": np.zeros((3, 3))}, "give main moments above 0"),
        ({"inertia": np.diag([1.0, 3.0, 1.0])}, "none is above the sum of the others, not 3"),
        ({"inertia": 1.0}, r"inertia 1\.0: give finite numbers of shape \(3, 3\)"),
    ],
)
def test_what_no_body_has_is_refused(change, words):
    given = {"mass": 0.5, "centre": CENTRE, "inertia": INERTIA} | change
    with pytest.raises(ValueError, match=words):
        wc.Rigid(**given)
    with pytest.raises(TypeError):
        wc.Rigid(None, 1.0, CENTRE, INERTIA)


def test_what_was_given_does_not_change_afterwards():
    inertia = np.diag([1.0, 1.0, 2.0])  # of a flat disc
    material = wc.Rigid(mass=1.0, centre=CENTRE, inertia=inertia)
    inertia *= 0.0
    assert material == wc.Rigid(mass=1, centre=list(CENTRE), inertia=np.diag([1, 1, 2]))
    assert hash(material) and material.inertia[2][2] == 2.0
