"""pieces.py: how many pieces a mesh has, and the seams that are joined or named."""

import warnings

import numpy as np
import pytest

from warp_contact import MeshError, NeoHookean, Scene, Simulation, TetMesh, box

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def parted(mesh: TetMesh) -> TetMesh:
    """The two halves of a mesh, each with its own vertices."""
    side = mesh.vertices[mesh.tets].mean(axis=1)[:, 0] > 0.0
    tets = mesh.tets + len(mesh.vertices) * side[:, None]
    used, tets = np.unique(tets, return_inverse=True)
    x = np.concatenate([mesh.vertices, mesh.vertices])[used]
    return TetMesh(x, tets.reshape(-1, 4))


@pytest.fixture
def whole() -> TetMesh:
    return box((0.2, 0.1, 0.1), (4, 2, 2))


def test_a_mesh_says_how_many_pieces_it_has(whole):
    assert whole.n_pieces == 1 and "pieces" not in repr(whole)
    far = np.concatenate([whole.vertices + (k, 0.0, 0.0) for k in range(3)])
    tets = np.concatenate([whole.tets + k * len(whole.vertices) for k in range(3)])
    three = TetMesh(far, tets)
    assert three.n_pieces == 3 and len(three.seams) == 0
    assert "in 3 pieces" in repr(three)


def test_pieces_are_found_whatever_the_numbers_of_their_vertices(rng):
    far = box((6.0, 0.1, 0.1), (60, 1, 1))  # a long way from one end to the other
    place = rng.permutation(2 * len(far.vertices))
    x = np.empty((len(place), 3))
    x[place] = np.concatenate([far.vertices, far.vertices + (0.0, 1.0, 0.0)])
    tets = place[np.concatenate([far.tets, far.tets + len(far.vertices)])]
    assert TetMesh(x, tets).n_pieces == 2


def test_a_seam_is_named_and_can_be_welded(whole, rng):
    halves = parted(whole)
    pairs = halves.vertices[halves.seams]
    assert halves.n_pieces == 2 and len(pairs) == 9  # a face of 2 x 2 cells
    np.testing.assert_array_equal(pairs[:, 0], pairs[:, 1])
    assert (pairs[..., 0] == 0.0).all()
    again = halves.welded()
    assert again.n_pieces == 1 and len(again.seams) == 0
    assert len(again.vertices) == len(whole.vertices)
    assert len(again.surface) == len(whole.surface)
    # A gap that is wider than the default tolerance needs one that is given.
    x = halves.vertices + 1e-5 * rng.uniform(-0.5, 0.5, halves.vertices.shape)
    torn = TetMesh(x, halves.tets)
    assert len(torn.seams) == 0 and torn.welded().n_pieces == 2
    assert torn.welded(2e-5).n_pieces == 1
    with pytest.raises(MeshError, match="give a smaller one"):
        torn.welded(0.06)  # an edge has 0.05


def test_a_seam_within_one_piece_is_named_too():
    ring = box((0.3, 0.3, 0.1), (3, 3, 1))
    centre = ring.vertices[ring.tets].mean(axis=1)
    hollow = (np.abs(centre[:, :2]) > 0.05).any(axis=1)
    low = hollow & (centre[:, 0] > 0.0) & (centre[:, 1] > -0.05) & (centre[:, 1] < 0.05)
    x, tets = ring.vertices, ring.tets.copy()
    cut = np.flatnonzero(np.isclose(x[:, 1], 0.05) & (x[:, 0] > 0.04))
    copies = np.arange(len(x), len(x) + len(cut))
    for old, new in zip(cut, copies, strict=True):
        tets[low] = np.where(ring.tets[low] == old, new, tets[low])
    used, tets = np.unique(tets[hollow], return_inverse=True)
    slit = TetMesh(np.concatenate([x, x[cut]])[used], tets.reshape(-1, 4))
    assert slit.n_pieces == 1 and len(slit.seams) == len(cut) == 4
    assert len(slit.welded().vertices) == len(slit.vertices) - 4


def test_a_scene_warns_of_a_seam_and_refuses_a_soup(whole):
    with pytest.warns(UserWarning, match=r"body 'half': 9 pairs .* mesh.welded\(\) joins them"):
        Scene().add_body(parted(whole), RUBBER, label="half")
    soup = TetMesh(
        whole.vertices[whole.tets].reshape(-1, 3), np.arange(whole.tets.size).reshape(-1, 4)
    )
    assert soup.n_pieces == len(whole.tets)
    with pytest.raises(ValueError, match=r"body 'soup': its tets share no vertex.*mesh.welded"):
        Scene().add_body(soup, RUBBER, label="soup")
    again = soup.welded()
    assert again.n_pieces == 1 and again.volume == pytest.approx(whole.volume)
    Scene().add_body(again, RUBBER)


@pytest.mark.parametrize("size", [8e-7, 1.2e3])
def test_a_scene_warns_of_sizes_that_are_no_metres(size):
    with pytest.warns(UserWarning, match=r"body 'big' is .* m large; for millimetres .*unit=1e-3"):
        Scene().add_body(box(size, 1), RUBBER, label="big")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Scene().add_body(box(min(max(size, 1e-6), 1e3), 1), RUBBER)


@pytest.mark.parametrize("size", [5e-9, 2e9])
def test_a_scene_refuses_sizes_without_a_place_in_float32(size):
    mesh = box(1.0, 1).scaled(size, size, size)
    with pytest.raises(ValueError, match=r"body 'body0': its mesh is .* m large, and must have"):
        Scene().add_body(mesh, RUBBER)


def test_a_body_that_its_own_weight_would_crush_is_warned_of():
    scene = Scene()
    scene.add_body(box(0.1, 1), NeoHookean(0.1, 0.3, 1000.0), label="gel")  # 981 Pa
    scene.add_body(box(0.1, 1), NeoHookean(0.1, 0.3, 1000.0), (1, 0, 0), fixed=True)
    scene.add_body(box(0.1, 1), NeoHookean(400.0, 0.3, 1000.0), (2, 0, 0))
    with pytest.warns(UserWarning, match=r"'gel': at its foot .* 981 Pa, 9.81e\+03 times") as said:
        Simulation(scene)
    assert len(said) == 1 and said[0].filename == __file__
