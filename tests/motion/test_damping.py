"""Damping: its matrix, and forces.damp as a step of its own."""

import numpy as np
import pytest
import warp as wp
from numpy.polynomial.legendre import Legendre

from warp_contact.frame import damping, step_bounds
from warp_contact.kernels.motion import motion
from warp_contact.scene.materials import Corotated, NeoHookean, SpringNetwork
from warp_contact.step import forces

BETA = 1e-2  # [s]
EPS = 1.2e-7  # float32
MATERIALS = [
    NeoHookean(1e5, 0.3, 1000.0, BETA),
    NeoHookean(1e5, -0.6, 1000.0, BETA),
    Corotated(1e5, 0.3, 1000.0, BETA),
    SpringNetwork(3e3, 2e3, 1e3, 1000.0, BETA),
]
materials = pytest.mark.parametrize("material", MATERIALS)


@pytest.fixture
def body(box, rng):
    x, tets = box((2, 1, 1))
    return x + 0.1 * rng.uniform(-1.0, 1.0, x.shape), tets


def deformed(x: np.ndarray, rng) -> np.ndarray:
    return x * [0.8, 1.3, 1.0] + 0.1 * rng.uniform(-1.0, 1.0, x.shape)


def damp(model, x, v, dt: float, stages: int, share: float = 0.5) -> np.ndarray:
    v = wp.array(v, dtype=wp.vec3)
    f_tet = wp.full(4 * model.n_tet, wp.vec3(np.nan))  # scratch: whatever it holds
    scratch = tuple(wp.full(model.n_vert, wp.vec3(np.nan)) for _ in range(2))
    x = wp.array(x, dtype=wp.vec3)
    dt, share = (wp.full(1, value, dtype=float) for value in (dt, share))
    forces.damp(model, x, v, model.inv_mass, dt, f_tet, scratch, stages, share)
    return v.numpy().astype(float)


def limit(stages: int, share: float = 0.5) -> float:
    """Largest dt lambda_max for which ``forces.damp`` is stable."""
    return share * (stages**2 + stages)


def factors(stages: int, share: float, part) -> np.ndarray:
    """What is left of a mode at a part of the limit."""
    return 1.0 - share + share * Legendre.basis(stages)(1.0 - 2.0 * part)


def fastest(dense, model, x) -> tuple[float, np.ndarray]:
    """Largest eigenvalue [1/s] of M^-1 C and its eigenvector, from the full matrix."""
    root = np.sqrt(np.repeat(model.inv_mass.numpy().astype(float), 3))
    c = dense(forces.apply_damping, model, x)
    value, vector = np.linalg.eigh(root[:, None] * (c + c.T) / 2.0 * root)
    return value[-1], (root * vector[:, -1]).reshape(-1, 3)


@materials
def test_damping_is_symmetric_and_takes_energy(material, body, rng, build_model, dense):
    model = build_model((*body, material))
    c = dense(forces.apply_damping, model, deformed(body[0], rng))
    size = np.abs(c).max()
    # Entries are sums of about ten products, each rounded.
    np.testing.assert_allclose(c, c.T, atol=20.0 * EPS * size)
    assert np.linalg.eigvalsh(c)[0] > -100.0 * EPS * size


@materials
def test_rigid_motion_is_not_damped(material, body, rng, build_model, at_vertices):
    x = deformed(body[0], rng)
    model = build_model((*body, material))
    spin, drift = rng.standard_normal((2, 3))
    shear = at_vertices(forces.apply_damping, model, x, x[:, [1, 2, 0]])
    rigid = at_vertices(forces.apply_damping, model, x, drift + np.cross(spin, x))
    # The rates that cancel are as large as those of the shear, each rounded a few times.
    assert np.abs(rigid).max() < 100.0 * EPS * np.abs(shear).max()


@materials
def test_damping_is_beta_times_the_stiffness_at_rest(material, body, build_model, dense):
    model = build_model((*body, material))
    c = dense(forces.apply_damping, model, body[0])
    k = dense(forces.apply_stiffness, model, body[0])
    # Rest is met to float32 only: the stress of one EPS of strain stays in K.
    np.testing.assert_allclose(c, BETA * k, atol=100.0 * EPS * np.abs(c).max())


