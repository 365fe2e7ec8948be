"""shapes.py: counts, sizes, volumes, quality, and the same mesh every time."""

import numpy as np
import pytest

from warp_contact.scene.shapes import box, cylinder, dish, sphere

BALLS = [13, 41, 55, 147, 309, 561, 923, 2057]  # vertices
SHAPES = {
    "box": lambda: box((1.0, 2.0, 3.0), (2, 3, 4)),
    "sphere_41": lambda: sphere(0.5, 41),
    "sphere_309": lambda: sphere(0.5, 309),
    "cylinder": lambda: cylinder(0.5, 1.0, rings=3),
    "dish": lambda: dish(0.5, 0.3, 0.05),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_the_same_every_time(name):
    one, two = SHAPES[name](), SHAPES[name]()
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.tets, two.tets)


@pytest.mark.parametrize("name", SHAPES)
def test_the_surface_of_a_shape_is_one_closed_piece_without_handles(name):
    mesh = SHAPES[name]()
    n_vert = len(np.unique(mesh.surface))
    assert n_vert - len(mesh.surface_edges) + len(mesh.surface) == 2


def test_a_box_has_its_size_and_five_tets_a_cell():
    mesh = box((1.0, 2.0, 3.0), (2, 3, 4))
    np.testing.assert_allclose(mesh.vertices.min(axis=0), [-0.5, -1.0, -1.5])
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [0.5, 1.0, 1.5])
    assert (len(mesh.vertices), len(mesh.tets)) == (3 * 4 * 5, 5 * 2 * 3 * 4)
    assert mesh.volume == pytest.approx(6.0, rel=1e-13)  # rounding of 120 terms


def test_mirrored_swaps_the_diagonals_of_a_box():
    one, two = box(1.0, 3), box(1.0, 3, mirrored=True)
    flipped = one.scaled(-1.0, 1.0, 1.0)

    def segments(mesh):
        ends = np.round(mesh.vertices[mesh.edges], 9) + 0.0
        return {tuple(sorted(map(tuple, pair.tolist()))) for pair in ends}

    assert segments(one) != segments(two)
    # Three cells across: the mirror image of an odd chess board has its colours in the same places
    # and so mirrored cells there.
    assert segments(flipped) == segments(two)


def test_boxes_on_each_other_match_with_the_colour_continued():
    lower, upper = box(1.0, 3), box(1.0, 3, mirrored=True)

    def diagonals(mesh, z):
        at = np.abs(mesh.vertices[:, 2] - z) < 1e-9
        on = mesh.edges[at[mesh.edges].all(axis=1)]
        ends = np.round(mesh.vertices[on][:, :, :2], 9) + 0.0
        return {tuple(sorted(map(tuple, pair.tolist()))) for pair in ends}

    assert diagonals(lower, 0.5) == diagonals(upper, -0.5)


def test_a_box_is_equally_stiff_in_the_three_axes_by_its_edges():
    mesh = box(1.0, 4)
    span = mesh.vertices[mesh.edges[:, 1]] - mesh.vertices[mesh.edges[:, 0]]
    tensor = span.T @ span
    # Exactly isotropic but for rounding: as many diagonals one way as the other.
    np.testing.assert_allclose(tensor, np.eye(3) * tensor[0, 0], atol=1e-12)


@pytest.mark.parametrize("count", BALLS)
def test_a_sphere_has_good_tets_and_its_surface_on_the_radius(count):
    mesh = sphere(2.0, count)
    worst = mesh.quality.min()
    print(f"{len(mesh.vertices)} vertices: worst tet {worst:.3f}")
    assert len(mesh.vertices) == count
    assert worst > 0.5
    on_surface = np.unique(mesh.surface)
    # float64 rounding of a normalisation
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices[on_surface], axis=1), 2.0, rtol=1e-14)
    assert not np.isin(mesh.tets, on_surface).all(axis=1).any()


def test_the_coarse_sphere_of_the_paper_has_41_vertices_and_70_triangles():
    mesh = sphere(1.0)
    assert (len(mesh.vertices), len(mesh.surface), len(np.unique(mesh.surface))) == (41, 70, 37)


def test_a_sphere_takes_the_nearest_count_on_offer():
    counts = [len(sphere(1.0, n).vertices) for n in (1, 26, 40, 50, 100, 102, 400)]
    assert counts == [13, 13, 41, 55, 55, 147, 309]


def test_the_volume_of_a_sphere_converges_with_the_square_of_its_edge():
    ball = 4.0 / 3.0 * np.pi
    error = [1.0 - sphere(1.0, n).volume / ball for n in (55, 309)]  # two and four shells
    # Halving the edge quarters the error; higher orders leave 10 %.
    assert error[0] / error[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("rings", "layers"), [(1, 1), (2, 3), (4, None)])
def test_a_cylinder_is_a_polygon_times_its_height(rings, layers):
    mesh = cylinder(0.5, 1.2, rings, layers)
    sides = 6 * rings
    polygon = 0.5 * sides * 0.25 * np.sin(2.0 * np.pi / sides)
    assert mesh.volume == pytest.approx(1.2 * polygon, rel=1e-12)  # rounding of the sum
    np.testing.assert_allclose(mesh.vertices[:, 2].max(), 0.6)


def test_a_cylinder_with_its_own_layers_has_good_tets():
    for rings in (1, 2, 4, 6):
        worst = cylinder(0.5, 2.0, rings).quality.min()
        print(f"{rings} rings: worst tet {worst:.3f}")
        assert worst > 0.5


def test_a_dish_is_a_cap_of_a_spherical_shell():
    radius, depth, wall = 0.5, 0.4, 0.035
    mesh = dish(radius, depth, wall, rings=14)
    curve = 0.5 * (radius**2 + depth**2) / depth
    cap = 2.0 * np.pi / 3.0 * ((curve + wall) ** 3 - curve**3) * depth / curve
    # Facets cut (edge / 2 curve)^2 = 0.4 % off the sphere.
    assert mesh.volume == pytest.approx(cap, rel=0.01)
    distance = np.linalg.norm(mesh.vertices - [0.0, 0.0, curve + wall], axis=1)
    # float64 rounding
    np.testing.assert_allclose(np.unique(np.round(distance, 12)), [curve, curve + wall])
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-15)
    assert mesh.quality.min() > 0.5
    rim = mesh.vertices[distance < curve + 1e-9]
    assert np.hypot(rim[:, 0], rim[:, 1]).max() == pytest.approx(radius, rel=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda: box(0.0, 1),
        lambda: box(1.0, 0),
        lambda: sphere(-1.0),
        lambda: sphere(float("nan")),
        lambda: sphere(1.0, 0),
        lambda: cylinder(1.0, 0.0),
        lambda: cylinder(1.0, 1.0, rings=0),
        lambda: cylinder(1.0, 1.0, layers=0),
        lambda: dish(1.0, 1.0, 0.0),
        lambda: dish(1.0, 1.0, 0.1, rings=0),
    ],
)
def test_a_shape_without_size_is_refused(make):
    with pytest.raises(ValueError, match=": give "):
        make()
