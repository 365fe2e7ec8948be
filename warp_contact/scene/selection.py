"""Bodies and vertices that a user names, as the model numbers them."""

from numbers import Integral

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Model
from warp_contact.scene import placement
from warp_contact.scene.pose import pose_of
from warp_contact.scene.scene import PLANE, Body, Scene, rotation_matrix
from warp_contact.scene.topology import HUGE

SAME = 1e-3  # of the size of a rigid body: how far its vertices may be from its shape


class Bodies:
    """The bodies of a scene: each may be given as itself, by its label or by its index."""

    def __init__(self, model: Model, scene: Scene):
        """Of a scene and its model."""
        self._model, self._scene = model, scene

    def range(self, body: Body | int | str | None) -> slice:
        """The vertices of a body; None for all."""
        if body is None:
            return slice(None)
        index = self.index(body)
        first, last = self._model.body_vert.numpy()[index : index + 2].tolist()
        return slice(first, last)

    def index(self, body: Body | int | str) -> int:
        """The number of a body; raises ValueError where there is no such body."""
        model = self._model
        if isinstance(body, str):
            if body not in model.labels:
                known = ", ".join(model.labels)
                more = "; forces() has those of planes" if PLANE.fullmatch(body) else ""
                raise ValueError(f"there is no body '{body}': the scene has {known}{more}")
            body = model.labels.index(body)
        if not isinstance(body, Body | Integral) or isinstance(body, bool):
            raise checks.refuse("body", body, "a body, its label or its index")
        index = body.index if isinstance(body, Body) else int(body)
        if not 0 <= index < model.n_body:
            raise ValueError(f"there is no body {index}: the scene has {model.n_body}")
        if isinstance(body, Body) and body is not self._scene.bodies[index]:
            raise ValueError(f"body '{body.label}' is of another scene")
        return index

    def index_or_plane(self, of: Body | int | str) -> int:
        """The number of a body, or n_body + p of plane p by its name; ValueError without it."""
        if not isinstance(of, str) or not PLANE.fullmatch(of):
            return self.index(of)
        plane, n = int(of.removeprefix("plane")), self._model.n_plane
        if plane >= n:
            raise ValueError(f"there is no '{of}': the scene has {n} planes")
        return self._model.n_body + plane

    def label(self, body: Body | int | str) -> str:
        """The label of a body."""
        return self._model.labels[self.index(body)]

    def choose(self, values: np.ndarray, body, vertices) -> tuple[np.ndarray, np.ndarray]:
        """A body's part of the values, as a view, and the vertices that are chosen of it."""
        part = values[self.range(body)]
        of = "the scene" if body is None else f"body '{self.label(body)}'"
        name = f"vertices of {of}"
        every = np.arange(len(part))
        return part, every if vertices is None else checks.vertex_ids(vertices, len(part), name)

    def choose_fixed(self, values: np.ndarray, body, vertices) -> tuple[np.ndarray, np.ndarray]:
        """The same of fixed vertices alone; None chooses all of these."""
        fixed = self._scene.bodies[self.index(body)].fixed
        part, chosen = self.choose(values, body, fixed if vertices is None else vertices)
        free = chosen[~fixed[chosen]]
        if len(free) or not len(chosen):
            wrong = f"vertex {free[0]}" if len(free) else "no vertex"
            only = (
                "only fixed ones move to a place; set_positions puts others there, a motor of an "
            )
            only = f"{only}attachment or apply drives them"
            is_fixed = "is not" if len(free) else "is"
            raise ValueError(f"{wrong} of body '{self.label(body)}' {is_fixed} fixed: {only}")
        return part, chosen

    def is_rigid(self, body) -> bool:
        """Whether a body keeps its shape."""
        return self._model.materials[self.index(body)].kernels is None

    def goal_pose(self, body, pose, positions) -> tuple[np.ndarray, np.ndarray] | None:
        """Translation [m] and rotation matrix of a ``pose``; None where positions are given."""
        if (pose is None) == (positions is None):
            raise ValueError(f"body '{self.label(body)}': give positions, or a pose, not both")
        if pose is None:
            return None
        if not isinstance(pose, tuple | list) or len(pose) != 2:
            raise checks.refuse("pose", pose, "a position [m] and a rotation (x, y, z, w)")
        return checks.numbers(pose[0], (3,), "position", HUGE), rotation_matrix(pose[1])

    def refuse_bent(self, x: np.ndarray, body) -> None:
        """Raise ValueError where a rigid body, or any, would not have its shape."""
        for b in range(self._model.n_body) if body is None else [self.index(body)]:
            mesh, own = self._scene.bodies[b].mesh, x[self.range(b)].astype(np.float64)
            if self.is_rigid(b):
                place, turn = pose_of(own, mesh.vertices, np.ones(len(own)))
                off = np.abs(own - mesh.vertices @ rotation_matrix(turn).T - place).max()
                if off > SAME * np.ptp(mesh.vertices, axis=0).max():
                    name = f"body '{self._model.labels[b]}' is rigid"
                    raise ValueError(f"{name}: positions change its shape; give a pose")

    def refuse_far(self, x: np.ndarray, body) -> None:
        """Raise ValueError where one body, or any, is further away than a scene may have it."""
        bodies = range(self._model.n_body) if body is None else [self.index(body)]
        edge = self._model.body_edge.numpy()
        for b in bodies:
            placement.check_distance(x[self.range(b)], float(edge[b]), self._model.labels[b])
