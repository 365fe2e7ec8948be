"""measure/skins.py and kernels/output/skin.py: surfaces that follow the tets of bodies."""

import numpy as np
import pytest

import warp_contact as wc

SOFT = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
COARSE, FINE = wc.sphere(0.1, 55), wc.sphere(0.1, 500)  # whose vertices stick out of the facets


def with_render(render: wc.Surface, material=SOFT, **given) -> wc.Simulation:
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 1), SOFT, (5.0, 0.0, 0.0))
    scene.add_body(COARSE, material, render=render, label="ball", **given)
    return wc.Simulation(scene)


def surface_of(mesh: wc.TetMesh, normals: bool = False) -> wc.Surface:
    used, tris = np.unique(mesh.surface, return_inverse=True)
    x, tris = mesh.vertices[used], tris.reshape(-1, 3)
    return wc.Surface(x, tris, normals=x[tris] + [0.0, 0.0, 0.01] if normals else None)


@pytest.mark.parametrize("normals", [False, True])
def test_a_surface_follows_any_linear_deformation_exactly(normals, rng):
    surface = surface_of(FINE, normals)
    sim = with_render(surface, position=(0.3, 0.2, 0.1), rotation=(0.2, 0.5, -0.3, 1.0))
    f, move = np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3)), rng.uniform(-0.5, 0.5, 3)
    sim.set_positions("ball", COARSE.vertices @ f.T + move)
    x, n = sim.rendered("ball")
    # Rounding of positions of 0.5 m.
    np.testing.assert_allclose(x, surface.vertices @ f.T + move, atol=3e-7)
    cof = np.linalg.det(f) * np.linalg.inv(f).T
    if normals:
        wanted = surface.normals @ cof.T
        np.testing.assert_allclose(
            n, wanted / np.linalg.norm(wanted, axis=2, keepdims=True), atol=2e-5
        )
    else:
        a, b, c = np.moveaxis((surface.vertices @ f.T)[surface.triangles], 1, 0)
        wanted = np.zeros_like(x, dtype=float)
        for k in range(3):
            np.add.at(wanted, surface.triangles[:, k], np.cross(b - a, c - a))
        np.testing.assert_allclose(
            n, wanted / np.linalg.norm(wanted, axis=1, keepdims=True), atol=2e-4
        )


def distances(p: np.ndarray, a, b, c) -> np.ndarray:
    """Of points (n, 3) from triangles [m], corners (m, 3) each, shape (n, m)."""
    n = np.cross(b - a, c - a)
    above = np.einsum("nmi,mi->nm", p[:, None] - a, n) / np.linalg.norm(n, axis=1)
    inside, least = np.ones(above.shape, dtype=bool), np.full(above.shape, np.inf)
    for q, r in (a, b), (b, c), (c, a):
        way, off = r - q, p[:, None] - q
        inside &= np.einsum("nmi,mi->nm", off, np.cross(n, way)) >= 0.0
        s = np.einsum("nmi,mi->nm", off, way) / (way * way).sum(axis=1)
        off = off - np.clip(s, 0.0, 1.0)[..., None] * way
        least = np.minimum(least, np.linalg.norm(off, axis=2))
    return np.where(inside, np.abs(above), least)


def test_a_point_outside_belongs_to_the_nearest_tet(rng):
    points = rng.uniform(-0.13, 0.13, (300, 3))
    sim = with_render(wc.Surface(points, np.arange(300).reshape(-1, 3)))
    skin, corner = sim._skins._of[1], COARSE.vertices[COARSE.tets]
    tet, weight = skin.tet.numpy(), skin.weight.numpy()
    np.testing.assert_allclose(np.einsum("pk,pki->pi", weight, corner[tet]), points, atol=1e-6)
    within = weight.min(axis=1) >= -1e-5
    assert 20 < within.sum() < 250  # a ball of 0.1 m in a cube of 0.26 m: 65, and 7 more or less
    out, own = points[~within], tet[~within]
    faces = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]
    found = np.min([distances(out, *np.moveaxis(corner[:, f], 1, 0)) for f in faces], axis=0)
    np.testing.assert_allclose(found[np.arange(len(out)), own], found.min(axis=1), atol=1e-7)
    # Those that are outside are outside all of them.
    full = np.linalg.inv(np.swapaxes(corner[:, 1:] - corner[:, :1], 1, 2))
    w = np.einsum("mij,nmj->nmi", full, out[:, None] - corner[:, 0])
    assert np.minimum(w.min(axis=2), 1.0 - w.sum(axis=2)).max() < 1e-5


def test_the_surface_of_a_rigid_body_turns_with_it():
    surface = surface_of(FINE)
    sim = with_render(surface, wc.Rigid(1000.0), angular_velocity=(3.0, 0.0, 1.0))
    for _ in sim.frames(10):
        pass
    place, (i, j, k, w) = sim.pose("ball")
    spin = 2.0 * w * np.cross([i, j, k], surface.vertices)
    twice = 2.0 * np.cross([i, j, k], np.cross([i, j, k], surface.vertices))
    np.testing.assert_allclose(
        sim.rendered("ball")[0], surface.vertices + spin + twice + place, atol=1e-6
    )


def test_bodies_of_one_mesh_and_surface_share_what_is_found():
    scene, surface = wc.Scene(), surface_of(FINE)
    for k in range(3):
        scene.add_body(COARSE, SOFT, (0.3 * k, 0.0, 0.0), render=surface)
    sim = wc.Simulation(scene)
    assert len({id(skin) for skin in sim._skins._of.values()}) == 1
    apart = sim.rendered(2)[0] - sim.rendered(0)[0]
    np.testing.assert_allclose(apart, np.tile([0.6, 0.0, 0.0], (len(apart), 1)), atol=1e-6)


def test_what_cannot_be_drawn_is_refused():
    surface = surface_of(FINE)
    with pytest.raises(ValueError, match=r"body 'ball': render .*: give a wc\.Surface"):
        with_render(FINE)
    with pytest.raises(ValueError, match=r"'ball': its render surface reaches 99\.\d m away"):
        with_render(surface.transformed(1e3 * np.eye(3)))
    with pytest.raises(ValueError, match="body 'body0' was given no render surface"):
        with_render(surface).rendered(0)
    with pytest.raises(ValueError, match="there is no body 'nobody'"):
        with_render(surface).rendered("nobody")
