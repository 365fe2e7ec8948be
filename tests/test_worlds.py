"""What one world does depends on no other, to the last bit.

The worlds share every launch, and their bodies lie in the same arrays. The observed world has the
first bodies of the scene, so that its numbers are the same with and without neighbours.
"""

from functools import cache

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box, sphere

RUBBER = NeoHookean(5e4, 0.35, 1000.0, 2e-3)
EDGE = 0.05
FRAMES = 40
OBSERVED = ("stack", "undamped stack", "hit", "edges")


def soft(scene: Scene) -> None:
    scene.add_body(box(0.1, 2), NeoHookean(2e4, 0.3, 1000.0, 1e-3), (0.0, 0.0, 0.08), world=1)


def stiff(scene: Scene) -> None:
    """It takes many more steps than the observed world."""
    scene.add_body(box(0.1, 2), NeoHookean(5e6, 0.3, 1000.0, 1e-4), (0.0, 0.0, 0.06), world=1)


def fast(scene: Scene) -> None:
    velocity = (0.0, 0.0, -8.0)  # its tets get flat, its frames are looked at within
    scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.5), velocity=velocity, world=1)


def fine(scene: Scene) -> None:
    """Its shortest edge is a small part of those of the observed world."""
    scene.add_body(box(0.02, 2), NeoHookean(2e4, 0.3, 1000.0, 1e-3), (0.0, 0.0, 0.03), world=1)


def pile(scene: Scene) -> None:
    """Its sweeps converge late, and its contacts are open often."""
    for k in range(5):
        place = (0.01 * k, 0.02 * (k % 2), 0.06 + 0.11 * k)
        scene.add_body(sphere(0.05, 41), RUBBER, place, world=1)


def crossing(scene: Scene, world: int = 1) -> None:
    """Edges fall on edges: new contacts of them are found in many steps."""
    for k in range(3):
        turn = np.pi / 4
        along = (np.sin(turn / 2), 0.0, 0.0) if k % 2 else (0.0, np.sin(turn / 2), 0.0)
        place = (0.003 * k, 0.0, 0.075 + 0.15 * k)
        rotation = (*along, np.cos(turn / 2))
        scene.add_body(box(0.1, 2), RUBBER, place, rotation, (0.0, 0.0, -1.0), world=world)


def of_worlds(observed: str, neighbours=()) -> Scene:
    """A scene with the observed world and worlds of others."""
    scene = Scene(friction=0.4)
    scene.add_plane((0.0, 0.0, 1.0))
    if observed == "edges":
        crossing(scene, world=0)
    elif observed == "hit":
        scene.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.0502))
        velocity = (-2.0, 0.0, 0.0)
        scene.add_body(sphere(0.05, 41), RUBBER, (0.2, 0.01, 0.0502), velocity=velocity)
    else:
        rubber = RUBBER if observed == "stack" else NeoHookean(5e4, 0.35, 1000.0)
        for k in range(3):
            scene.add_body(box(0.1, 2), rubber, (0.01 * k, 0.003 * k, 0.06 + 0.11 * k))
    for add in neighbours:
        add(scene)
    return scene


def motion(observed: str, neighbours=()) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities after each frame, (2, FRAMES, n, 3), and the steps of each."""
    sim = Simulation(of_worlds(observed, neighbours))
    n = sum(len(body.x) for body in of_worlds(observed).bodies)
    frames = [(sim.positions()[:n], sim.velocities()[:n], sim.substeps) for _ in sim.frames(FRAMES)]
    x, v, steps = zip(*frames, strict=True)
    return np.array([x, v]), np.array(steps)


@cache
def alone(observed: str) -> tuple[np.ndarray, np.ndarray]:
    return motion(observed)


def same_bits(observed: str, ours: np.ndarray) -> None:
    theirs, _ = alone(observed)
    for frame, (now, then) in enumerate(zip(ours[0], theirs[0], strict=True)):
        apart = np.abs(now - then).max() / EDGE
        assert apart == 0.0, f"{apart:.1e} edges apart in frame {frame}"
    np.testing.assert_array_equal(ours[1], theirs[1])


@pytest.mark.parametrize("neighbour", [soft, stiff, fast, fine, pile, crossing])
@pytest.mark.parametrize("observed", OBSERVED)
def test_a_world_moves_as_if_it_were_alone(observed, neighbour):
    same_bits(observed, motion(observed, [neighbour])[0])


def test_nor_do_several_worlds_at_once_move_it():
    def again(scene: Scene) -> None:
        for k in range(2):
            scene.add_body(box(0.1, 2), RUBBER, (0.02 * k, 0.0, 0.09 + 0.12 * k), world=2)

    same_bits("hit", motion("hit", [pile, again])[0])


def test_a_neighbour_may_take_more_steps_or_fewer():
    (_, few), (_, many) = alone("stack"), motion("stack", [stiff])
    assert (many > few).all()
