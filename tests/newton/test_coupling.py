"""newton/coupling.py: the solver beside others in the coupled solvers of Newton."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402
from newton.solvers.experimental.coupled import SolverCoupledADMM  # noqa: E402
from newton.solvers.experimental.coupled import SolverCoupledProxy as Coupled  # noqa: E402

from warp_contact.newton import SolverContactSurface  # noqa: E402

NONE = (0.0, 0.0, 0.0)
STILL = wp.quat_identity()
DT = 1.0 / 240.0


def add_ball(builder, at, **more) -> int:
    ball = builder.add_body(xform=wp.transform(wp.vec3(*at), STILL), **more)
    builder.add_shape_sphere(ball, radius=0.05)
    return ball


class Pair:
    """A body of another solver, and the rest of a model in ours; the body is a proxy there."""

    def __init__(
        self,
        builder,
        ball,
        device,
        own=(),
        iterations=1,
        substeps=1,
        hard=newton.solvers.SolverXPBD,
        **proxy,
    ):
        self.model = builder.finalize(device=device)
        particles, entry = list(range(self.model.particle_count)), Coupled.Entry
        theirs = {"bodies": [ball], "joints": [ball]}  # the number of its free joint
        ours = {"particles": particles, "bodies": own, "joints": own, "substeps": substeps}
        proxies = [Coupled.Proxy(source="hard", destination="soft", bodies=[ball], **proxy)]
        self.solver = Coupled(
            model=self.model,
            entries=[
                entry(name="hard", solver=hard, **theirs),
                entry(name="soft", solver=SolverContactSurface, **ours),
            ],
            coupling=Coupled.Config(proxies=proxies, iterations=iterations),
        )
        self.now, self.then = self.model.state(), self.model.state()

    def step(self, n=1, dt=DT, pushed=None) -> None:
        for _ in range(n):
            self.now.clear_forces()
            if pushed is not None:
                self.now.body_f.assign(pushed)
            self.solver.step(self.now, self.then, None, None, dt)
            self.now, self.then = self.then, self.now

    def momentum(self) -> np.ndarray:
        ball = self.model.body_mass.numpy()[0] * self.now.body_qd.numpy()[0, :3]
        entry = self.solver._entries["soft"].solver.simulation
        mass = self.model.particle_mass.numpy() if entry is None else entry.model.mass.numpy()
        own = slice(0, self.model.particle_count)
        return ball + mass[own] @ self.now.particle_qd.numpy()


@pytest.mark.parametrize(
    "more", [{}, {"substeps": 2}, {"substeps": 4}, {"mode": "staggered"}, {"iterations": 2}]
)
def test_a_ball_of_another_solver_hits_a_block(device, more, add_block, run_of):
    def build():
        builder = newton.ModelBuilder(gravity=NONE)
        add_block(builder, NONE)
        ball = add_ball(builder, (0.05, 0.05, 0.155))
        builder.body_qd[ball] = (0.0, 0.0, -0.5, 0.0, 0.0, 0.0)
        return builder, ball

    pair = Pair(*build(), device, **more)
    before = pair.momentum()
    pair.step(40)
    # Both have parted, and the last force has arrived a step later: rounding of impulses.
    np.testing.assert_allclose(pair.momentum(), before, atol=1e-5 * np.abs(before).max())
    alone = run_of(build()[0], device)
    alone.step(40)
    want = alone.now.particle_qd.numpy()[:, 2].mean()
    seen = pair.now.particle_qd.numpy()[:, 2].mean()
    # Substeps are shorter ones: seen 1.4 %. With one the two are as one body.
    rel = 0.03 if "substeps" in more else 1e-3
    assert want < -0.05 and seen == pytest.approx(want, rel=rel)


def box_on_a_block(add_block):
    builder = newton.ModelBuilder()
    builder.add_ground_plane()
    add_block(builder, (0.0, 0.0, 1e-4))
    box = builder.add_body(xform=wp.transform(wp.vec3(0.05, 0.05, 0.131), STILL))
    builder.add_shape_box(box, hx=0.03, hy=0.03, hz=0.03)
    return builder, box


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"substeps": 2},
        {"substeps": 4, "mode": "staggered"},
        {"iterations": 2},
        {"substeps": 4, "hard": newton.solvers.SolverSemiImplicit},  # keeps where a step began
    ],
)
def test_a_box_of_another_solver_rests_on_a_block_as_one_of_this_does(
    device, more, add_block, run_of
):
    dt = 1.0 / 120.0  # where a force that comes late makes it tumble, with any number of substeps
    pair = Pair(*box_on_a_block(add_block), device, **more)
    alone = run_of(box_on_a_block(add_block)[0], device)
    pair.step(72, dt)
    alone.step(72, dt)
    # Where friction holds it depends on how it came there: 1e-5 m.
    np.testing.assert_allclose(pair.now.body_q.numpy(), alone.now.body_q.numpy(), atol=5e-5)
    # They still swing by 1e-5 m/s; a box that tumbles has 1e-2 m/s and 1 rad/s.
    np.testing.assert_allclose(pair.now.body_qd.numpy()[0, :3], 0.0, atol=3e-4)
    np.testing.assert_allclose(pair.now.body_qd.numpy()[0, 3:], 0.0, atol=1e-2)
    np.testing.assert_allclose(pair.now.particle_qd.numpy(), 0.0, atol=3e-4)


@pytest.mark.parametrize("more", [{}, {"substeps": 2}])
def test_what_else_pushes_a_proxy_presses_it_as_deep_as_one_of_this(
    device, more, add_block, run_of
):
    pair = Pair(*box_on_a_block(add_block), device, **more)
    alone = run_of(box_on_a_block(add_block)[0], device)
    for k in range(160):
        pushed = [[0.0, 0.0, -20.0 * min(1.0, k / 80), 0.0, 0.0, 0.0]]
        pair.step(pushed=pushed)
        alone.now.body_f.assign(pushed)
        alone.step()
    height = alone.now.body_q.numpy()[0, 2]
    # It would stay 1.6e-3 m behind, a step of 20 N; friction holds it 5e-5 m elsewhere.
    assert height < 0.128 and pair.now.body_q.numpy()[0, 2] == pytest.approx(height, abs=2e-4)


def test_a_proxy_tells_nothing_of_statics_which_its_own_solver_has(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (1.0, 0.0, 0.0))
    ball = add_ball(builder, (0.0, 0.0, 0.0499))
    at = wp.transform(wp.vec3(0.0, 0.0, -0.1), STILL)
    builder.add_shape_box(-1, xform=at, hx=0.1, hy=0.1, hz=0.1)
    pair = Pair(builder, ball, device)
    pair.step(3)
    # SolverXPBD was given no contacts: the ball falls.
    qd = pair.now.body_qd.numpy()[0]
    np.testing.assert_allclose(qd[:3], [0.0, 0.0, -9.81 * 3 * DT], atol=1e-5)
    np.testing.assert_allclose(qd[3:], 0.0, atol=0.02)  # the force acts at points of facets


def test_iterations_begin_where_the_step_did(device, add_block):
    ends = []
    for iterations in 1, 3:
        builder = newton.ModelBuilder(gravity=NONE)
        add_block(builder, NONE, fix_right=True)
        ball = add_ball(builder, (5.0, 0.0, 0.0))
        wall = add_ball(builder, (-0.06, 0.05, 0.05), is_kinematic=True)
        pair = Pair(builder, ball, device, own=[wall], iterations=iterations)
        held = np.flatnonzero(pair.model.particle_mass.numpy() == 0.0)
        for k in range(6):
            pose, v = pair.now.body_q.numpy().copy(), pair.now.particle_qd.numpy().copy()
            pose[wall, 0] = -0.06 + 0.003 * (k + 1)
            v[held, 1] = 0.1
            pair.now.body_q.assign(pose)
            pair.now.particle_qd.assign(v)
            pair.step()
        ends.append(pair.now.particle_q.numpy())
    assert (ends[0] - pair.model.particle_q.numpy())[:, 0].max() > 1e-3
    np.testing.assert_allclose(*ends, atol=1e-5)


def test_particles_of_another_solver_are_refused(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, NONE)
    add_block(builder, (1.0, 0.0, 0.0))
    ball = add_ball(builder, (5.0, 0.0, 0.0))
    builder.color()
    model = builder.finalize(device=device)
    n, entry = model.particle_count // 2, Coupled.Entry
    proxy = Coupled.Proxy(source="other", destination="soft", particles=range(n))
    ours = {"particles": range(n, 2 * n)}
    theirs = {"particles": range(n), "bodies": [ball], "joints": [0]}
    with pytest.raises(ValueError, match="cannot be proxies"):
        Coupled(
            model=model,
            entries=[
                entry(name="other", solver=newton.solvers.SolverVBD, **theirs),
                entry(name="soft", solver=SolverContactSurface, **ours),
            ],
            coupling=Coupled.Config(proxies=[proxy]),
        )


def test_a_grain_of_another_solver_hits_particles_of_a_block(device, add_block):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, NONE, particle_radius=0.02)
    own = range(builder.particle_count)
    grain = builder.add_particle((0.05, 0.05, 0.145), (0.0, 0.0, -0.5), 0.3, radius=0.02)
    model = builder.finalize(device=device)

    def strip(view):  # the forces of tets are ours
        view.tri_count = view.edge_count = view.tet_count = 0

    other = {"particles": [grain], "configure_view": strip}
    proxy = Coupled.Proxy(source="soft", destination="hard", particles=own)
    solver = Coupled(
        model=model,
        entries=[
            Coupled.Entry(name="soft", solver=SolverContactSurface, particles=own),
            Coupled.Entry(name="hard", solver=newton.solvers.SolverXPBD, **other),
        ],
        coupling=Coupled.Config(proxies=[proxy]),
    )
    now, then = model.state(), model.state()
    for _ in range(20):
        now.clear_forces()
        solver.step(now, then, None, None, DT)
        now, then = then, now
    v = now.particle_qd.numpy()[:, 2]
    mass = solver._entries["soft"].solver.simulation.model.mass.numpy()
    assert v[grain] > 0.1 and v[:grain].mean() < -0.03
    # Forces on particles are given to them as they are: rounding.
    assert mass[:grain] @ v[:grain] + 0.3 * v[grain] == pytest.approx(-0.15, rel=1e-4)


def test_another_coupling_is_refused(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, NONE)
    ball = add_ball(builder, (5.0, 0.0, 0.0))
    model = builder.finalize(device=device)
    entry = SolverCoupledADMM.Entry
    own = {"particles": range(model.particle_count)}
    with pytest.raises(NotImplementedError, match="by SolverCoupledProxy alone"):
        SolverCoupledADMM(
            model=model,
            entries=[
                entry(name="hard", solver=newton.solvers.SolverXPBD, bodies=[ball], joints=[0]),
                entry(name="soft", solver=SolverContactSurface, **own),
            ],
            coupling=SolverCoupledADMM.Config(),
        )
