"""warp_contact/scenes: the paper's counts, and bodies where their pictures have them."""

import inspect

import numpy as np
import pytest

from warp_contact import Simulation, scenes
from warp_contact.scene.scene import Body, Scene
from warp_contact.scenes import bowl, cubes_on_membrane, sampling, squeezed_sphere, two_bodies

PAPER = {  # vertices, surface triangles
    "cubes_on_membrane": (323, 624),
    "squeezed_sphere": (95, 166),
    "bowl": (16030, 27116),
    "membrane_stack": (2178, 4320),
}
BUILT: dict[str, Scene] = {}


@pytest.fixture
def scene(name: str) -> Scene:
    """The bowl takes half a second: build each scene once."""
    if name not in BUILT:
        BUILT[name] = scenes.load(name).build()
    return BUILT[name]


def boxes(bodies: list[Body]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([b.x.min(axis=0) for b in bodies]), np.array([b.x.max(axis=0) for b in bodies])


def test_the_six_scenes_of_the_paper_are_listed():
    assert scenes.names() == sorted([*PAPER, "sampling", "two_bodies"])


def test_an_unknown_scene_is_refused_with_the_names_there_are():
    with pytest.raises(ValueError, match="no scene 'nothing'; there are bowl, "):
        scenes.load("nothing")


@pytest.mark.parametrize("name", PAPER)
def test_a_scene_has_the_counts_of_the_paper(name, scene):
    n_vert = sum(len(body.mesh.vertices) for body in scene.bodies)
    n_tri = sum(len(body.mesh.surface) for body in scene.bodies)
    assert (n_vert, n_tri) == PAPER[name]


@pytest.mark.parametrize("name", scenes.names())
def test_a_scene_file_says_what_a_run_needs(name):
    module = scenes.load(name)
    assert module.FRAMES > 0
    assert {len(module.VIEW[key]) for key in ("eye", "target")} == {3}
    assert module.PENALTY["stiffness"] > 0.0 <= module.PENALTY["damping"]
    for parameter in inspect.signature(module.build).parameters.values():
        assert parameter.default is not inspect.Parameter.empty
    assert "Look at" in " ".join(module.__doc__.split())


@pytest.mark.parametrize("name", scenes.names())
def test_a_scene_has_no_sliver(name, scene):
    worst = min(body.mesh.quality.min() for body in scene.bodies)
    print(f"worst tet {worst:.3f}")
    assert worst > 0.3


@pytest.mark.parametrize("name", ["bowl", "membrane_stack", "sampling"])
def test_a_scene_starts_above_its_planes(name, scene):
    assert scene.planes
    for normal, offset in scene.planes:
        for body in scene.bodies:
            # float64 rounding of the placement
            assert (body.x @ normal).min() >= offset - 1e-12


@pytest.mark.parametrize("name", ["cubes_on_membrane", "membrane_stack", "squeezed_sphere"])
def test_bodies_start_in_boxes_of_their_own(name, scene):
    low, high = boxes(scene.bodies)
    apart = ((low[:, None] > high) | (low > high[:, None])).any(axis=2)
    assert (apart | np.eye(len(apart), dtype=bool)).all()


def test_the_blocks_of_a_pair_overlap_by_the_part_asked_for():
    scene = two_bodies.build(overlap=0.2)
    low, high = boxes(scene.bodies)
    np.testing.assert_allclose(high[0::2, 2] - low[1::2, 2], 0.2 * two_bodies.EDGE)
    assert [int(body.fixed.sum()) for body in scene.bodies] == [25] * 4
    soft, stiff = (body.material.youngs_modulus for body in scene.bodies[2:])
    assert stiff == 10.0 * soft


@pytest.mark.parametrize("cells", [3, 4])
def test_blocks_of_equal_cells_have_the_same_diagonals_where_they_touch(cells):
    lower, upper = two_bodies.build(cells=cells, overlap=0.0).bodies[:2]

    def lines(body):
        at = np.abs(body.x[:, 2] - two_bodies.EDGE) < 1e-9
        ends = np.round(body.x[body.mesh.edges[at[body.mesh.edges].all(axis=1)]], 9)
        return {tuple(sorted(map(tuple, pair.tolist()))) for pair in ends}

    assert lines(lower) == lines(upper)


def test_the_arches_stand_on_two_feet_above_the_slabs():
    scene = sampling.build()
    for slab, arch in (scene.bodies[:2], scene.bodies[2:]):
        top = slab.x[:, 2].max()
        feet = arch.x[arch.x[:, 2] < top + sampling.GAP + 1e-9]
        assert arch.x[:, 2].min() == pytest.approx(top + sampling.GAP, rel=1e-9)
        away = np.abs(feet[:, 0] - slab.x[:, 0].mean())
        # Half a width to either side of the middle line.
        assert away.min() == pytest.approx(sampling.RADIUS - 0.5 * sampling.WIDTH, rel=1e-9)
        assert (feet[:, 0] > slab.x[:, 0].min()).all()
        assert (feet[:, 0] < slab.x[:, 0].max()).all()


def test_the_membrane_is_held_at_its_rim_and_the_cubes_weigh_1_4_16():
    sheet, *cubes = cubes_on_membrane.build().bodies
    assert int(sheet.fixed.sum()) == 2 * 40
    mass = [cube.material.density * cube.mesh.volume for cube in cubes]
    np.testing.assert_allclose(mass, [0.25, 1.0, 4.0])  # rounding


def test_the_upper_cube_comes_down_at_the_speed_asked_for():
    lower, ball, upper = squeezed_sphere.build(speed=0.03).bodies
    np.testing.assert_array_equal(upper.v[upper.fixed], [[0.0, 0.0, -0.03]] * 9)
    assert int(lower.fixed.sum()) == 9 and not ball.fixed.any()
    assert lower.material.youngs_modulus == 100.0 * ball.material.youngs_modulus


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_the_slots_of_the_fruits_do_not_overlap(seed):
    print(f"seed {seed}")
    taken = list(bowl.slots(bowl.COUNTS, np.random.default_rng(seed)))
    assert len(taken) == sum(bowl.COUNTS.values())
    place = np.array([place for _, place in taken])
    size = np.array([bowl.SLOTS.get(kind, bowl.SLOTS["round"]) for kind, _ in taken])
    between = np.linalg.norm(place[:, None, :2] - place[:, :2], axis=2)
    apart = between > np.add.outer(size[:, 0], size[:, 0])
    apart |= np.abs(np.subtract.outer(place[:, 2], place[:, 2])) > np.add.outer(
        size[:, 1], size[:, 1]
    )
    assert (apart | np.eye(len(taken), dtype=bool)).all()


def test_a_fruit_fits_into_its_slot_however_it_is_turned():
    for kind, mesh in bowl.fruits().items():
        radius, half = bowl.SLOTS.get(kind, bowl.SLOTS["round"])
        about_z = np.linalg.norm(mesh.vertices[:, :2], axis=1).max()
        if kind in ("apple", "lemon"):  # turned about any axis
            assert np.linalg.norm(mesh.vertices, axis=1).max() < min(radius, half)
        else:
            assert about_z < radius and np.abs(mesh.vertices[:, 2]).max() < half


def test_fruits_start_inside_or_above_the_hollow_of_the_dish():
    dish, *fruits = bowl.build().bodies
    radius, depth, wall = (bowl.DISH[key] for key in ("radius", "depth", "thickness"))
    curve = 0.5 * (radius**2 + depth**2) / depth
    centre = np.array([0.0, 0.0, curve + wall])
    edge = np.linalg.norm(np.diff(dish.x[dish.mesh.edges], axis=1)[:, 0], axis=1).max()
    inner = curve - edge**2 / (2.0 * curve)  # facets lie within the sphere by less than this
    for fruit in fruits:
        below = fruit.x[fruit.x[:, 2] < wall + depth]
        assert (np.linalg.norm(below - centre, axis=1) < inner).all()
        assert np.linalg.norm(fruit.x[:, :2], axis=1).max() < radius + 0.01
    assert dish.fixed.all()


def test_the_bowl_repeats_for_a_seed_and_thins_out_by_a_fraction():
    one, two = bowl.build(fraction=0.1), bowl.build(fraction=0.1)
    assert len(one.bodies) == 1 + 5 + 6 + 11 + 11
    for a, b in zip(one.bodies, two.bodies, strict=True):
        np.testing.assert_array_equal(a.x, b.x)
    assert not np.array_equal(one.bodies[1].x, bowl.build(fraction=0.1, seed=6).bodies[1].x)


def test_fine_fruits_move_as_coarse_ones_and_have_their_volume():
    coarse, fine = (Simulation(bowl.build(fraction=0.02, fine=f)) for f in (False, True))
    for sim in coarse, fine:
        for _ in sim.frames(2):
            pass
    np.testing.assert_array_equal(coarse.positions(), fine.positions())
    for body in fine.scene.bodies[1:]:
        assert body.render.volume == pytest.approx(body.mesh.volume)
        sizes = (np.ptp(x, axis=0) for x in (body.render.vertices, body.mesh.vertices))
        np.testing.assert_allclose(*sizes, rtol=0.2)
    assert fine.rendered(1)[0].shape == fine.scene.bodies[1].render.vertices.shape


@pytest.mark.parametrize("name", scenes.names())
def test_a_scene_runs_without_overlap_and_without_inverting_a_tet(name):
    scene = bowl.build(fraction=0.1) if name == "bowl" else scenes.load(name).build()
    sim = Simulation(scene)
    edge = sim.model.body_edge.numpy().min()
    starts_inside = sim.measure().overlap > 0.0
    assert starts_inside == (name == "two_bodies")
    for _ in sim.frames(15 if name == "bowl" else 5):  # to the first contacts
        now = sim.measure()
        print(f"{name} {sim.frame}: overlap {now.overlap / edge:.2e} edges")
        assert np.isfinite(sim.positions()).all() and np.isfinite(sim.velocities()).all()
        assert np.isfinite(now.energy) and now.volume_ratio > 0.0
        # Of the smallest edge; bodies that start inside each other take their time.
        assert starts_inside or now.overlap <= 0.01 * edge
