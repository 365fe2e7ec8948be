"""What one world does depends on no other, to the last bit.

The worlds share every launch, and their bodies lie in the same arrays.
"""

from functools import cache
from itertools import zip_longest

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box, sphere

RUBBER = NeoHookean(5e4, 0.35, 1000.0, 2e-3)
EDGE = 0.05
FRAMES = 40
OBSERVED = ("stack", "undamped stack", "hit", "edges", "inside")


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


def inside(scene: Scene, world: int = 1) -> None:
    """Blocks begin in each other, and are led apart."""
    for k in range(3):
        scene.add_body(box(0.1, 2), RUBBER, (0.01 * k, 0.02, 0.0502 + 0.07 * k), world=world)


def crossing(scene: Scene, world: int = 1) -> None:
    """Edges fall on edges: new contacts of them are found in many steps."""
    for k in range(3):
        turn = np.pi / 4
        along = (np.sin(turn / 2), 0.0, 0.0) if k % 2 else (0.0, np.sin(turn / 2), 0.0)
        place = (0.003 * k, 0.0, 0.075 + 0.15 * k)
        rotation = (*along, np.cos(turn / 2))
        scene.add_body(box(0.1, 2), RUBBER, place, rotation, (0.0, 0.0, -1.0), world=world)


class Bodies(list):
    """What is to be added to a scene, in an order that is still to be chosen."""

    def add_body(self, *arguments, **named) -> None:
        self.append((arguments, named))


def bodies_of(observed: str) -> Bodies:
    """The observed world."""
    ours = Bodies()
    if observed in ("edges", "inside"):
        {"edges": crossing, "inside": inside}[observed](ours, world=0)
    elif observed == "hit":
        ours.add_body(box(0.1, 2), RUBBER, (0.0, 0.0, 0.0502))
        velocity = (-2.0, 0.0, 0.0)
        ours.add_body(sphere(0.05, 41), RUBBER, (0.2, 0.01, 0.0502), velocity=velocity)
    else:
        rubber = RUBBER if observed == "stack" else NeoHookean(5e4, 0.35, 1000.0)
        for k in range(3):
            ours.add_body(box(0.1, 2), rubber, (0.01 * k, 0.003 * k, 0.06 + 0.11 * k))
    return ours


def of_worlds(observed: str, neighbours=(), place: str = "first") -> tuple[Scene, list[int]]:
    """A scene with the observed world and worlds of others, and the bodies of the observed one."""
    ours, theirs = bodies_of(observed), Bodies()
    for add in neighbours:
        add(theirs)
    if place != "first":  # nor does the number of a world matter
        ours = [(arguments, named | {"world": 7}) for arguments, named in ours]
    order = {"first": [*ours, *theirs], "last": [*theirs, *ours]}
    order["between"] = [one for pair in zip_longest(theirs, ours) for one in pair if one]
    scene = Scene(friction=0.4)
    scene.add_plane((0.0, 0.0, 1.0))
    for arguments, named in order[place]:
        scene.add_body(*arguments, **named)
    return scene, [k for k, one in enumerate(order[place]) if any(one is own for own in ours)]


def motion(observed: str, neighbours=(), place="first", **settings) -> np.ndarray:
    """Positions and velocities after each frame, and the steps of the scene."""
    scene, ours = of_worlds(observed, neighbours, place)
    sim = Simulation(scene, **settings)
    frames = [(seen(sim.positions, ours), seen(sim.velocities, ours)) for _ in sim.frames(FRAMES)]
    return np.swapaxes(frames, 0, 1)


def seen(read, bodies: list[int]) -> np.ndarray:
    return np.concatenate([read(body) for body in bodies])


@cache
def alone(observed: str, **settings) -> np.ndarray:
    return motion(observed, **settings)


def same_bits(observed: str, ours: np.ndarray, **settings) -> None:
    theirs = alone(observed, **settings)
    for frame, (now, then) in enumerate(zip(ours[0], theirs[0], strict=True)):
        apart = np.abs(now - then).max() / EDGE
        assert apart == 0.0, f"{apart:.1e} edges apart in frame {frame}"
    np.testing.assert_array_equal(ours[1], theirs[1])


@pytest.mark.parametrize("neighbour", [soft, stiff, fast, fine, pile, crossing, inside])
@pytest.mark.parametrize("observed", OBSERVED)
def test_a_world_moves_as_if_it_were_alone(observed, neighbour):
    same_bits(observed, motion(observed, [neighbour]))


def test_nor_does_a_neighbour_move_it_in_implicit_steps():
    """The contacts of both are listed anew where one of them finds new ones."""
    same_bits("edges", motion("edges", [pile], integrator="implicit"), integrator="implicit")