@materials
@pytest.mark.parametrize("share", damping.SHARE)
@pytest.mark.parametrize("stages", [1, 2, 3, 4, 7])
def test_a_mode_shrinks_by_the_stability_polynomial(
    material, stages, share, body, rng, build_model, dense
):
    x = deformed(body[0], rng).astype(np.float32)
    model = build_model((*body, material))
    rate, mode = fastest(dense, model, x)
    dt = 0.7 * limit(stages, share) / rate
    factor = factors(stages, share, 0.7)
    # Every stage rounds v a few times.
    atol = 100.0 * EPS * np.abs(mode).max()
    new = damp(model, x, mode, dt, stages, share)
    np.testing.assert_allclose(new, factor * mode, atol=atol)


def test_with_the_least_share_no_mode_is_turned_round():
    z = np.linspace(0.0, 1.0, 10001)[:-1]
    for stages in range(1, 20):
        factor = factors(stages, damping.SHARE[0], z)
        # P_s > -1 inside (-1, 1); only odd ones come near it, where z comes near its limit.
        assert factor.min() > 0.0
        assert factor.max() <= 1.0 + 1e-12  # rounding


def test_steps_are_stable_whatever_share_is_needed():
    """Of any mode within reach, with and without a damping in proportion to its stiffness."""
    ends = [damping.reach(stages, damping.SHARE[1]) for stages in range(1, 13)]
    for z in [
        *np.geomspace(1e-3, 200.0, 400),
        *np.array(ends) / damping.RATE_MARGIN * (1.0 - 1e-12),
    ]:
        stages, share = damping.stages_for(z, 1.0), damping.share_for(z, 1.0)
        reach = damping.reach(stages, share)
        part = np.linspace(0.0, reach / limit(stages, share), 2001)
        least = factors(stages, share, part).min()
        assert least >= -1.0 / 6.0 - 1e-9  # rounding
        h = damping.longest_step(stages, share)
        assert h**2 <= 2.0 * (1.0 + least) * (1.0 + 1e-9)  # rounding
        assert step_bounds.UNSTABLE * h > 2.0 * step_bounds.SAFETY


@materials
@pytest.mark.parametrize("share", damping.SHARE)
def test_damp_keeps_momentum_and_never_adds_energy(material, share, body, rng, build_model, dense):
    x = deformed(body[0], rng)
    model = build_model((*body, material))
    rate, _ = fastest(dense, model, x)
    mass = model.mass.numpy()[:, None].astype(float)
    v = rng.standard_normal(x.shape)
    for stages in (1, 2, 5, 12):
        for part in (0.01, 0.5, 1.0):
            new = damp(model, x, v, part * limit(stages, share) / rate, stages, share)
            scale = np.abs(mass * v).sum()
            # Opposite impulses up to dt lambda_max times v, each rounded.
            tolerance = 10.0 * EPS * limit(stages)
            assert np.abs((mass * (new - v)).sum(axis=0)).max() < tolerance * scale
            spin = np.cross(x, mass * (new - v)).sum(axis=0)
            assert np.abs(spin).max() < 10.0 * tolerance * scale
            assert (mass * new**2).sum() <= (mass * v**2).sum() * (1.0 + tolerance)


def test_fixed_vertices_keep_their_velocity(body, rng, build_model):
    fixed = [0, 3, 5]
    model = build_model((*body, MATERIALS[0]), fixed=fixed)
    v = rng.standard_normal(body[0].shape).astype(np.float32)
    for stages in (1, 2, 3, 4):
        new = damp(model, body[0], v, 1e-4, stages)
        np.testing.assert_array_equal(new[fixed], v[fixed])
        assert (new[1] != v[1]).any()


def test_undamped_bodies_are_left_alone(body, rng, build_model):
    free = NeoHookean(1e5, 0.3, 1000.0)
    x = np.concatenate([body[0], body[0]])
    v = rng.standard_normal(x.shape).astype(np.float32)
    n = len(body[0])
    mixed = build_model((*body, free), (*body, MATERIALS[2]))
    new = damp(mixed, x, v, 1e-4, 3)
    np.testing.assert_array_equal(new[:n], v[:n])
    assert (new[n:] != v[n:]).any()


def test_without_damping_nothing_is_launched(body, build_model, monkeypatch):
    model = build_model((*body, NeoHookean(1e5, 0.3, 1000.0)))
    monkeypatch.setattr(wp, "launch", None)
    x, v, dt, f_tet, w, share = (wp.zeros(1) for _ in range(6))
    forces.damp(model, x, v, model.inv_mass, dt, f_tet, (w, w), 5, share)


