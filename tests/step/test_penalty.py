"""step/other_responses.py: the force of a penalty, at rest and in motion."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Penalty, Scene, Simulation, box, sphere

SOFT = NeoHookean(1e5, 0.4, 1000.0, 2e-3)


def on_floor(mesh, response: Penalty, plane: bool, substeps: int | None = None) -> Simulation:
    """A body that touches a half-space, or the flat top of a fixed body."""
    scene = Scene(friction=0.5)
    if plane:
        scene.add_plane((0.0, 0.0, 1.0))
    else:
        slab = box((0.2, 0.2, 0.05), (4, 4, 1))
        scene.add_body(slab, SOFT, (0.0, 0.0, -0.025), fixed=True)
    scene.add_body(mesh, SOFT, (0.003, 0.002, -mesh.vertices[:, 2].min()), label="it")
    return Simulation(scene, response, substeps=substeps)


def masses(sim: Simulation) -> np.ndarray:
    """Of the body 'it' [kg], shape (n, 1)."""
    return sim.model.mass.numpy()[sim._bodies.range("it"), None].astype(np.float64)


def momentum(sim: Simulation) -> np.ndarray:
    """Of the velocities of the steps, half of one before the positions [kg m/s]."""
    v = sim.state.v.numpy()[sim._bodies.range("it")]
    return (masses(sim) * v).sum(axis=0, dtype=np.float64)


@pytest.mark.parametrize("plane", [True, False], ids=["plane", "body"])
@pytest.mark.parametrize("stiffness", [2e3, 2e4])
def test_a_block_at_rest_presses_with_its_weight_whatever_the_stiffness(stiffness, plane):
    sim = on_floor(box(0.08, 2), Penalty(stiffness, 2.0), plane)
    for _ in sim.frames(90):
        pass
    (force,) = sim.measure().forces.values()
    # What is left of its motion after 1.5 s.
    assert force == pytest.approx(9.81 * masses(sim).sum(), rel=1e-3)


@pytest.mark.parametrize("plane", [True, False], ids=["plane", "body"])
@pytest.mark.parametrize("stiffness", [2e3, 2e4])
def test_the_force_of_every_frame_is_the_weight_and_the_change_of_momentum(stiffness, plane):
    sim = on_floor(sphere(0.05, 147), Penalty(stiffness), plane, substeps=150)
    sim.step_frame()
    mass, before, swing = masses(sim), momentum(sim), []
    weight = np.array([0.0, 0.0, 9.81 * mass.sum()])
    for _ in sim.frames(45):
        after = momentum(sim)
        wanted = np.linalg.norm(weight + (after - before) * sim.fps)
        force = sum(sim.measure().forces.values())
        # Rounding of the velocities of 150 steps, all to one side: 150 x 6e-8.
        assert force == pytest.approx(wanted, rel=1e-5, abs=1e-5 * weight[2])
        swing.append(force)
        before = after
    # Nothing damps a ball that rocks on these springs: one frame alone does not tell its weight.
    assert np.ptp(swing[-15:]) > 0.02 * weight[2]
