"""kernels/elastic/springs.py: derivatives, the share of each tet, invariance."""

import numpy as np
import pytest
import warp as wp

from warp_contact.scene.materials import EDGES, OPPOSITE, SpringNetwork
from warp_contact.step import forces

RHO = 1000.0  # [kg/m^3]
EPS = 1.2e-7  # float32
TERMS = [(3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0), (3.0, 2.0, 1.0)]  # [J]


def once(tets: np.ndarray, parts: tuple, most: int = 99) -> np.ndarray:
    """Every edge or face once, those with more than ``most`` tets left out."""
    rows = np.sort(tets[:, np.array(parts)].reshape(-1, len(parts[0])), axis=1)
    rows, count = np.unique(rows, axis=0, return_counts=True)
    return rows[count <= most]


def measures(x: np.ndarray, tets: np.ndarray) -> list[np.ndarray]:
    """Edge lengths, areas of surface triangles, signed volumes."""
    p, q = np.moveaxis(x[once(tets, EDGES)], 1, 0)
    a, b, c = np.moveaxis(x[once(tets, OPPOSITE, 1)], 1, 0)
    corner = x[tets]
    return [
        np.linalg.norm(q - p, axis=1),
        0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1),
        np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6.0,
    ]


def energy(material: SpringNetwork, rest: np.ndarray, tets: np.ndarray, x: np.ndarray) -> float:
    terms = zip(
        (material.distance, material.area, material.volume),
        measures(rest, tets),
        measures(x, tets),
        strict=True,
    )
    return sum(0.5 * k * (((now - then) / then) ** 2).sum() for k, then, now in terms)


def slope(fun, x: np.ndarray, h: float) -> np.ndarray:
    steps = h * np.eye(x.size).reshape(-1, *x.shape)
    return np.reshape([(fun(x + e) - fun(x - e)) / (2.0 * h) for e in steps], x.shape)


@pytest.fixture
def mesh(box, rng):
    """Two cells of six tets, so that one face of the cells lies inside, moved at random."""
    x, tets = box((2, 1, 1))
    return x + 0.1 * rng.uniform(-1.0, 1.0, x.shape), tets


def deformed(x: np.ndarray, rng) -> np.ndarray:
    y = x * [0.9, 1.2, 1.0] + 0.1 * rng.uniform(-1.0, 1.0, x.shape)
    return y.astype(np.float32).astype(float)


@pytest.mark.parametrize("terms", TERMS)
def test_forces_are_minus_the_energy_slope(terms, mesh, rng, build_model, forces_of):
    rest, tets = mesh
    material = SpringNetwork(*terms, RHO)
    x = deformed(rest, rng)
    expected = -slope(lambda y: energy(material, rest, tets, y), x, 1e-5)
    # Strains are off by roundings of x, up to 2, over sizes down to 0.1; forces are about 10 N.
    got = forces_of(build_model((rest, tets, material)), x)
    np.testing.assert_allclose(got, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("terms", TERMS)
def test_stiffness_is_minus_the_force_differential(terms, mesh, rng, build_model, at_vertices):
    rest, tets = mesh
    material = SpringNetwork(*terms, RHO)
    model = build_model((rest, tets, material))
    x = deformed(rest, rng)
    dx = rng.standard_normal(x.shape).astype(np.float32).astype(float)
    h = 1e-4

    def along(y):
        ahead = energy(material, rest, tets, y + h * dx)
        return (ahead - energy(material, rest, tets, y - h * dx)) / (2.0 * h)

    expected = slope(along, x, h)
    got = at_vertices(forces.apply_stiffness, model, x, dx)
    # Truncation about h^2 = 1e-8 and rounding 1e-16 / h^2 = 1e-8 of k over small sizes squared.
    np.testing.assert_allclose(got, expected, atol=1e-4 * np.abs(expected).max())


def test_each_spring_stores_its_energy_once(mesh, build_model):
    rest, tets = mesh
    material = SpringNetwork(3.0, 2.0, 1.0, RHO)
    model = build_model((rest, tets, material))
    got = wp.zeros(model.n_tet)
    forces.energies(model, wp.array(1.1 * rest, dtype=wp.vec3), got)
    n = [len(m) for m in measures(rest, tets)]
    expected = sum(
        0.5 * k * count * (1.1**power - 1.0) ** 2
        for k, count, power in zip((3.0, 2.0, 1.0), n, (1, 2, 3), strict=True)
    )
    # Strains of 0.1 and more, each with a few EPS.
    assert got.numpy().sum() == pytest.approx(expected, rel=1e-4)


def test_forces_carry_no_momentum(mesh, rng, build_model, forces_of):
    rest, tets = mesh
    x = deformed(rest, rng)
    f = forces_of(build_model((rest, tets, SpringNetwork(3.0, 2.0, 1.0, RHO))), x)
    # Each spring's forces cancel to rounding; lever arms are up to 2 m.
    assert np.abs(f.sum(axis=0)).max() < 10.0 * EPS * np.abs(f).sum()
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 50.0 * EPS * np.abs(f).sum()


def test_the_volume_spring_turns_an_inverted_tet_back(build_model, forces_of):
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    model = build_model((x, np.array([[0, 1, 2, 3]]), SpringNetwork(0.0, 0.0, 1.0, RHO)))
    for height in (0.0, -0.5, -2.0):
        # C = height - 1 and dC/dz = 1 at corner 3; a few roundings.
        f = forces_of(model, x * [1.0, 1.0, height])
        assert f[3, 2] == pytest.approx(1.0 - height, rel=1e-5)


@pytest.mark.parametrize("shape", [[0, 0, 0], [1, 0, 0], [1, 1, 0]])
def test_a_collapsed_body_has_finite_forces(shape, mesh, rng, build_model, forces_of, at_vertices):
    rest, tets = mesh
    model = build_model((rest, tets, SpringNetwork(3.0, 2.0, 1.0, RHO)))
    x = rest * shape
    assert np.isfinite(forces_of(model, x)).all()
    dx = rng.standard_normal(x.shape)
    assert np.isfinite(at_vertices(forces.apply_stiffness, model, x, dx)).all()


@pytest.mark.parametrize(
    "numbers",
    [
        (-1.0, 0.0, 1.0, RHO),
        (1.0, -1.0, 1.0, RHO),
        (1.0, 0.0, -1.0, RHO),
        (1.0, 0.0, 1.0, 0.0),
        (1.0, 0.0, 1.0, RHO, -1.0),
        (np.inf, 0.0, 1.0, RHO),
    ],
)
def test_impossible_numbers_are_refused(numbers):
    SpringNetwork(1.0, 0.0, 1.0, RHO, 1e-3).check()
    with pytest.raises(ValueError, match=": give a "):
        SpringNetwork(*numbers)
