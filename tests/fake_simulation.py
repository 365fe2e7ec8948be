"""Moving cubes without a solver for the tests of USD files."""

from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import warp as wp
from pxr import Usd

from warp_contact.scene.shapes import box
from warp_contact.usd import reader
from warp_contact.usd.writer import UsdWriter


class FakeSimulation:
    """Waving cubes: the interface the writer needs, with positions known at every frame."""

    BODY: ClassVar[dict] = {"world": 0, "start": None}

    def __init__(self, labels=("left", "right"), n=4, fps=60):
        """Unit cubes of n^3 cells in a row along x."""
        mesh = box(1.0, n)
        x, tets, tris = mesh.vertices, mesh.tets, mesh.surface
        k, i = len(labels), np.arange(len(labels))
        self.rest = np.concatenate([x + [2.0 * b, 0.0, 1.0] for b in i]).astype(np.float32)
        flat = np.concatenate([b * len(x) + tets for b in i])
        faces = np.concatenate([b * len(x) + tris for b in i])
        material = SimpleNamespace(
            youngs_modulus=1e5, poisson_ratio=0.4, density=1000.0, kernels="soft"
        )
        free = np.repeat(i > 0, len(x)) if k > 2 else np.ones(k * len(x))

        def ints(values, kind=wp.int32):
            return wp.array(np.asarray(values, dtype=np.int32), dtype=kind, device="cpu")

        self.model = SimpleNamespace(
            labels=tuple(labels),
            materials=(material,) * k,
            gravity=(0.0, 0.0, -9.81),
            body_vert=ints(np.arange(k + 1) * len(x)),
            body_tet=ints(np.arange(k + 1) * len(tets)),
            body_tri=ints(np.arange(k + 1) * len(tris)),
            tets=ints(flat, wp.vec4i),
            tris=ints(faces, wp.vec3i),
            inv_mass=wp.array(free, dtype=float, device="cpu"),
            plane_n=wp.array([[0.0, 0.0, 1.0]], dtype=wp.vec3, device="cpu"),
            plane_h=wp.array([0.0], dtype=float, device="cpu"),
        )
        self.scene = SimpleNamespace(
            bodies=[
                SimpleNamespace(
                    x=part, v=0.0 * part, fixed=held == 0.0, material=material, **self.BODY
                )
                for part, held in zip(np.split(self.rest, k), np.split(free, k), strict=True)
            ],
            gravity=self.model.gravity,
            friction=0.5,
            attachments=[],
            restitution=0.0,
            coefficients=lambda name: (k + 1) * [0.5 if name == "friction" else 0.0],
        )
        self.fps, self.frame = fps, 0

    def at(self, frame):
        """Positions [m] at a frame."""
        wave = 0.1 * np.sin(0.1 * frame + 3.0 * self.rest[:, :1])
        return (self.rest + wave * [0.2, 0.5, 1.0]).astype(np.float32)

    def positions(self):
        """Positions [m]."""
        return self.at(self.frame)

    def velocities(self):
        """Velocities [m/s]."""
        return np.zeros_like(self.rest)

    def contact_fields(self):
        """Contact on the lower third of each body."""
        height = self.rest[:, 2] - 0.5
        depth = np.maximum(0.3 - height, 0.0).astype(np.float32) * abs(np.sin(0.1 * self.frame))
        return {
            "pressure": 2e4 * depth * (1.0 + self.rest[:, 0]),
            "penetration": 1e-3 * depth,
            "partner": np.where(depth > 0.0, 0, -1).astype(np.int32),
        }


def written(path, n_frames=5, sim=None, **options) -> Usd.Stage:
    """The stage after frames 0 ... n_frames."""
    sim = sim or FakeSimulation()
    with UsdWriter(path, sim, **options) as writer:
        for sim.frame in range(n_frames + 1):
            writer.write()
    return reader.open_stage(path)


def surface_ids(sim, b):
    """Surface vertices of a body in the flat arrays."""
    tri = sim.model.body_tri.numpy()
    return np.unique(sim.model.tris.numpy()[tri[b] : tri[b + 1]])
