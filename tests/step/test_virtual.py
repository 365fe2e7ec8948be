"""impulse/virtual.py: springs to a surface between two others, in closed form and in motion."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Penalty, Scene, Simulation, VirtualSurface, box
from warp_contact.step import other_responses

DT = 1e-3
SOFT = NeoHookean(1e5, 0.4, 1000.0, 2e-3)
ELASTIC = NeoHookean(1e5, 0.3, 1000.0)


def pushed(stages, find_contacts, records, scene: Scene, response: Penalty):
    """The contacts at the start of a scene after one push, and the model."""
    model, state, work = stages(scene, dt=DT)
    find_contacts(model, work, state.x, edges=True)
    other_responses._push(model, state, work, response)
    return records(work), model, state.x.numpy().astype(float)


def cosines(model, x, verts, n) -> float:
    """Largest cosine of n with the normal of a face that has all the vertices; at least 0."""
    tris = model.tris.numpy()
    own = tris[np.isin(tris, list({*verts})).sum(axis=1) == len({*verts})]
    a = np.cross(x[own[:, 1]] - x[own[:, 0]], x[own[:, 2]] - x[own[:, 0]])
    return max(0.0, float((a @ n / np.linalg.norm(a, axis=1)).max()))


@pytest.mark.parametrize("kind", ["corner", "edges"])
def test_the_surface_is_as_far_from_the_faces_of_both_sides(
    rng, stages, find_contacts, records, turned, kind
):
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    if kind == "corner":  # in a face
        turn = turned()
        scene.add_body(box(2.0, 2), ELASTIC, (0.0, 0.0, -1.0))
        upper = box(0.5, 1)
        place = np.array([0.3, 0.2, 0.0])
        scene.add_body(upper, ELASTIC, place, turn)
        lowest = scene.bodies[1].x[:, 2].min()
        scene.bodies[1].x[:, 2] -= lowest + rng.uniform(0.01, 0.02)
    else:  # bars that lie on an edge each
        s, c = np.sin(np.pi / 8), np.cos(np.pi / 8)
        bar = box((4.0, 0.4, 0.4), (8, 1, 1))
        half = 0.2 * np.sqrt(2.0)
        scene.add_body(bar, ELASTIC, (0.0, 0.0, 0.0), (s, 0.0, 0.0, c))
        across = np.sqrt(0.5) * np.array([s, s, c, c])
        place = 0.17, 0.0, 2.0 * half - rng.uniform(0.01, 0.02)
        scene.add_body(bar, ELASTIC, place, across)
    k = rng.uniform(1e3, 1e4)
    found, model, x = pushed(stages, find_contacts, records, scene, VirtualSurface(k))
    deep = np.flatnonzero((found.depth > 0.0) & (found.coef != 0.0).any(axis=1))
    assert len(deep) > 0
    for c in deep:
        v, n = found.vert[c], found.normal[c].astype(float)
        one = cosines(model, x, v[:2], -n)
        other = cosines(model, x, v[2:], n)
        want = DT * k * found.depth[c] * one * other / (one + other)
        # Rounding of the depth: 1e-6 of 0.01.
        assert found.normal_impulse[c] == pytest.approx(want, rel=1e-4)
        assert found.normal_impulse[c] < 0.499 * DT * k * found.depth[c]


def on_floor(mesh, response, plane: bool, depth: float = 0.0, substeps=None) -> Simulation:
    """A body by a depth in a half-space, or in the flat top of a fixed body."""
    scene = Scene(friction=0.5)
    if plane:
        scene.add_plane((0.0, 0.0, 1.0))
    else:
        scene.add_body(box((0.2, 0.2, 0.05), (4, 4, 1)), SOFT, (0.0, 0.0, -0.025), fixed=True)
    place = 0.003, 0.002, -mesh.vertices[:, 2].min() - depth
    scene.add_body(mesh, SOFT, place, label="it")
    return Simulation(scene, response, substeps=substeps)


@pytest.mark.parametrize("plane", [True, False], ids=["plane", "body"])
def test_between_flat_faces_it_is_a_penalty_of_half_the_stiffness(plane):
    x = []
    for response in (VirtualSurface(4e3, 1.0), Penalty(2e3, 1.0)):
        sim = on_floor(box(0.08, 2), response, plane, substeps=60)
        for _ in sim.frames(20):
            pass
        x.append(sim.positions("it"))
    sunk = np.abs(x[1][:, 2].min())
    # A face that turns by 1e-2 when it bends changes the cosine by 1e-4.
    np.testing.assert_allclose(x[0], x[1], atol=1e-3 * sunk)
    assert sunk > 1e-4


@pytest.mark.parametrize("stiffness", [2e3, 2e4])
def test_a_block_sinks_into_a_plane_by_its_weight_over_half_the_springs(stiffness):
    mesh = box(0.08, 2)
    weight = 9.81 * 1000.0 * mesh.volume
    wanted = 2.0 * weight / (9.0 * stiffness)  # k / 2 for each of the nine vertices of a face
    sim = on_floor(mesh, VirtualSurface(stiffness), True, wanted)
    depth, force = [], []
    for _ in sim.frames(90):
        depth.append(-np.sort(sim.positions("it")[:, 2])[:9].mean())
        force.append(sum(sim.measure().forces.values()))
    # Means over a second, as nothing damps the springs.
    assert np.mean(depth[30:]) == pytest.approx(wanted, rel=5e-3)
    assert np.mean(force[30:]) == pytest.approx(weight, rel=5e-3)


def test_equal_bodies_are_pushed_alike(rng, stages, find_contacts):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    aside = rng.uniform(0.005, 0.02, 2)
    for side in (-1.0, 1.0):
        place = side * np.array([*aside, 0.048])
        scene.add_body(box(0.1, 2), ELASTIC, place)
    model, state, work = stages(scene, dt=DT)
    find_contacts(model, work, state.x)
    other_responses._push(model, state, work, VirtualSurface(4e3))
    v = state.v.numpy()[:27], state.v.numpy()[27:]
    # A block, and its mesh, is its own image in a point. Rounding of depths of 4 mm: 1e-5 of them.
    np.testing.assert_allclose(v[0], -v[1][::-1], atol=1e-4 * np.abs(v[0]).max())
    assert (v[0][:, 2] < 0.0).any()


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_collision_keeps_the_momenta(turned, friction):
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    for side in (-1.0, 1.0):
        place, v = (side * 0.02, 0.0, side * 0.1), (0.0, 0.0, -side * 0.5)
        scene.add_body(box(0.1, 3), ELASTIC, place, turned(), v)
    sim = Simulation(scene, VirtualSurface(4e3), fps=120)
    first, touched = sim.measure(), 0
    for _ in sim.frames(24):
        m = sim.measure()
        touched = max(touched, m.n_contacts)
        # Rounding of 0.5 kg m/s of either body in some hundred steps.
        assert np.abs(m.momentum - first.momentum).max() < 5e-6
        assert np.abs(m.angular_momentum - first.angular_momentum).max() < 5e-7
    assert touched > 0


def test_a_block_that_falls_flat_keeps_its_energy_with_that_of_the_springs():
    k, scene = 4e3, Scene(friction=0.0)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(box(0.1, 2), ELASTIC, (0.0, 0.0, 0.055), velocity=(0.0, 0.0, -0.5))
    sim = Simulation(scene, VirtualSurface(k), fps=240, substeps=40)
    first, deepest = sim.measure().energy, 0.0
    for _ in sim.frames(30):
        d = np.maximum(0.0, -sim.positions()[:, 2])
        deepest = max(deepest, d.max())
        # Springs of k / 2. A force that begins within a step is off by a part of that step.
        energy = sim.measure().energy + (k / 2.0 * d * d / 2.0).sum()
        assert energy == pytest.approx(first, rel=2e-3)
    assert deepest > 1e-3 and sim.positions()[:, 2].min() > 0.0  # it is up again
