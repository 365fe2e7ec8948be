"""A body of a scene."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.pose import pose_of
from warp_contact.scene.surface import Surface


@dataclass(frozen=True, eq=False)
class Body:
    """One deformable body, as placed in the scene.

    Attributes:
        index: its place in the scene
        label: its name, unique in the scene
        mesh: rest shape
        material: constitutive model
        x: initial positions [m], shape (n, 3)
        v: initial velocities [m/s], shape (n, 3)
        fixed: which vertices follow a prescribed velocity, shape (n,), bool
        world: bodies of different worlds never touch
        friction: its Coulomb coefficient, None for that of the scene
        restitution: its coefficient of restitution, the same
        render: surface to draw in place of that of its tets, in the frame of the mesh, or None
        start: positions [m] in which it starts, shape (n, 3), if it is deformed then; else None,
            and it starts at ``x``
    """

    index: int
    label: str
    mesh: TetMesh
    material: Any
    x: np.ndarray = field(repr=False)
    v: np.ndarray = field(repr=False)
    fixed: np.ndarray = field(repr=False)
    world: int
    friction: float | None = None
    restitution: float | None = None
    render: Surface | None = None
    start: np.ndarray | None = field(default=None, repr=False)

    @property
    def starts(self) -> np.ndarray:
        """Positions in which it starts [m], shape (n, 3)."""
        return self.x if self.start is None else self.start

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and quaternion (x, y, z, w) that take its mesh to ``x``."""
        return pose_of(self.x, self.mesh.vertices, np.ones(len(self.x)))
