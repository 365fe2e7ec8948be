"""scene.py and response.py: what they take, and what they refuse with a reason."""

import numpy as np
import pytest

from warp_contact import ContactSurface, NeoHookean, Penalty, Scene, Simulation, VirtualSurface, box
from warp_contact.scene.scene import rotation_matrix

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"friction": -0.1}, "friction -0.1: give a number of 0 or more"),
        ({"friction": float("nan")}, "friction nan: give a number of 0 or more"),
        ({"gravity": (0.0, 1.0)}, r"gravity \(0.0, 1.0\): give finite numbers of shape \(3,\)"),
        (
            {"gravity": (0.0, 0.0, np.nan)},
            r"gravity .*: give finite numbers .* at \(2,\) it is nan",
        ),
        ({"gravity": "down"}, "gravity 'down': give finite numbers"),
    ],
)
def test_a_scene_refuses_what_is_no_physics(options, message):
    with pytest.raises(ValueError, match=message):
        Scene(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fixed": [0, 8]}, r"body 'cube': fixed \[0, 8\]: give .* it names vertex 8"),
        ({"fixed": [-1]}, "body 'cube': fixed .* it names vertex -1"),
        (
            {"fixed": np.zeros(7, dtype=bool)},
            r"fixed .* shape \(7,\) .*: give a mask of shape \(8,\)",
        ),
        ({"fixed": [0.5]}, r"fixed \[0.5\]: give a mask"),
        ({"label": "floor"}, "body 'floor': another body has this label"),
        ({"label": "plane0"}, "body 'plane0': this is how a half-space is called"),
        (
            {"rotation": (0, 0, 0, 0)},
            "body 'cube': rotation .*: give numbers that are not all zero",
        ),
        ({"position": (0, 0, np.nan)}, "body 'cube': position .*: give finite numbers"),
        ({"velocity": (0, 0, np.nan)}, "body 'cube': velocity .*: give finite numbers"),
        (
            {"velocity": np.zeros((7, 3))},
            r"body 'cube': velocity of shape \(7, 3\) .*: give .* of shape \(8, 3\)",
        ),
        ({"world": -1}, "body 'cube': world -1: give a whole number"),
        ({"world": None}, "body 'cube': world None: give a whole number"),
        ({"mesh": "bunny"}, "body 'cube': mesh 'bunny': give a TetMesh"),
        ({"material": None}, "body 'cube': material None: give a material"),
        ({"material": NeoHookean}, "body 'cube': material .*: give a material, such as wc.Neo"),
        ({"fixed": 0}, r"body 'cube': fixed 0: give a mask of shape \(8,\) or a list"),
        ({"label": "a\nb"}, r"label 'a.nb': give a text"),
    ],
)
def test_a_body_is_refused_by_its_name(options, message):
    scene = Scene()
    scene.add_body(box(1.0, 1), RUBBER, label="floor")
    given = {"mesh": box(1.0, 1), "material": RUBBER, "label": "cube", **options}
    with pytest.raises(ValueError, match=message):
        scene.add_body(**given)
    assert len(scene.bodies) == 1


def test_a_body_is_turned_then_moved(rng, turned):
    q, place, v = turned(), rng.normal(size=3), rng.normal(size=3)
    mesh = box((1.0, 2.0, 3.0), 1)
    body = Scene().add_body(mesh, RUBBER, place, 3.0 * q, velocity=v, fixed=[1])
    r = rotation_matrix(q)
    # float64 rounding.
    np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(r) == pytest.approx(1.0)
    np.testing.assert_allclose(body.x, mesh.vertices @ r.T + place, atol=1e-14)
    np.testing.assert_array_equal(body.v, [v] * 8)
    np.testing.assert_array_equal(np.flatnonzero(body.fixed), [1])
    axis, half = np.array([0.0, 0.0, 1.0]), np.pi / 4.0
    quarter = rotation_matrix([*(np.sin(half) * axis), np.cos(half)])
    np.testing.assert_allclose(quarter @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_a_plane_is_normalised_but_its_offset_is_a_length():
    scene = Scene()
    scene.add_plane((0.0, 0.0, 4.0), 0.5)
    normal, offset = scene.planes[0]
    np.testing.assert_array_equal(normal, [0.0, 0.0, 1.0])
    assert offset == 0.5
    with pytest.raises(ValueError, match=r"plane normal .*: give numbers that are not all zero"):
        scene.add_plane((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("response", "options"),
    [
        (ContactSurface, {"search": "binary"}),
        (ContactSurface, {"iterations": 0}),
        (Penalty, {"stiffness": 0.0}),
        (Penalty, {"stiffness": 1.0, "damping": -1.0}),
        (VirtualSurface, {"stiffness": -1.0}),
        (VirtualSurface, {"stiffness": 1.0, "damping": np.nan}),
    ],
)
def test_a_response_without_sense_is_refused(response, options):
    with pytest.raises(ValueError, match=r": give "):
        response(**options)


def test_a_scene_that_a_simulation_has_taken_over_refuses_to_change():
    scene = Scene()
    ball = box(0.1, 1), NeoHookean(1e5, 0.3, 1000.0)
    scene.add_body(*ball)
    sims = [Simulation(scene) for _ in range(2)]  # of the same scene, as for a comparison
    assert sims[0].scene is sims[1].scene
    changes = (
        lambda: scene.add_body(*ball),
        lambda: scene.add_plane((0.0, 0.0, 1.0)),
        lambda: setattr(scene, "friction", 0.0),
        lambda: setattr(scene, "gravity", (0.0, 0.0, 0.0)),
    )
    for change in changes:
        with pytest.raises(ValueError, match="build another scene"):
            change()
    assert len(scene.bodies) == 1 and scene.planes == ()


@pytest.mark.parametrize("response", [Penalty, "penalty", 3.0])
def test_what_is_no_response_is_refused_before_the_first_step(response):
    scene = Scene()
    scene.add_body(box(0.1, 1), NeoHookean(1e5, 0.3, 1000.0))
    with pytest.raises(ValueError, match=r"response .*: give one of wc.ContactSurface"):
        Simulation(scene, response)


def test_a_body_may_be_named_by_its_label():
    scene = Scene()
    for k, name in enumerate(("lower", "upper")):
        place = (0.0, 0.0, 0.2 * k)
        scene.add_body(box(0.1, 1), NeoHookean(1e5, 0.3, 1000.0), place, label=name)
    sim = Simulation(scene)
    np.testing.assert_array_equal(sim.positions("upper"), sim.positions(1))
    sim.set_velocity("upper", (1.0, 0.0, 0.0))
    assert sim.velocities(1)[:, 0].min() == 1.0 and not sim.velocities("lower").any()
    with pytest.raises(ValueError, match="no body 'middle': the scene has lower, upper"):
        sim.positions("middle")