@pytest.mark.parametrize("place", ["last", "between"])
@pytest.mark.parametrize("observed", OBSERVED)
def test_it_may_stand_anywhere_in_the_scene(observed, place):
    same_bits(observed, motion(observed, [pile], place))


def test_nor_do_several_worlds_at_once_move_it():
    def again(scene: Scene) -> None:
        for k in range(2):
            scene.add_body(box(0.1, 2), RUBBER, (0.02 * k, 0.0, 0.09 + 0.12 * k), world=2)

    same_bits("hit", motion("hit", [pile, again]))


def test_a_neighbour_may_take_more_steps_or_fewer():
    few, many = (Simulation(of_worlds("stack", others)[0]) for others in ([], [stiff]))
    for sim in (few, many):
        sim.step_frame()
    assert many.substeps > few.substeps


@pytest.mark.parametrize("observed", OBSERVED)
def test_nor_does_one_that_is_put_into_itself_on_the_way(observed):
    """The bodies of a neighbour are put into each other, then where they began."""
    scene, ours = of_worlds(observed, [soft, inside])
    sim, alone = Simulation(scene), Simulation(of_worlds(observed)[0])
    (one, other, *_) = (body.index for body in scene.bodies if body.world == 1)
    for frame in range(20):
        if frame == 5:
            sim.set_positions(one, sim.positions(other)[:] + np.float32([0.0, 0.0, 0.03]))
        if frame == 12:
            sim.reset([1])
        sim.step_frame(), alone.step_frame()
        np.testing.assert_array_equal(seen(sim.positions, ours), alone.positions())
        np.testing.assert_array_equal(seen(sim.velocities, ours), alone.velocities())


CALM = NeoHookean(3e4, 0.3, 1000.0, 1e-2)


def at_rest(scene: Scene, world: int = 0) -> None:
    """Blocks that fall asleep, one of which is hit by the next before it could be."""
    for x, speed in ((0.0, 0.0), (0.3, 0.0), (-1.0, 0.7)):
        velocity = (speed, 0.0, 0.0)
        scene.add_body(box(0.1, 2), CALM, (x, 0.0, 0.0502), velocity=velocity, world=world)


def standing(scene: Scene, world: int = 1) -> None:
    """A block that rests on a fixed one, and sleeps soon."""
    scene.add_body(box(0.1, 2), CALM, (0.0, 0.0, 0.05), fixed=True, world=world)
    scene.add_body(box(0.1, 2), CALM, (0.01, 0.0, 0.1502), world=world)


SLEEPERS = {"hit": at_rest, "standing": standing}


def sleepers(*bodies) -> Simulation:
    scene = Scene(friction=0.1)
    scene.add_plane((0.0, 0.0, 1.0))
    for arguments, named in bodies:
        scene.add_body(*arguments, **named)
    return Simulation(scene, sleeping=True)


@pytest.mark.parametrize("neighbour", [stiff, inside, standing])
@pytest.mark.parametrize("observed", SLEEPERS)
def test_worlds_may_sleep_by_themselves(observed, neighbour, tmp_path):
    """The observed world falls asleep, is woken, and sleeps again, beside one that goes on."""
    ours, theirs = Bodies(), Bodies()
    SLEEPERS[observed](ours, world=3)
    neighbour(theirs)
    beside, alone = sleepers(*theirs, *ours), sleepers(*ours)
    own = [body.index for body in beside.scene.bodies if body.world == 3]
    slept, n = set(), len(alone.positions())
    for frame in range(110):
        if frame in (40, 60):  # a neighbour begins anew
            beside.reset([1])
        if frame == 70:
            beside.save(tmp_path / "asleep")
            beside = sleepers(*theirs, *ours)
            beside.load(tmp_path / "asleep")
        if frame == 80:  # woken from outside
            for sim, body in ((beside, own[-1]), (alone, len(own) - 1)):
                sim.set_velocity(body, (0.0, 0.0, 0.4))
        beside.step_frame(), alone.step_frame()
        np.testing.assert_array_equal(seen(beside.positions, own), alone.positions())
        np.testing.assert_array_equal(seen(beside.velocities, own), alone.velocities())
        awake = [sim._stepper.work.awake.bodies.numpy() for sim in (beside, alone)]
        np.testing.assert_array_equal(awake[0][own], awake[1])
        slept.add(int((awake[1] == 0).sum()))
        pressures = [sim.contact_fields()["pressure"] for sim in (beside, alone)]
        np.testing.assert_array_equal(pressures[0][-n:], pressures[1])
    assert {"hit": {0, 2}, "standing": {0, 1, 2}}[observed] == slept
