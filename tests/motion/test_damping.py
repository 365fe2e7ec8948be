"""Damping: its matrix, its polynomial, and how it acts together with forces and contacts."""

from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp
from numpy.polynomial.chebyshev import chebval

from warp_contact import Scene, Simulation, SimulationError, TetMesh
from warp_contact import box as block
from warp_contact.data.damping import allocate
from warp_contact.data.state import State
from warp_contact.frame import step_bounds
from warp_contact.frame.damping import RATE_MARGIN, coefficients, prepare, reach_for, stages_for
from warp_contact.scene.materials import Corotated, NeoHookean, SpringNetwork
from warp_contact.step import damping as step
from warp_contact.step import forces
from warp_contact.step.motion import predict

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


def ready(model, x, v, dt: float, rate: float) -> tuple[State, SimpleNamespace, int]:
    """State, those buffers that the motion needs, and stages of a step ``dt``."""
    state = State(wp.array(x, dtype=wp.vec3), wp.array(v, dtype=wp.vec3))
    tets = wp.full(model.n_tet, 1, dtype=int)
    work = SimpleNamespace(
        dt=wp.full(model.n_vert, dt, dtype=float),
        ties=None,
        rebound=None,
        awake=SimpleNamespace(tets=tets, inv_mass=model.inv_mass),
        f_tet=wp.zeros(4 * model.n_tet, dtype=wp.vec3),
        x=wp.zeros(model.n_vert, dtype=wp.vec3),
        damping=allocate(model),
        implicit=None,
    )
    of_vert, world = np.zeros(model.n_vert, dtype=int), np.ones(1)
    given = rate * world, dt * world, of_vert, 0.0 * world
    return state, work, prepare(work.damping, *given)


def damp(model, x, v, dt: float, rate: float) -> np.ndarray:
    """Velocities after a step of damping alone."""
    state, work, stages = ready(model, x, v, dt, rate)
    work.f_tet.fill_(wp.vec3(np.nan))  # scratch: whatever it holds
    work.damping.odd.fill_(wp.vec3(np.nan))
    step.damp(model, state.x, state.v, work, stages)
    return state.v.numpy().astype(float)


def left(z: np.ndarray, rate: float) -> np.ndarray:
    """What is left of modes after a step of 1 s: the polynomial p at z."""
    reach = float(reach_for(rate, 1.0))
    coef = coefficients(reach, stages_for(rate, 1.0)).astype(float)
    return 1.0 - z * chebval(1.0 - 2.0 * z / reach, coef)


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
@pytest.mark.parametrize("z", [0.01, 0.4, 2.0, 4.0, 30.0, 200.0])
def test_a_mode_decays_like_the_exponential(material, z, body, rng, build_model, dense):
    x = deformed(body[0], rng).astype(np.float32)
    model = build_model((*body, material))
    rate, mode = fastest(dense, model, x)
    new = damp(model, x, mode, z / rate, rate)
    factor = np.exp(-z)
    # 5 %, or what is less than 1 % of it; every stage rounds velocities of h lambda v a few times.
    atol = max(0.05 * factor, 0.011 if factor < 0.01 else 0.0) * np.abs(mode)
    rounding = 100.0 * EPS * (1.0 + z) * np.abs(mode).max()
    assert (np.abs(new - factor * mode) <= atol + rounding).all()


def test_every_mode_decays_like_the_exponential_and_none_grows():
    for rate in np.geomspace(1e-3, 1e4, 200):
        z = np.linspace(0.0, reach_for(rate, 1.0), 4001)[1:]
        p, exact = left(z, rate), np.exp(-z)
        seen = exact >= 0.01
        assert (np.abs(p - exact)[seen] <= 0.05 * exact[seen]).all(), rate
        assert np.abs(p[~seen]).max(initial=0.0) < 0.012  # 1 %, and the fit
        slow = z < 0.5
        assert (np.abs(p - exact)[slow] <= 0.5 * z[slow] ** 2).all(), rate
        # Euler is stable for (h w)^2 < 2 (1 + p) / phi: no less than without damping, but for 5 %.
        assert (2.0 * (1.0 + p) * z / (1.0 - p)).min() > 4.0 * 0.95


