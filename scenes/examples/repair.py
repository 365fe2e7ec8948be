"""Import of a mesh and its repair: a file in millimetres whose halves nothing joins.

``python -m warp_contact.scenes.examples.repair``
"""

import tempfile
import warnings
from pathlib import Path

import numpy as np

import warp_contact as wc


def write_broken(path: Path) -> None:
    """A bar of two blocks in millimetres, with vertices of its own for each: stands for yours."""
    block = wc.box((40.0, 20.0, 20.0), (4, 2, 2))
    points = np.concatenate([block.vertices, block.vertices + (40.0, 0.0, 0.0)])
    tets = np.concatenate([block.tets, block.tets + len(block.vertices)])
    np.savez(path, vertices=points, tets=tets)


def repaired(path: Path) -> wc.TetMesh:
    """The mesh of a file, in metres, in one piece, about the origin."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that there are seams is what we look for
        mesh = wc.TetMesh.load(path, unit=1e-3)
    print(mesh.n_pieces, "pieces,", len(mesh.seams), "pairs of vertices in the same place")
    mesh = mesh.welded() if len(mesh.seams) else mesh
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    print("now", mesh.n_pieces, "of the size", high - low, "m; worst tet", mesh.quality.min())
    return mesh.transformed(np.eye(3), -0.5 * (low + high))


def build() -> wc.Scene:
    """The bar as a cantilever, held at its left end."""
    with tempfile.TemporaryDirectory() as folder:
        write_broken(Path(folder) / "bar.npz")
        mesh = repaired(Path(folder) / "bar.npz")
    scene = wc.Scene()
    rubber = wc.NeoHookean(1e5, 0.4, 1000.0, damping=4e-3)
    held = mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 1e-6
    scene.add_body(mesh, rubber, (0.0, 0.0, 0.1), fixed=held, label="bar")
    return scene


def main(frames: int = 60) -> float:
    """How far the free end sags [m]."""
    scene = build()
    sim = wc.Simulation(scene, integrator="implicit")
    for _ in sim.frames(frames):
        pass
    sag = float((scene.bodies[0].x - sim.positions("bar"))[:, 2].max())
    print(f"the free end sags by {1e3 * sag:.1f} mm")
    return sag


if __name__ == "__main__":
    main()
