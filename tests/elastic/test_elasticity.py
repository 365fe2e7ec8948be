"""Isotropic models, one of them an example: derivatives, small strain, inversion."""

import numpy as np
import pytest
import warp as wp

from warp_contact.scene.materials import Corotated, NeoHookean
from warp_contact.scenes.examples.material import StVenantKirchhoff
from warp_contact.step import forces

E, NU, RHO = 1e5, 0.3, 1000.0  # [Pa], [-], [kg/m^3]
MODELS = [NeoHookean, Corotated, StVenantKirchhoff]
EPS = 1.2e-7  # float32


def polar(f: np.ndarray) -> np.ndarray:
    u, _, vt = np.linalg.svd(f)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return u @ vt


def barrier(j: np.ndarray) -> np.ndarray:
    """What keeps J above 0: a logarithm from 1/4 on, a parabola from 1/20 on."""
    c, j0 = np.clip(j, 0.05, 0.25), 0.25
    d, log = c - j0, np.log(c / j0)
    slope = -10.0 * (2.0 * d * log + d * d / c)
    bend = -10.0 * (2.0 * log + 4.0 * d / c - (d / c) ** 2)
    e = np.minimum(j - c, 0.0)
    return -10.0 * d * d * log + e * slope + e * e * bend / 2.0


def density(material, f: np.ndarray) -> np.ndarray:
    """Energy density [Pa] straight from the formula, in float64."""
    mu, lam = material.lame()
    j = np.linalg.det(f)
    if isinstance(material, StVenantKirchhoff):
        e = (np.swapaxes(f, -1, -2) @ f - np.eye(3)) / 2.0
        trace = np.trace(e, axis1=-2, axis2=-1)
        return mu * (e * e).sum((-1, -2)) + lam / 2.0 * trace**2 + (lam + mu) * barrier(j)
    if isinstance(material, NeoHookean):
        shear = mu / 2.0 * ((f * f).sum((-1, -2)) - 3.0) - mu * (j - 1.0)
        return shear + (lam + mu) * ((j - 1.0) ** 2 / 2.0 + barrier(j))
    return mu * ((f - polar(f)) ** 2).sum((-1, -2)) + lam / 2.0 * (j - 1.0) ** 2


def gradients(model, x: np.ndarray) -> np.ndarray:
    c = x[model.tets.numpy()]
    return np.swapaxes(c[:, 1:] - c[:, :1], 1, 2) @ model.pose.numpy().astype(float)


def energy(material, model, x: np.ndarray) -> float:
    return float(model.volume.numpy().astype(float) @ density(material, gradients(model, x)))


def slope(fun, x: np.ndarray, h: float) -> np.ndarray:
    g = np.empty(x.size)
    for k, e in enumerate(np.eye(x.size).reshape(-1, *x.shape)):
        g[k] = (fun(x + h * e) - fun(x - h * e)) / (2.0 * h)
    return g.reshape(x.shape)


def turn(rng) -> np.ndarray:
    return polar(rng.standard_normal((3, 3)))


def deformed(x: np.ndarray, how: str, rng) -> np.ndarray:
    stretch, noise = {
        "strained": ([1.1, 0.9, 1.05], 0.05),
        "flat": ([1.2, 0.8, 0.14], 0.005),
        # R has no differential where two singular values cancel: stay away from there.
        "inverted": ([1.2, 0.8, -0.5], 0.01),
    }[how]
    moved = x * stretch + noise * rng.standard_normal(x.shape)
    return (moved @ turn(rng).T).astype(np.float32).astype(float)


@pytest.fixture
def block(box, build_model, rng):
    """One cell of six tets, its vertices moved at random, and its model for a material."""
    x, tets = box((1, 1, 1))
    x += 0.1 * rng.uniform(-1.0, 1.0, x.shape)
    return x, lambda material: build_model((x, tets, material))


@pytest.mark.parametrize("how", ["strained", "flat", "inverted"])
@pytest.mark.parametrize("kind", MODELS)
def test_forces_are_minus_the_energy_slope(kind, how, block, rng, forces_of):
    material = kind(E, NU, RHO)
    model = block[1](material)
    x = deformed(block[0], how, rng)
    expected = -slope(lambda y: energy(material, model, y), x, 1e-5)
    # F is off by a few roundings, which the moduli turn into forces on faces of about 1 m^2.
    largest = max(E, np.abs(expected).max())
    np.testing.assert_allclose(forces_of(model, x), expected, atol=100.0 * EPS * largest)