def test_as_many_stages_as_the_square_root_of_the_rate():
    assert stages_for(0.0, 1.0) == stages_for(0.03, 1.0) == 1
    assert stages_for(0.6, 1.0) == 2
    assert stages_for(100.0, 1.0) == pytest.approx(2.3 * (RATE_MARGIN * 100.0) ** 0.5, abs=1.5)


@materials
def test_damp_keeps_momentum_and_never_adds_energy(material, body, rng, build_model, dense):
    x = deformed(body[0], rng)
    model = build_model((*body, material))
    rate, _ = fastest(dense, model, x)
    mass = model.mass.numpy()[:, None].astype(float)
    v = rng.standard_normal(x.shape)
    for z in (0.01, 0.5, 3.0, 50.0):
        new = damp(model, x, v, z / rate, rate)
        scale = np.abs(mass * v).sum()
        # Opposite impulses up to h lambda v, each rounded.
        tolerance = 20.0 * EPS * (1.0 + z)
        assert np.abs((mass * (new - v)).sum(axis=0)).max() < tolerance * scale
        spin = np.cross(x, mass * (new - v)).sum(axis=0)
        assert np.abs(spin).max() < 10.0 * tolerance * scale
        assert (mass * new**2).sum() <= (mass * v**2).sum() * (1.0 + tolerance)


def test_fixed_vertices_keep_their_velocity(body, rng, build_model):
    fixed = [0, 3, 5]
    model = build_model((*body, MATERIALS[0]), fixed=fixed)
    v = rng.standard_normal(body[0].shape).astype(np.float32)
    for rate in (10.0, 1e3, 1e5):
        new = damp(model, body[0], v, 1e-4, rate)
        np.testing.assert_array_equal(new[fixed], v[fixed])
        assert (new[1] != v[1]).any()


def test_undamped_bodies_are_left_alone(body, rng, build_model):
    free = NeoHookean(1e5, 0.3, 1000.0)
    x = np.concatenate([body[0], body[0]])
    v = rng.standard_normal(x.shape).astype(np.float32)
    n = len(body[0])
    mixed = build_model((*body, free), (*body, MATERIALS[2]))
    new = damp(mixed, x, v, 1e-4, 1e4)
    np.testing.assert_array_equal(new[:n], v[:n])
    assert (new[n:] != v[n:]).any()


def test_without_damping_nothing_is_allocated_or_taken(body, build_model):
    model = build_model((*body, NeoHookean(1e5, 0.3, 1000.0)))
    _, work, stages = ready(model, body[0], body[0], 1e-4, 0.0)
    assert work.damping is None and stages == 0


def test_a_step_replays_from_a_graph(body, rng, build_model):
    model = build_model((*body, MATERIALS[0]))
    start = rng.standard_normal(body[0].shape).astype(np.float32)
    once, work, stages = ready(model, body[0], start, 1e-4, 3e4)
    predict(model, once, work, stages)
    again, work, stages = ready(model, body[0], start, 1e-4, 3e4)
    with wp.ScopedCapture() as capture:
        predict(model, again, work, stages)
    wp.capture_launch(capture.graph)
    np.testing.assert_array_equal(again.v.numpy(), once.v.numpy())


def test_the_load_of_a_contact_at_rest_is_not_passed_on_to_its_neighbours(body, rng, build_model):
    model = build_model((*body, MATERIALS[0]))
    free = build_model((*body, NeoHookean(1e5, 0.3, 1000.0)))
    x, still = deformed(body[0], rng), np.zeros_like(body[0])
    loaded, work, _ = ready(free, x, still, 1e-4, 0.0)
    predict(free, loaded, work, 0)
    damped, work, stages = ready(model, x, still, 1e-4, 3e4)
    for of in (work.damping.last, work.damping.before):
        of.assign(-loaded.v.numpy())  # contacts took all of it in the last steps
    predict(model, damped, work, stages)
    assert stages > 2 and np.abs(loaded.v.numpy()).max() > 1e-3
    # What is damped is 0, but for the rounding of the load.
    scale = np.abs(loaded.v.numpy()).max()
    np.testing.assert_allclose(damped.v.numpy(), loaded.v.numpy(), atol=50.0 * EPS * scale)


