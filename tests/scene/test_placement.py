"""placement.py: bodies that no simulation can start from."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box, sphere

RUBBER = NeoHookean(1e5, 0.3, 1000.0)
EDGE = 0.1  # of a cube [m]


def two(first, second, **placed) -> Simulation:
    scene = Scene()
    scene.add_body(first, RUBBER, label="first")
    scene.add_body(box(EDGE, 1), RUBBER, (1.0, 0.0, 0.0))
    scene.add_body(second, RUBBER, label="second", **placed)
    return Simulation(scene)


@pytest.mark.parametrize("cells", [2, 3])
@pytest.mark.parametrize("aside", [0.0, 1e-5])
def test_bodies_that_fill_the_same_space_are_refused_whatever_their_cells(cells, aside):
    with pytest.raises(ValueError, match="body 'first' and body 'second' are in the same"):
        two(box(EDGE, 2), box(EDGE, cells), position=(0.0, aside, 0.0))


@pytest.mark.parametrize(
    ("mesh", "placed"),
    [
        (box(EDGE, 2), {"position": (0.0, 0.0, 1e-3)}),
        (box(EDGE, 2), {"rotation": (0.0, 0.0, 0.38, 0.92)}),
        (box(EDGE, 2), {"world": 1}),
        (box(0.9 * EDGE, 2), {}),
        (sphere(0.62 * EDGE, 55), {}),
    ],
)
def test_bodies_deep_in_each_other_are_not(mesh, placed):
    two(box(EDGE, 2), mesh, **placed)


def test_crossed_beams_with_one_middle_and_one_box_are_not():
    scene = Scene()
    for sign in (-1.0, 1.0):
        turn = 0.0, 0.0, sign * np.sin(np.pi / 8.0), np.cos(np.pi / 8.0)
        scene.add_body(box((4.0 * EDGE, EDGE, EDGE), (4, 1, 1)), RUBBER, rotation=turn)
    Simulation(scene)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_body_is_refused_where_rounding_drowns_its_gap_at_rest(scale):
    mesh = box(scale * EDGE, 1)
    p, q = mesh.vertices[mesh.edges].swapaxes(0, 1)
    most = 1.5 * 2e-4 * 2.0**24 * np.linalg.norm(p - q, axis=1).mean()
    for far in (0.9 * most, 1.1 * most):
        scene = Scene((0.0, 0.0, 0.0))
        scene.add_body(mesh, RUBBER, (0.0, -far, 0.0), label="remote")
        if far < most:
            Simulation(scene)
        else:
            with pytest.raises(ValueError, match=r"body 'remote' is .* m from the origin: beyond"):
                Simulation(scene)


def test_fixed_bodies_in_one_place_are_not():
    scene = Scene()
    for _ in range(2):
        scene.add_body(box(EDGE, 2), RUBBER, fixed=True)
    scene.add_body(box(EDGE, 1), RUBBER, (1.0, 0.0, 0.0))
    Simulation(scene)


@pytest.mark.parametrize("held", [[True, False], [False, True], [True, np.arange(26)]])
def test_a_fixed_and_a_free_body_in_one_place_are_refused(held):
    """Also where only a part of one is free."""
    scene = Scene()
    for fixed in held:
        scene.add_body(box(EDGE, 2), RUBBER, fixed=None if fixed is False else fixed)
    with pytest.raises(ValueError, match="are in the same place"):
        Simulation(scene)