@pytest.mark.parametrize("how", ["strained", "flat", "inverted"])
@pytest.mark.parametrize("kind", MODELS)
def test_stiffness_is_minus_the_force_differential(kind, how, block, rng, at_vertices):
    material = kind(E, NU, RHO)
    model = block[1](material)
    x = deformed(block[0], how, rng)
    dx = rng.standard_normal(x.shape).astype(np.float32).astype(float)
    h = 1e-4

    def along(y):
        return (energy(material, model, y + h * dx) - energy(material, model, y - h * dx)) / 2 / h

    expected = slope(along, x, h)
    # Twice differenced: truncation about h^2 = 1e-8 and rounding 1e-16 / h^2 = 1e-8 of the
    # moduli; next to the mirror states of an inverted tet dR magnifies roundings of F.
    near = 1e-4 if how == "strained" else 1e-3
    got = at_vertices(forces.apply_stiffness, model, x, dx)
    np.testing.assert_allclose(got, expected, atol=near * np.abs(expected).max())


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("strain", [1e-3, 1e-2, 0.3])
def test_energies_of_small_strains_do_not_cancel(kind, strain, block, rng):
    material = kind(E, NU, RHO)
    model = block[1](material)
    a = np.eye(3) + strain * rng.uniform(-1.0, 1.0, (3, 3))
    x = (block[0] @ (turn(rng) @ a).T).astype(np.float32)
    got = wp.zeros(model.n_tet)
    forces.energies(model, wp.array(x, dtype=wp.vec3), got)
    expected = model.volume.numpy() * density(material, gradients(model, x.astype(float)))
    # A rounding of F changes the energy by 2 EPS / strain of itself; F has about ten.
    np.testing.assert_allclose(got.numpy(), expected, rtol=20.0 * EPS / strain + 1e-5)


@pytest.mark.parametrize("kind", MODELS)
def test_stress_is_right_at_small_strain(kind, block, rng, forces_of):
    material = kind(E, NU, RHO)
    model = block[1](material)
    x = block[0] @ (np.eye(3) + 1e-4 * rng.uniform(-1.0, 1.0, (3, 3))).T
    x = x.astype(np.float32).astype(float)
    expected = -slope(lambda y: energy(material, model, y), x, 1e-6)
    # Edges and F = 1 + 1e-4 are rounded by EPS / 2 a few times: seen up to 0.2 %.
    error = np.linalg.norm(forces_of(model, x) - expected) / np.linalg.norm(expected)
    assert error < 4e-3


@pytest.mark.parametrize("kind", MODELS)
def test_no_force_at_rest(kind, block, forces_of):
    model = block[1](kind(E, NU, RHO))
    # Rest positions and inverse edges are rounded to float32, each worth one EPS of strain.
    assert np.abs(forces_of(model, block[0])).max() < 10.0 * EPS * E


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3, 0.45])
def test_bar_has_the_modulus_and_the_ratio_asked_for(kind, nu, box, build_model, rng, forces_of):
    x, tets = box((6, 2, 2), 0.5)
    inside = ((x > 0.0) & (x < x.max(axis=0))).all(axis=1)
    x[inside] += 0.1 * rng.uniform(-1.0, 1.0, (inside.sum(), 3))
    model = build_model((x, tets, kind(E, nu, RHO)))
    strain = 1e-3
    f = forces_of(model, x * [1.0 + strain, 1.0 - nu * strain, 1.0 - nu * strain])
    right = x[:, 0] == x[:, 0].max()
    # Of second order in the strain: a few 1e-3.  Section: 1 m^2.
    assert -f[right, 0].sum() == pytest.approx(E * strain, rel=5e-3)
    f[right | (x[:, 0] == 0.0), 0] = 0.0
    assert np.abs(f).max() < 5e-3 * E * strain


