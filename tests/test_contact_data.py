"""contact_data.py: contacts, forces of pairs and of bodies, against momenta and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

import warp_contact as wc

EDGE = 0.1  # of a block [m]
DENSITY = 1000.0
RUBBER = wc.NeoHookean(2e5, 0.3, DENSITY, 4e-3)
WEIGHT = DENSITY * EDGE**3 * 9.81
KINDS = "explicit", "implicit"


def momentum(sim: wc.Simulation, body: str) -> np.ndarray:
    own = sim._bodies.range(body)
    return sim.model.mass.numpy()[own].astype(float) @ sim.velocities(body).astype(float)


def slope(angle: float, device, kind: str, friction=0.6) -> wc.Simulation:
    """A block at rest on the floor, with gravity turned about the y axis; half a second."""
    g = 9.81 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    scene = wc.Scene(gravity=g, friction=friction)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.box(EDGE, 3), RUBBER, (0.3, -0.2, 0.5 * EDGE), label="block")
    sim = wc.Simulation(scene, device=str(device), integrator=kind)
    for _ in sim.frames(60):
        pass
    return sim


@pytest.mark.parametrize("kind", KINDS)
def test_the_force_on_a_body_is_its_change_of_momentum(device, rng, kind):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.4)
    scene.add_body(wc.box(EDGE, 3), RUBBER, velocity=rng.uniform(-0.1, 0.1, 3), label="a")
    v = (*rng.uniform(-0.3, 0.3, 2), -1.0)
    scene.add_body(wc.box(EDGE, 2), RUBBER, (0.02, 0.03, 0.105), velocity=v, label="b")
    sim = wc.Simulation(scene, fps=240, device=str(device), integrator=kind)
    before = {body: momentum(sim, body) for body in "ab"}
    got, both = {body: np.zeros(3) for body in "ab"}, []
    for _ in sim.frames(40):
        for body, sign in ("a", 1.0), ("b", -1.0):
            force = sim.force_on(body)
            got[body] += force / sim.fps
            if pair := sim.forces().get(("a", "b")):
                both.append((sign * pair.total, force))
    of_pair, of_body = np.array(both).swapaxes(0, 1)
    # Each is summed in float32, over impulses as large as those of the strongest frame.
    np.testing.assert_allclose(of_pair, of_body, atol=1e-5 * np.abs(of_body).max())
    scale = np.abs(before["b"]).max()
    for body in "ab":
        change = momentum(sim, body) - before[body]
        assert np.abs(change).max() > 0.1 * scale  # they have met
        np.testing.assert_allclose(got[body], change, atol=1e-5 * scale)  # rounding of velocities


@pytest.mark.parametrize("kind", KINDS)
def test_on_a_slope_the_force_acts_below_the_centre_of_mass(device, kind):
    angle = 0.3
    sim = slope(angle, device, kind)
    force = sim.forces()["block", "plane0"]
    # At rest to 1e-3: what is left of the vibrations.
    np.testing.assert_allclose(force.normal, [0.0, 0.0, WEIGHT * np.cos(angle)], atol=2e-3 * WEIGHT)
    along = [-WEIGHT * np.sin(angle), 0.0, 0.0]
    np.testing.assert_allclose(force.friction, along, atol=2e-3 * WEIGHT)
    x = sim.positions("block").astype(float)
    centre = np.average(x, axis=0, weights=sim.model.mass.numpy())
    foot = centre[:2] + [centre[2] * np.tan(angle), 0.0]
    np.testing.assert_allclose(force.point, [*foot, 0.0], atol=5e-3 * EDGE)


@pytest.mark.parametrize("kind", KINDS)
def test_contacts_add_up_to_the_force_of_their_pair(device, kind):
    sim = slope(0.2, device, kind)
    c, force = sim.contacts(), sim.forces()["block", "plane0"]
    assert len(c) > 0 and (c.bodies == [0, 1]).all()
    # One step of a frame at rest is like the others.
    each = c.normal_force[:, None] * c.normal + c.friction_force
    np.testing.assert_allclose(each.sum(axis=0), force.total, atol=2e-3 * WEIGHT)
    point = np.average(c.point, axis=0, weights=c.normal_force)
    np.testing.assert_allclose(point, force.point, atol=2e-3 * EDGE)
    np.testing.assert_array_equal(c.normal, np.tile([0.0, 0.0, 1.0], (len(c), 1)))
    np.testing.assert_allclose(c.gap, c.point[:, 2], atol=1e-7)  # rounding
    assert np.abs(c.slip).max() < 1e-3  # [m/s] it rests
    assert (np.linalg.norm(c.friction_force, axis=1) <= 0.6 * c.normal_force * (1.0 + 1e-5)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_contacts_add_up_also_where_the_closure_looked_for_others(device, kind):
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0))
    soft = wc.NeoHookean(1e5, 0.3, DENSITY, 2e-3)
    for k, (x, y) in enumerate([(0.0, 0.0), (0.01, 0.013)]):
        scene.add_body(wc.box(EDGE, 2), soft, (x, y, (k + 0.5) * EDGE + 1e-4 * k), label=f"b{k}")
    fps = 240 if kind == "implicit" else 3000
    sim = wc.Simulation(scene, fps=fps, substeps=1, integrator=kind, device=str(device))
    looks = 0
    for _ in sim.frames(80):
        looks += int(sim._stepper.work.contacts.kept.n.numpy()[0] >= 0)
        each, arrays = sim.contacts(), sim.contact_arrays()
        n = int(arrays.n.numpy()[0])
        total = each.normal_force[:, None] * each.normal + each.friction_force
        same = arrays.normal_force.numpy()[:n, None] * arrays.normal.numpy()[:n]
        same += arrays.friction_force.numpy()[:n]
        want = sim.forces()
        for pair, of in (("b0", "plane0"), (0, 2)), (("b0", "b1"), (0, 1)):
            sign = np.where((each.bodies == of).all(axis=1), 1.0, 0.0)
            sign -= (each.bodies == of[::-1]).all(axis=1)
            force = want[pair].total if pair in want else np.zeros(3)
            for got in (total, same):  # a frame is a step; sums in float32 of some weights
                np.testing.assert_allclose(sign @ got, force, atol=1e-4 * WEIGHT)
    assert looks > 0


@pytest.mark.parametrize("grows", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_contacts_stay_as_they_are_whatever_else_is_read(device, kind, grows, monkeypatch):
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0))
    soft = wc.NeoHookean(1e5, 0.3, DENSITY, 2e-3)
    for k in range(2):
        at = 0.01 * k, 0.013 * k, (k + 0.52) * EDGE
        scene.add_body(wc.box(EDGE, 2), soft, at, velocity=(0.3, 0.0, -1.0))
    sim = wc.Simulation(scene, integrator=kind, device=str(device))
    kept, stepper = set(), sim._stepper
    find = stepper._velocities

    def outgrown():  # buffers are replaced, as where they are too small
        room = stepper.work.capacity
        stepper.buffers.replace(replace(room, contacts=room.contacts + 64))
        stepper._start.go_back(stepper._state, stepper.work)
        return find()

    if grows:
        monkeypatch.setattr(stepper, "_velocities", outgrown)
    for _ in sim.frames(15):
        kept.add(int(stepper.work.contacts.kept.n.numpy()[0]) >= 0)
        before = sim.contacts()
        sim.measure()
        after = sim.contacts()
        for name, values in vars(before).items():
            np.testing.assert_array_equal(getattr(after, name), values, err_msg=name)
    assert kept == {True, False}


def test_contacts_of_two_bodies_have_two_sides(device):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(EDGE, 2), RUBBER)
    v = (0.2, 0.0, -1.0)
    scene.add_body(wc.box(EDGE, 3), RUBBER, (0.01, 0.02, 1.005 * EDGE), velocity=v)
    sim = wc.Simulation(scene, fps=240, device=str(device))
    for _ in sim.frames(3):
        pass
    c, x = sim.contacts(), sim.positions().astype(float)
    assert len(c) > 0
    of = sim.model.vert_body.numpy()[c.vertices]
    np.testing.assert_array_equal(of[:, [0, 1]], np.repeat(c.bodies[:, :1], 2, axis=1))
    np.testing.assert_array_equal(of[:, [2, 3, 4]], np.repeat(c.bodies[:, 1:], 3, axis=1))
    np.testing.assert_allclose(c.weights[:, :2].sum(axis=1), 1.0, atol=1e-6)  # rounding
    np.testing.assert_allclose(c.weights[:, 2:].sum(axis=1), -1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(c.normal, axis=1), 1.0, atol=1e-6)
    other = -np.einsum("ck,cki->ci", c.weights[:, 2:], x[c.vertices[:, 2:]])
    gap = np.einsum("ci,ci->c", c.point - other, c.normal)
    np.testing.assert_allclose(c.gap, gap, atol=1e-9)
    up = np.where(c.bodies[:, :1] == 1, c.normal, -c.normal)
    assert (up[:, 2] > 0.9).all()  # the upper body is pushed upwards


def test_chosen_vertices_have_their_share(device):
    sim = slope(0.1, device, "explicit")
    low = sim.positions("block")[:, 2] < 0.1 * EDGE
    whole = sim.force_on("block")
    np.testing.assert_allclose(sim.force_on("block", low), whole, rtol=1e-12)
    np.testing.assert_array_equal(sim.force_on("block", ~low), 0.0)
    pressure, z = sim.contact_fields()["pressure"][low], sim.positions("block")[low]
    assert np.isfinite(z).all() and (pressure > 0.0).any()
    with pytest.raises(ValueError, match="block"):
        sim.force_on("block", [10_000])


def test_pressure_over_the_area_is_the_force(device):
    sim = slope(0.0, device, "explicit", friction=0.0)
    tris, x = sim.model.tris.numpy(), sim.positions().astype(float)
    a, b, c = x[tris].transpose(1, 0, 2)
    size = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    area = np.bincount(tris.ravel(), np.repeat(size / 3.0, 3), minlength=len(x))
    total = float(area @ sim.contact_fields()["pressure"])
    # Rounding to float32 in each of them.
    assert total == pytest.approx(sim.forces()["block", "plane0"].normal[2], rel=1e-5)


def test_before_a_frame_and_after_a_reset_there_is_nothing(device):
    sim = slope(0.0, device, "explicit")
    sim.reset()
    assert not sim.forces() and len(sim.contacts()) == 0
    np.testing.assert_array_equal(sim.force_on(0), 0.0)


def test_slip_is_the_motion_along_the_surface(device):
    scene = wc.Scene(friction=0.0)
    scene.add_plane((0.0, 0.0, 1.0))
    v = (0.3, -0.2, 0.0)
    scene.add_body(wc.box(EDGE, 2), RUBBER, (0.0, 0.0, 0.4998 * EDGE), velocity=v)
    sim = wc.Simulation(scene, fps=240, device=str(device))
    c = next(sim.contacts() for _ in sim.frames(1))
    assert len(c) > 0
    # The base widens a little as the block sinks into its weight.
    np.testing.assert_allclose(c.slip, np.tile(v, (len(c), 1)), atol=0.02)
    np.testing.assert_allclose(np.einsum("ci,ci->c", c.slip, c.normal), 0.0, atol=1e-6)


FIELDS = "bodies", "vertices", "weights", "point", "normal", "gap", "slip"
FIELDS += "normal_impulse", "friction_impulse", "normal_force", "friction_force"


@pytest.mark.parametrize("kind", KINDS)
def test_contact_arrays_hold_the_contacts_and_copy_nothing_to_the_host(device, monkeypatch, kind):
    scene = wc.Scene(friction=0.4)
    scene.add_plane((0.0, 0.0, 1.0))
    for k, world in enumerate((0, 0, 3)):  # the lone one takes other steps
        height = 0.4999 * EDGE + 0.999 * k * EDGE * (world == 0)
        stiff = wc.NeoHookean(2e5 * (1 + 3 * world), 0.3, DENSITY, 4e-3)
        at = (0.02 * k, 0.01 * k, height)
        scene.add_body(wc.box(EDGE, 2 + k % 2), stiff, at, velocity=(0.1, 0.2, 0.0), world=world)
    sim = wc.Simulation(scene, device=str(device), integrator=kind)
    before = sim.contact_arrays()
    assert not before.n.numpy()[0]
    for _ in sim.frames(4):
        pass
    sim.velocities()  # takes steps of its own
    record = sim._stepper.work.contacts.record
    without = record.numpy().copy()
    without["coef"][2] = 0.0  # a vertex inside that makes no contact
    record.assign(without)
    with monkeypatch.context() as m:
        m.setattr(wp.array, "numpy", lambda *_: pytest.fail("copied to the host"))
        got = sim.contact_arrays()
    want = sim.contacts()
    n = int(got.n.numpy()[0])
    assert n == len(want) and {0, 1, 2, 3} <= {*want.bodies.ravel()}
    # The host sums in float64: float32 rounds by 6e-8 of what is summed.
    scale = {"gap": 0.1, "point": 0.2, "slip": 0.3}
    for name in FIELDS:
        each, array = getattr(want, name), getattr(got, name).numpy()[:n]
        worst = 3e-7 * max(np.abs(each).max(), scale.get(name, 0.0))
        np.testing.assert_allclose(array, each, rtol=0.0, atol=worst, err_msg=name)


@wp.kernel
def add_up(contacts: wc.ContactArrays, total: wp.array[wp.vec3]):
    c = wp.tid()
    if c < contacts.n[0] and contacts.bodies[c][0] == 0:
        force = contacts.normal_force[c] * contacts.normal[c] + contacts.friction_force[c]
        wp.atomic_add(total, 0, force)


def test_a_kernel_of_a_user_reads_the_contacts(device):
    sim = slope(0.2, device, "explicit")
    arrays, total = sim.contact_arrays(), wp.zeros(1, dtype=wp.vec3)
    wp.launch(add_up, dim=len(arrays.gap), inputs=[arrays], outputs=[total])
    c = sim.contacts()
    want = (c.normal_force[:, None] * c.normal + c.friction_force).sum(axis=0)
    np.testing.assert_allclose(total.numpy()[0], want, atol=1e-5 * WEIGHT)  # sums in any order


def test_a_pair_is_found_in_either_order_and_a_wrong_label_is_no_pair_that_did_not_touch():
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    rubber = wc.NeoHookean(1e5, 0.3, 1000.0)
    for k, label in enumerate(("low", "high", "far")):
        place = (0.5 * (k == 2), 0.0, 0.0501 + 0.1002 * k)
        scene.add_body(wc.box(0.1, 1), rubber, place, label=label)
    sim = wc.Simulation(scene)
    for _ in sim.frames(12):
        pass
    forces = sim.forces()
    one, other = forces["low", "high"], forces["high", "low"]
    assert one.total[2] < 0.0
    np.testing.assert_array_equal(other.total, -one.total)
    np.testing.assert_array_equal(other.point, one.point)
    assert ("plane0", "low") in forces and ("low", "far") not in forces
    assert forces.get(("plane0", "low")).total[2] < 0.0 and forces.get(("far", "low")) is None
    with pytest.raises(KeyError, match="'far' and 'low' did not touch"):
        forces["far", "low"]
    for wrong in forces.__getitem__, forces.get:
        with pytest.raises(KeyError, match="no body or plane 'hihg': the scene has low, high"):
            wrong(("low", "hihg"))
