"""impulse.py: momentum, energy and Coulomb's cone of many contacts at once."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, box
from warp_contact.step import impulse, sweeps

DT = 1e-3
RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def meeting(
    rng, jittered, friction: float, fixed=False, part=0.1, spacing=0.97, speed=2.0
) -> Scene:
    """Three spinning blocks in a heap, the upper ones on their way down."""
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    for k in range(3):
        mesh = jittered(1.0, 3, part)
        spin = np.cross(rng.normal(size=3), mesh.vertices)
        v = spin + rng.normal(size=(len(mesh.vertices), 3))
        v[:, 2] -= speed * k
        held = rng.random(len(mesh.vertices)) < 0.2 if fixed else None
        place = (*rng.uniform(-0.3, 0.3, 2), spacing * k)
        scene.add_body(mesh, NeoHookean(1e5, 0.3, 10.0**k), place, velocity=v, fixed=held)
    return scene


def exchanged(scene: Scene, stages, find_contacts, records, edges: bool = True) -> tuple:
    """Impulses of a step from the initial state: model, x0, v before and after, records."""
    model, state, work = stages(scene, dt=DT)
    x0, v0 = state.x.numpy().astype(float), state.v.numpy().astype(float)
    ahead = wp.array(x0 + DT * v0, dtype=wp.vec3)
    find_contacts(model, work, state.x, ahead, edges=edges)
    impulse.exchange(model, state.v, work)
    return model, x0, v0, state.v.numpy().astype(float), records(work)


def momentum_changes(model, x0, v0, v1) -> tuple[float, float]:
    """Of the linear momentum and, about x0, the angular one, over the momentum passed."""
    p = model.mass.numpy().astype(float)[:, None] * (v1 - v0)
    angular = np.cross(x0, p).sum(axis=0)
    linear, angular = (np.abs(q).max() / np.abs(p).sum() for q in (p.sum(axis=0), angular))
    print(f"linear {linear:.1e}, angular {angular:.1e} m")
    return linear, angular


def untaken(model, x0, c) -> float:
    """Most angular momentum that friction adds where a triangle is too thin to take its torque."""
    gap = np.einsum("ck,cki,ci->c", c.coef, x0[c.vert], c.normal) - c.offset
    thin = (c.turn == 0.0).all(axis=(1, 2))
    return float((thin * np.abs(gap) * np.linalg.norm(c.friction_impulse, axis=1)).sum())


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_impulses_keep_the_momentum(rng, stages, find_contacts, records, jittered, friction):
    scene = meeting(rng, jittered, friction)
    model, x0, v0, v1, c = exchanged(scene, stages, find_contacts, records)
    linear, angular = momentum_changes(model, x0, v0, v1)
    passed = np.abs(model.mass.numpy()[:, None] * (v1 - v0)).sum()
    assert (c.normal_impulse > 0.0).any()
    # Each of up to 48 sweeps rounds every velocity of up to 5 m/s; heavy ones hardly change. The
    # worst of 1500 draws is 4e-6.
    assert linear < 1e-5 and angular < 1e-5 + untaken(model, x0, c) / passed


def test_friction_across_a_gap_keeps_the_angular_momentum(
    rng, stages, find_contacts, records, jittered
):
    # Gaps of 5 to 19 mm between cells of 1/3 m that close within the step.
    scene = meeting(rng, jittered, 0.5, part=0.01, spacing=1.012, speed=25.0)
    model, x0, v0, v1, c = exchanged(scene, stages, find_contacts, records)
    used = c.normal_impulse > 0.0
    assert used.sum() > 10 and (c.gap[used] > 1e-3).mean() > 0.5
    torques = (c.gap * np.linalg.norm(c.friction_impulse, axis=1)).sum()
    linear, angular = momentum_changes(model, x0, v0, v1)
    passed = np.abs(model.mass.numpy()[:, None] * (v1 - v0)).sum()
    print(f"torques of the friction {torques / passed:.1e} m")
    assert torques > 1e-4 * passed
    # As above, of velocities of 50 m/s that change by a part; weights on cells of 1/3 m round.
    assert linear < 1e-5 and angular < 1e-5 + untaken(model, x0, c) / passed


@pytest.mark.parametrize("friction", [0.0, 0.5, 5.0])
@pytest.mark.parametrize("fixed", [False, True])
def test_impulses_never_add_kinetic_energy(
    rng, stages, find_contacts, records, jittered, friction, fixed
):
    scene = meeting(rng, jittered, friction, fixed)
    for body in scene.bodies:
        body.v[body.fixed] = 0.0
    model, _, v0, v1, c = exchanged(scene, stages, find_contacts, records)
    mass = model.mass.numpy().astype(float)[:, None]
    assert (c.normal_impulse > 0.0).any()
    before, after = ((mass * v * v).sum() for v in (v0, v1))
    # Rounding of up to 48 sweeps.
    assert after <= (1.0 + 1e-5) * before


def test_the_torque_of_friction_adds_no_energy_to_a_light_corner(stages, find_contacts, records):
    # Heavy corners above fixed ones of a light face: its free corner takes little but the torque.
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=5.0)
    scene.add_body(box(1.0, 1), NeoHookean(1e5, 0.3, 1.0), fixed=np.arange(8) != 5)
    place, v = (-0.34, -0.34, 0.69), (5.0, 5.0, -60.0)
    scene.add_body(box(0.3, 1), NeoHookean(1e5, 0.3, 1e6), place, velocity=v)
    model, _, v0, v1, c = exchanged(scene, stages, find_contacts, records, edges=False)
    taken = np.linalg.norm(c.friction_impulse, axis=1) * c.gap
    assert (taken > 0.0).any()
    mass = model.mass.numpy().astype(float)[:, None]
    before, after = ((mass * v * v).sum() for v in (v0, v1))
    assert after <= (1.0 + 1e-5) * before  # rounding; with W alone it is 1e25 times


def rubbed(c) -> tuple[np.ndarray, np.ndarray]:
    """Tangential impulses: their parts along the ramps, in these, and what is left: friction."""
    steep = np.einsum("ci,ci->c", c.ramp, c.ramp)
    along = np.einsum("ci,ci->c", c.friction_impulse, c.ramp) / np.where(steep > 0.0, steep, 1.0)
    s = np.clip(along, 0.0, c.normal_impulse)
    return s, c.friction_impulse - s[:, None] * c.ramp


def test_friction_stays_in_the_cone_and_normal_impulses_push(
    rng, stages, find_contacts, records, jittered
):
    _, _, _, _, c = exchanged(meeting(rng, jittered, 0.4), stages, find_contacts, records)
    size = np.linalg.norm(c.friction_impulse, axis=1)
    assert (c.normal_impulse >= 0.0).all() and (size > 0.0).any()
    # Rounding of the terms of the differences.
    room = 0.4 * c.normal_impulse + 1e-6 * (c.normal_impulse + size)
    assert (np.linalg.norm(rubbed(c)[1], axis=1) <= room).all()
    out_of_plane = np.einsum("ci,ci->c", c.friction_impulse, c.normal)
    np.testing.assert_allclose(out_of_plane, 0.0, atol=1e-5 * np.abs(c.friction_impulse).max())


def test_without_friction_impulses_are_between_the_normals_and_those_of_the_facets(
    rng, stages, find_contacts, records, jittered
):
    climbs = 0
    for _ in range(6):  # in 3 draws of 40 nothing climbs
        scene = meeting(rng, jittered, 0.0)
        _, x0, _, _, c = exchanged(scene, stages, find_contacts, records, edges=False)
        s, left = rubbed(c)
        climbs += (s > 0.0).sum()
        np.testing.assert_allclose(left, 0.0, atol=1e-6 * c.normal_impulse.max())  # rounding
        used = np.linalg.norm(c.ramp, axis=1) > 0.0
        a, b, d = np.moveaxis(x0[c.vert[used, 2:]], 1, 0)
        facet = np.cross(b - a, d - a)
        facet /= np.linalg.norm(facet, axis=1)[:, None]
        whole = c.normal[used] + c.ramp[used]
        whole /= np.linalg.norm(whole, axis=1)[:, None]
        np.testing.assert_allclose(whole, facet, atol=1e-5)  # float32
    assert climbs > 0


# Blocks that overlap from the start, and blocks with gaps that close within the step.
@pytest.mark.parametrize("apart", [{}, {"part": 0.01, "spacing": 1.012, "speed": 25.0}])
def test_contacts_approach_by_their_gap_and_no_further(
    rng, stages, find_contacts, records, jittered, apart
):
    scene = meeting(rng, jittered, 0.3, **apart)
    model, x0, _, v1, c = exchanged(scene, stages, find_contacts, records, edges=False)
    edge = model.body_edge.numpy()
    coef, normal = c.coef.astype(float), c.normal.astype(float)
    u = np.einsum("ck,cki,ci->c", coef, v1[c.vert], normal)
    gap = np.einsum("ck,cki,ci->c", coef, x0[c.vert], normal) - c.offset
    room = np.maximum(gap - 2e-4 * edge[c.pair[:, 0]], 0.0)  # down to the resting gap
    too_far = (-DT * u - room)[c.inv_mass > 0.0] / edge[0]
    pushed = c.normal_impulse > 0.0
    off = np.abs(-DT * u - room)[pushed] / edge[0]  # what pushes is at its limit
    print(f"worst {too_far.max():.1e} of an edge, off {np.median(off):.1e}")
    assert (room[pushed] > 0.0).any() if apart else pushed.any()
    # The sweeps end at a tolerance of 1e-5, or after 48 with some clusters of contacts to go:
    # 1.9e-4 at worst in 60 draws at 50 m/s.
    assert np.median(too_far) < 1e-5 and too_far.max() < 6e-4 and np.median(off) < 3e-5


def test_fixed_vertices_keep_their_velocity(rng, stages, find_contacts, records, jittered):
    scene = meeting(rng, jittered, 0.5, fixed=True)
    model, _, v0, v1, _ = exchanged(scene, stages, find_contacts, records)
    held = model.inv_mass.numpy() == 0.0
    assert held.any()
    np.testing.assert_array_equal(v1[held], v0[held])
    assert not np.array_equal(v1[~held], v0[~held])


@pytest.mark.parametrize("most", [3, 48])
def test_recorded_impulses_are_those_that_the_velocities_got(
    rng, stages, find_contacts, jittered, monkeypatch, most
):
    """Also where the sweeps end before their time, with impulses extrapolated."""
    monkeypatch.setattr(impulse, "SWEEPS", most)
    scene = meeting(rng, jittered, 0.5)
    unit = 1e-9
    model, state, work = stages(scene, dt=DT, unit=unit)
    v0 = state.v.numpy().astype(float)
    ahead = wp.array(state.x.numpy() + DT * v0, dtype=wp.vec3)
    find_contacts(model, work, state.x, ahead)
    impulse.exchange(model, state.v, work)
    impulse.add_forces(state.x, work)
    mass = model.mass.numpy().astype(float)[:, None]
    change = mass * (state.v.numpy() - v0)
    # The velocities round, the impulses do not: heavy vertices by more than light ones.
    rounding = 2e-6 * mass * np.abs(v0).max()
    assert (np.abs(work.forces.received.numpy() - change) <= rounding + 1e-5 * np.abs(change)).all()
    first = model.vert_body.numpy() == 0
    got = np.zeros(3)
    forces = work.forces
    for key, total in zip(forces.pair_key.numpy(), forces.pair_total.numpy(), strict=True):
        if key >= 0 and key >> 32 == 0:
            got += unit * total[:3]
    of_first = change[first].sum(axis=0)
    np.testing.assert_allclose(got, of_first, rtol=1e-4, atol=1e-4 * np.abs(of_first).max())
    assert np.abs(got).max() > 0.0


def test_no_sliding_is_answered_more_strongly_than_the_mass_says(
    rng, stages, find_contacts, records, jittered
):
    """W_t bounds the eigenvalues of u(p), with the shares of the masses, the torque included."""
    scene = meeting(rng, jittered, 0.5, part=0.1, spacing=1.012, speed=25.0)
    model, _, _, _, c = exchanged(scene, stages, find_contacts, records)
    inv_mass = model.inv_mass.numpy().astype(float)
    real = np.abs(c.coef).sum(axis=1) > 0.0
    used = [np.unique(vert) for vert in c.vert[real]]
    sharing = np.bincount(np.concatenate(used), minlength=model.n_vert)
    turning = 0
    for k in np.flatnonzero(real & (c.gap != 0.0)):
        n, a, vert = c.normal[k].astype(float), c.coef[k].astype(float), c.vert[k]
        parts = a[:, None, None] * np.eye(3) + c.gap[k] * np.einsum("i,kj->kij", n, c.turn[k])
        share = inv_mass[vert] * sharing[vert]
        strongest = np.linalg.eigvalsh(np.einsum("k,kij,kil->jl", share, parts, parts))[-1]
        assert strongest <= c.inv_mass_turning[k] * (1.0 + 1e-5)  # rounding
        turning += strongest > 1.01 * c.inv_mass[k]
    assert turning > 0


def test_blocks_of_one_tet_fall_flat_on_a_plane(stages, find_contacts, records):
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=10.0)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(1.0, 1), RUBBER, (0.0, 0.0, 0.5), velocity=(1.0, 2.0, -3.0))
    _, _, _, v1, c = exchanged(scene, stages, find_contacts, records)
    assert c.n == 4
    np.testing.assert_allclose(v1[c.vert[:, 0]], 0.0, atol=1e-6)  # rounding
    above = np.setdiff1d(np.arange(8), c.vert[:, 0])
    np.testing.assert_array_equal(v1[above], [[1.0, 2.0, -3.0]] * 4)


def test_contacts_are_left_alone_only_when_they_are_done(
    rng, stages, find_contacts, records, monkeypatch
):
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    for k, speed in enumerate((0.1, 2.0)):  # blocks that come down on others, faster and slower
        aside = rng.uniform(-0.02, 0.02, 2)
        scene.add_body(box(0.1, 3), RUBBER, (0.3 * k, 0.0, 0.0))
        v, place = (0.0, 0.0, -speed), (0.3 * k + aside[0], aside[1], 0.1 + 1e-5)
        scene.add_body(box(0.1, 4), NeoHookean(1e5, 0.3, 1e4), place, velocity=v)
    model, state, work = stages(scene, dt=DT)
    ahead = wp.array(state.x.numpy() + DT * state.v.numpy(), dtype=wp.vec3)
    find_contacts(model, work, state.x, ahead, edges=True)
    n, alone = int(work.contacts.n.numpy()[0]), []

    def watched(work, one_more, count=sweeps.count):
        alone.append(int((work.sweeps.busy.numpy()[:n] == 0).sum()))
        count(work, one_more)

    monkeypatch.setattr(sweeps, "count", watched)
    monkeypatch.setattr(impulse, "SWEEPS", 1000)  # to the end
    impulse.exchange(model, state.v, work)
    c = records(work)
    coef, normal = c.coef.astype(float), c.normal.astype(float)
    v = state.v.numpy().astype(float)[c.vert]
    u = ((coef[:, :, None] * v).sum(axis=1) * normal).sum(axis=1)
    approach = DT * (-u - np.maximum(c.gap_bound, 0.0)).max()
    edge = float(model.body_edge.numpy().min())
    print(f"{n} contacts, alone {alone}, approach {approach / edge:.1e}")
    assert len(alone) <= impulse.SWEEPS and max(alone[1:-1]) > n // 8
    # The last sweep, of all contacts at once, moves the vertices that they share once more.
    assert approach < 5.0 * impulse.IMPULSE_TOLERANCE * edge
