"""What all tests share: every device, a fresh seed, boxes of tets, models without a scene."""

import os
from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp


@pytest.fixture(autouse=True, params=wp.get_devices(), ids=str)
def device(request):
    """Every test runs on every device."""
    with wp.ScopedDevice(request.param):
        yield request.param


@pytest.fixture
def rng():
    """Fresh numbers in every run; a failure prints the seed, SEED=... repeats it."""
    seed = int(os.environ.get("SEED", np.random.SeedSequence().entropy % 2**32))
    print(f"SEED={seed}")
    return np.random.default_rng(seed)


def _box(cells: tuple[int, int, int], size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    m = np.array(cells) + 1
    x = np.stack(np.meshgrid(*map(np.arange, m), indexing="ij"), axis=-1).reshape(-1, 3)
    stride = np.array([m[1] * m[2], m[2], 1])
    first = x[(x < cells).all(axis=1)]
    tets = []
    for path in permutations(range(3)):
        corner = [first]
        for axis in path:
            corner.append(corner[-1] + np.eye(3, dtype=int)[axis])
        ids = np.stack(corner, axis=1) @ stride
        odd = np.linalg.det(np.eye(3)[list(path)]) < 0.0
        tets.append(ids[:, [0, 2, 1, 3]] if odd else ids)
    return size * x.astype(float), np.stack(tets, axis=1).reshape(-1, 4)


@pytest.fixture
def box():
    """Vertices [m] and tets of ``box((nx, ny, nz), size of a cell)``, six tets a cell."""
    return _box


def _model(*bodies, fixed=(), gravity=(0.0, 0.0, 0.0)) -> SimpleNamespace:
    counts = np.cumsum([0] + [len(x) for x, _, _ in bodies])
    x = np.concatenate([b[0] for b in bodies])
    tets = np.concatenate([b[1] + i for b, i in zip(bodies, counts, strict=False)])
    edges = np.swapaxes(x[tets[:, 1:]] - x[tets[:, :1]], 1, 2)
    volume = np.linalg.det(edges) / 6.0
    density = np.concatenate([np.full(len(t), material.density) for _, t, material in bodies])
    mass = np.bincount(tets.ravel(), np.repeat(density * volume / 4.0, 4))
    inv_mass = 1.0 / mass
    inv_mass[list(fixed)] = 0.0
    start = np.concatenate([[0], np.cumsum(np.bincount(tets.ravel()))])
    pairs = [(i, j) for i in range(4) for j in range(4) if i != j]
    ends = np.unique(tets[:, pairs].reshape(-1, 2), axis=0)
    elements, first = [], 0
    for vertices, t, material in bodies:
        elements.append(
            SimpleNamespace(
                kernels=material.kernels,
                tet=wp.array(np.arange(first, first + len(t)), dtype=int),
                param=wp.array(material.parameters(vertices, t), dtype=material.kernels.ROW),
                damped=material.damping > 0.0,
            )
        )
        first += len(t)
    return SimpleNamespace(
        elements=tuple(elements),
        g=wp.array([gravity], dtype=wp.vec3),
        n_body=len(bodies),
        n_vert=len(x),
        n_tet=len(tets),
        body_vert=wp.array(counts, dtype=int),
        vert_body=wp.array(np.repeat(np.arange(len(bodies)), np.diff(counts)), dtype=int),
        mass=wp.array(mass, dtype=float),
        inv_mass=wp.array(inv_mass, dtype=float),
        tets=wp.array(tets, dtype=wp.vec4i),
        pose=wp.array(np.linalg.inv(edges), dtype=wp.mat33),
        volume=wp.array(volume, dtype=float),
        vt_start=wp.array(start, dtype=int),
        vt_corner=wp.array(np.argsort(tets.ravel(), kind="stable"), dtype=int),
        vn_start=wp.array(np.searchsorted(ends[:, 0], np.arange(len(x) + 1)), dtype=int),
        vn_vert=wp.array(ends[:, 1], dtype=int),
    )


@pytest.fixture
def build_model():
    """The elastic part of a Model from bodies (rest vertices [m], tets, material)."""
    return _model


def _at_vertices(launch, model, *fields) -> np.ndarray:
    f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
    launch(model, *[wp.array(u, dtype=wp.vec3) for u in fields], f_tet)
    f = np.zeros((model.n_vert, 3))
    np.add.at(f, model.tets.numpy().ravel(), f_tet.numpy().reshape(-1, 3).astype(float))
    return f


@pytest.fixture
def at_vertices():
    """Sum over the corners of a stage: ``at_vertices(forces.apply_stiffness, model, x, dx)``."""
    return _at_vertices


@pytest.fixture
def forces_of():
    """Vertex forces [N] of ``forces_of(model, x)``."""
    from warp_contact.step import forces

    def launch(model, x, f_tet):
        mask = wp.full(model.n_tet, 1, dtype=int)
        forces.internal_forces(model, x, mask, f_tet)

    return lambda model, x: _at_vertices(launch, model, x)


@pytest.fixture
def dense():
    """Matrix of ``dense(stage, model, x)``, shape (3 n_vert, 3 n_vert)."""

    def matrix(launch, model, x):
        unit = np.eye(3 * model.n_vert).reshape(-1, model.n_vert, 3)
        return np.stack([_at_vertices(launch, model, x, u).ravel() for u in unit], axis=1)

    return matrix


ROOM = {"contacts": 4096, "pairs": 64}
ROOM |= {"verts": 8192, "tets": 65536, "edges": 8192, "tris": 65536, "near": 65536}


def _stages(scene, capacity=None, dt=1e-3, unit=1.0) -> tuple:
    from warp_contact.data.overflow import Capacity
    from warp_contact.data.work import allocate_work
    from warp_contact.scene.assemble import assemble

    model, state = assemble(scene)
    work = allocate_work(model, state, capacity or Capacity(**ROOM), unit=unit)
    work.dt.fill_(dt)
    return model, state, work


@pytest.fixture
def stages():
    """Model, State and Work of ``stages(scene, capacity, dt, unit)``, to run single stages."""
    return _stages


def _find_contacts(model, work, x0, x=None, edges=False, apart=False) -> SimpleNamespace:
    from warp_contact.step import broad_phase, detection

    x = x0 if x is None else x
    work.worlds.apart.fill_(int(apart))
    broad_phase.refresh(model, x0, x, work)
    if edges:
        detection.detect(model, x0, x, work)
    else:
        detection.detect_vertices(model, x0, x, work)
    assert not work.overflow.all.numpy().any()
    return _records(work)


def _records(work) -> SimpleNamespace:
    c = work.contacts
    n = int(c.n.numpy()[0])
    fields = {"residual": work.surface.residual.numpy()[:n].copy()}
    for array in (c.record, c.constraint):
        structs = array.numpy()[:n]
        fields |= {name: structs[name].copy() for name in structs.dtype.names}
    impulse = c.impulse.numpy()[:n]  # two of its fields have names of the others
    fields |= {f"{name}_impulse": impulse[name].copy() for name in ("normal", "friction")}
    fields["ahead"] = impulse["ahead"].copy()
    return SimpleNamespace(n=n, **fields)


@pytest.fixture
def find_contacts():
    """Contacts at ``x`` in a step from ``x0``, by stages 2 to 4, as ``records`` has them.

    ``find_contacts(model, work, x0, x, edges, apart)``; ``apart`` as in ``kernels/worlds.py``.
    """
    return _find_contacts


@pytest.fixture
def records():
    """Fields of all contacts as flat NumPy arrays, ``records(work)``.

    Those of their record and constraint, ``normal_impulse``, ``friction_impulse``, ``ahead`` and
    ``residual``.
    """
    return _records


@pytest.fixture
def turned(rng):
    """Random unit quaternions (x, y, z, w), ``turned()``."""

    def quaternion() -> np.ndarray:
        q = rng.normal(size=4)
        return q / np.linalg.norm(q)

    return quaternion


@pytest.fixture
def jittered(rng):
    """A box whose vertices are shifted at random by a part of a cell, ``jittered(size, cells)``."""
    from warp_contact import TetMesh, box

    def mesh(size: float, cells: int, part: float = 0.15) -> TetMesh:
        regular = box(size, cells)
        shift = rng.uniform(-part, part, regular.vertices.shape) * size / cells
        return TetMesh(regular.vertices + shift, regular.tets)

    return mesh


@pytest.fixture
def pile(rng, turned):
    """Blocks that fall onto each other and a floor, all touching within a few frames."""
    from warp_contact import NeoHookean, Scene, box

    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(8):
        place = rng.uniform(-0.05, 0.05, 3) + [0.0, 0.0, 0.2 + 0.22 * k]
        velocity = rng.uniform(-0.5, 0.5, 3) - [0.0, 0.0, 1.0 + 0.5 * k]
        soft = NeoHookean(3e4, 0.3, 1000.0, 2e-3)
        scene.add_body(box(0.16, 2), soft, place, turned(), velocity)
    return scene