@pytest.mark.parametrize("stretch", [0.5, 1.5, 3.0])
def test_corotated_bar_without_poisson_effect_is_linear(stretch, box, build_model, forces_of):
    x, tets = box((3, 1, 1))
    f = forces_of(build_model((x, tets, Corotated(E, 0.0, RHO))), x * [stretch, 1.0, 1.0])
    # Roundings of F only: the formula is exact.
    assert -f[x[:, 0] == 3.0, 0].sum() == pytest.approx(E * (stretch - 1.0), rel=1e-5)


@pytest.mark.parametrize("kind", MODELS)
def test_forces_carry_no_momentum(kind, block, rng, forces_of):
    x = deformed(block[0], "strained", rng)
    f = forces_of(block[1](kind(E, NU, RHO)), x)
    # The eight forces are about 1e4 N each.
    assert np.abs(f.sum(axis=0)).max() < 10.0 * EPS * np.abs(f).sum()
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 50.0 * EPS * np.abs(f).sum()


@pytest.mark.parametrize("kind", MODELS)
def test_an_inverted_tet_pushes_back(kind, build_model, forces_of):
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    model = build_model((x, np.array([[0, 1, 2, 3]]), kind(E, NU, RHO)))
    for height in (0.0, -0.1, -0.5, -1.5):
        f = forces_of(model, x * [1.0, 1.0, height])
        assert f[3, 2] > 0.1 * E / 6.0


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("shape", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, -1], [-1, -1, -1]])
def test_a_degenerate_tet_has_finite_forces(kind, shape, block, forces_of, at_vertices, rng):
    model = block[1](kind(E, NU, RHO))
    x = block[0] * shape
    assert np.abs(forces_of(model, x)).max() < 1000.0 * E
    dx = rng.standard_normal(x.shape)
    # R has no differential where two singular values cancel: finite is all that is asked.
    assert np.isfinite(at_vertices(forces.apply_stiffness, model, x, dx)).all()


@pytest.mark.parametrize("shape", [[1, 1, -1], [-1, -1, -1], [-1, 2, 2], [1, 0, 0], [1, 1, 0]])
def test_a_mirrored_tet_is_pushed_towards_a_nearest_rotation(shape, build_model, forces_of, rng):
    """Of which there are many there: the force is that of one of them, not of something else."""
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.0, 1.0, 0.2], [0.3, 0.0, 1.0]])
    model = build_model((x, np.array([[0, 1, 2, 3]]), Corotated(E, 0.0, RHO)))
    mu = E / 2.0  # without a Poisson effect: P = 2 mu (F - R)
    f = turn(rng) @ np.diag(shape).astype(float) @ turn(rng)
    at_corners = -forces_of(model, x @ f.T)[1:].T  # V P Dm^-T
    p = at_corners @ (x[1:] - x[0]) / model.volume.numpy()[0]
    r = f - p / (2.0 * mu)
    # Roundings of F, of the singular vectors and of the edges.
    np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-5)
    assert np.linalg.det(r) == pytest.approx(1.0, abs=1e-5)
    # No rotation is nearer: the trace of R^T F is that of NumPy's polar decomposition.
    assert (r * f).sum() == pytest.approx((polar(f) * f).sum(), abs=1e-5)


def test_tets_outside_the_mask_keep_their_forces(block):
    model = block[1](NeoHookean(E, NU, RHO))
    f_tet = wp.full(4 * model.n_tet, wp.vec3(1.0, 2.0, 3.0))
    mask = np.arange(model.n_tet) % 2
    x = wp.array(1.1 * block[0], dtype=wp.vec3)
    forces.internal_forces(model, x, wp.array(mask, dtype=int), f_tet)
    kept = (f_tet.numpy().reshape(-1, 12) == 4 * [1.0, 2.0, 3.0]).all(axis=1)
    np.testing.assert_array_equal(kept, mask == 0)


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize(
    "numbers",
    [
        (0.0, NU, RHO),
        (-E, NU, RHO),
        (E, 0.5, RHO),
        (E, -1.0, RHO),
        (E, NU, 0.0),
        (E, NU, RHO, -1e-3),
        (np.nan, NU, RHO),
        (E, NU, np.inf),
    ],
)
def test_impossible_numbers_are_refused(kind, numbers):
    kind(E, NU, RHO, 1e-3).check()
    with pytest.raises(ValueError, match=": give a "):
        kind(*numbers)