def test_contacts_that_ended_are_not_expected_to_go_on(body, rng, build_model):
    model = build_model((*body, MATERIALS[0]))
    x, still = deformed(body[0], rng), np.zeros_like(body[0])
    new = []
    for before in (still, rng.standard_normal(still.shape)):
        state, work, stages = ready(model, x, still, 1e-4, 3e4)
        work.damping.before.assign(before.astype(np.float32))
        predict(model, state, work, stages)
        new.append(state.v.numpy())
    np.testing.assert_array_equal(new[0], new[1])


def test_an_overdamped_bar_creeps_back_as_slowly_as_its_closed_form(box):
    mesh = TetMesh(*box((6, 2, 2), 0.05))
    beta = 0.2
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    held = mesh.vertices[:, 0] == 0.0
    scene.add_body(mesh, NeoHookean(1e5, 0.0, 1000.0, beta), fixed=held)
    sim = Simulation(scene)
    sim.set_positions(0, mesh.vertices * [1.01, 1.0, 1.0])
    mean = mesh.vertices[:, 0].mean()
    for _ in sim.frames(12):
        pass
    assert stages_for(sim._stepper.last.rates[1], sim._stepper.last.dt) > 8
    stretch = (sim.positions()[:, 0].mean() / mean - 1.0) / 0.01
    # x'' + beta w^2 x' + w^2 x = 0 with beta w >> 1: x = exp(-t / beta). The first mode has
    # beta w of 10, so 1 / (beta w)^2, 1 %, and as much for the amplitude.
    assert stretch == pytest.approx(np.exp(-sim.time / beta), rel=0.04)


def test_damping_too_strong_for_any_step_is_named():
    scene = Scene()
    scene.add_body(block(0.1, 2), MATERIALS[0], label="soft")
    stiff = NeoHookean(1e6, 0.3, 1000.0, 100.0)
    scene.add_body(block(0.1, 2), stiff, (1.0, 0.0, 0.0), label="thick")
    with pytest.raises(SimulationError, match=r"body 'thick' decays at up to .* check its damping"):
        Simulation(scene).step_frame()


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
    start = x + 1e-3 * mode / np.abs(mode).max()
    h = step_bounds.SAFETY * 2.0 / np.sqrt(value[-1])
    rate = 2.0 * ratio / omega * value[-1]
    assert h * rate > 4.0  # inside the forces it would have to be below 1 or so
    weight = model.mass.numpy()[:, None] * mode
    three_periods = int(3 * 2.0 * np.pi / omega / h)
    q, p = modal_motion(model, start, x, weight, h, rate, three_periods)
    envelope = np.log(np.hypot(omega * q, p + ratio * omega * q))
    decay = -np.polyfit(h * np.arange(len(q)), envelope, 1)[0]
    # The decay per radian is the logarithmic decrement over 2 pi.  Off by h omega, about 1 %,
    # from the splitting, and by the amplitude of 1e-3 m on edges of 0.05 m.
    assert decay == pytest.approx(ratio * omega, rel=0.05)


def modal_motion(model, x, rest, weight, h: float, rate: float, steps: int):
    """Amplitude and velocity of a mode over ``steps`` steps of symplectic Euler and damping."""
    state, work, stages = ready(model, x, np.zeros_like(rest), h, rate)
    with wp.ScopedCapture() as capture:
        predict(model, state, work, stages)
        wp.copy(state.x, work.x)
    q, p = np.empty(steps), np.empty(steps)
    for k in range(steps):
        q[k] = (weight * (state.x.numpy() - rest)).sum()
        p[k] = (weight * state.v.numpy()).sum()
        wp.capture_launch(capture.graph)
    return q, p
