"""setup.py and columns.py: a hanging bar comes to its closed form and to rest."""

import numpy as np
import pytest
from verification.columns import Column, stress
from verification.setup import MESHES, G, Pose, block, on_face, rest, step_rate

import warp_contact as wc

BAR = Column(1e5, 1.0, 1000.0, (1, 1, 4), (0.25, 0.25))
OMEGA = BAR.slowest


def hanging(pose: Pose) -> wc.Simulation:
    """A bar that hangs from its upper end, unloaded at first."""
    scene = wc.Scene(gravity=pose.out((0.0, 0.0, -G)))
    mesh = block((*BAR.section, BAR.length), BAR.cells)
    material = wc.Corotated(BAR.young, 0.0, BAR.density)
    scene.add_body(mesh, material, rotation=pose.q, fixed=on_face(mesh, 2, 1))
    return wc.Simulation(scene, fps=step_rate(0.25, BAR.wave_speed))


@pytest.mark.parametrize("turned", [False, True])
def test_a_hanging_bar_is_relaxed_to_its_elongation_and_to_rest(turned):
    pose = Pose(turned)
    sim = hanging(pose)
    rest(sim, OMEGA, 14.0, lambda: None)
    z = pose.back(sim.positions())[:, 2]
    low = on_face(sim.scene.bodies[0].mesh, 2, -1)
    sunk = sim.scene.bodies[0].mesh.vertices[low, 2].mean() - z[low].mean()
    # rho G L^2 / 2 E. Masses of a chess-board mesh are uneven over a section of one cell: 2 %.
    assert sunk == pytest.approx(1000.0 * G / 2e5, rel=0.02)
    # exp(-2 * 0.7 * 14) of the energy is 3e-9 of it, float32 leaves 1e-7.
    assert sim.measure().kinetic < 1e-6 * sim.measure().elastic


def test_relaxation_leaves_prescribed_velocities_alone():
    sim = hanging(Pose())
    held = on_face(sim.scene.bodies[0].mesh, 2, 1)
    sim.set_velocity(0, (0.2, 0.0, 0.0), held)
    rest(sim, OMEGA, 0.0, lambda: None, least=5)
    np.testing.assert_array_equal(
        sim.velocities()[held], np.float32([[0.2, 0.0, 0.0]] * held.sum())
    )


def test_axial_stress_of_a_stretched_turned_bar_is_e_times_the_strain():
    pose, strain = Pose(True), 0.03
    sim = hanging(pose)
    x = pose.back(sim.scene.bodies[0].x)
    x[:, 2] *= 1.0 + strain
    sim.state.x.assign(pose.out(x).astype(np.float32))
    pressure = -stress(sim.scene.bodies[0], pose.back(sim.positions()))[:, 2, 2]
    # Positions of order 1 in float32 over edges of a quarter: 1e-6 of the strain of 0.03.
    np.testing.assert_allclose(pressure, -BAR.young * strain, rtol=1e-4)


def test_stresses_are_those_of_the_solver(rng, forces_of):
    scene = wc.Scene()
    mesh = wc.box(1.0, 2)
    body = scene.add_body(mesh, wc.Corotated(1e5, 0.0, 1000.0))
    sim = wc.Simulation(scene)
    x = mesh.vertices + 0.05 * rng.normal(size=mesh.vertices.shape)
    sim.state.x.assign(x.astype(np.float32))
    corners = mesh.vertices[mesh.tets]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    p = stress(body, x.astype(np.float32))
    g = -mesh.volumes[:, None, None] * p @ np.swapaxes(np.linalg.inv(edges), 1, 2)
    want = np.zeros_like(x)
    for k in range(3):
        np.add.at(want, mesh.tets[:, k + 1], g[:, :, k])
        np.add.at(want, mesh.tets[:, 0], -g[:, :, k])
    # Rounding of float32 stresses, against forces of order 1e3.
    np.testing.assert_allclose(forces_of(sim.model, sim.state.x), want, atol=0.05)


@pytest.mark.parametrize("mesh", MESHES)
def test_blocks_keep_their_faces_plane_and_their_volume(mesh, rng):
    found = block((1.0, 2.0, 3.0), (2, 3, 4), mesh, int(rng.integers(1000)))
    assert found.volume == pytest.approx(6.0)
    counts = {(0, -1): 20, (1, 1): 15, (2, 1): 12}
    assert {key: on_face(found, *key).sum() for key in counts} == counts