def test_damp_replays_from_a_graph(body, rng, build_model):
    model = build_model((*body, MATERIALS[0]))
    start = rng.standard_normal(body[0].shape)
    expected = damp(model, body[0], start, 1e-4, 3)
    x, v = wp.array(body[0], dtype=wp.vec3), wp.array(start, dtype=wp.vec3)
    f_tet, w = wp.zeros(4 * model.n_tet, dtype=wp.vec3), (wp.zeros_like(v), wp.zeros_like(v))
    dt, share = wp.full(1, 1.0, dtype=float), wp.full(1, 0.5, dtype=float)
    with wp.ScopedCapture() as capture:
        forces.damp(model, x, v, model.inv_mass, dt, f_tet, w, 3, share)
    dt.fill_(1e-4)
    v.assign(start.astype(np.float32))
    wp.capture_launch(capture.graph)
    np.testing.assert_array_equal(v.numpy(), expected)


def test_enough_stages_are_taken():
    for z in (0.0, 1e-3, 1.0, 10.0, 1e3):
        s = damping.stages_for(z / 1e-3, 1e-3)
        share = damping.share_for(z / 1e-3, 1e-3)
        assert damping.SHARE[0] <= share <= damping.SHARE[1]
        assert z * damping.RATE_MARGIN <= damping.reach(s, share) * (1.0 + 1e-12)  # rounding
        assert s == 0 or z * damping.RATE_MARGIN > damping.reach(s - 1, damping.SHARE[1])


@pytest.mark.parametrize("material", [NeoHookean, Corotated])
@pytest.mark.parametrize("ratio", [0.02, 0.1])
def test_first_mode_of_a_bar_decays_by_beta_omega_squared(material, ratio, box, build_model, dense):
    x, tets = box((8, 2, 2), 0.05)
    fixed = np.flatnonzero(x[:, 0] == 0.0)
    rest = build_model((x, tets, material(1e6, 0.3, 1000.0)), fixed=fixed)
    root = np.sqrt(np.repeat(rest.inv_mass.numpy().astype(float), 3))
    k = dense(forces.apply_stiffness, rest, x)
    value, vector = np.linalg.eigh(root[:, None] * (k + k.T) / 2.0 * root)
    first = 3 * len(fixed)  # after the zeros of the fixed vertices
    omega, mode = np.sqrt(value[first]), (root * vector[:, first]).reshape(-1, 3)

    model = build_model((x, tets, material(1e6, 0.3, 1000.0, 2.0 * ratio / omega)), fixed=fixed)
    state = wp.array(x + 1e-3 * mode / np.abs(mode).max(), dtype=wp.vec3)
    h = step_bounds.SAFETY * 2.0 / np.sqrt(value[-1])
    rate = 2.0 * ratio / omega * value[-1]
    assert h * rate > 4.0  # inside the forces it would have to be below 1 or so
    weight = model.mass.numpy()[:, None] * mode
    three_periods = int(3 * 2.0 * np.pi / omega / h)
    q, p = modal_motion(model, state, x, weight, h, rate, three_periods)
    envelope = np.log(np.hypot(omega * q, p + ratio * omega * q))
    decay = -np.polyfit(h * np.arange(len(q)), envelope, 1)[0]
    # The decay per radian is the logarithmic decrement over 2 pi.  Off by h omega, about 1 %,
    # from the splitting, and by the amplitude of 1e-3 m on edges of 0.05 m.
    assert decay == pytest.approx(ratio * omega, rel=0.05)


def modal_motion(model, x, rest, weight, h: float, rate: float, steps: int):
    """Amplitude and velocity of a mode over ``steps`` steps of symplectic Euler and damping."""
    v, unused = wp.zeros_like(x), wp.zeros_like(x)
    w = (wp.zeros_like(x), wp.zeros_like(x))
    f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
    mask = wp.full(model.n_tet, 1, dtype=int)
    stages, share = damping.stages_for(rate, h), damping.share_for(rate, h)
    dt, share = (wp.full(1, value, dtype=float) for value in (h, share))
    gather = [model.vt_start, model.vt_corner, f_tet, model.inv_mass, wp.vec3(*model.gravity), dt]
    with wp.ScopedCapture() as capture:
        forces.internal_forces(model, x, mask, f_tet)
        wp.launch(motion.kick, dim=model.n_vert, inputs=[*gather, x, v], outputs=[unused, v])
        forces.damp(model, x, v, model.inv_mass, dt, f_tet, w, stages, share)
        wp.launch(motion.advance, dim=model.n_vert, inputs=[dt, x, v], outputs=[x])
    q, p = np.empty(steps), np.empty(steps)
    for k in range(steps):
        q[k] = (weight * (x.numpy() - rest)).sum()
        p[k] = (weight * v.numpy()).sum()
        wp.capture_launch(capture.graph)
    return q, p
