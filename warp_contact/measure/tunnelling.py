"""Which points went through a body or a plane since the first call."""

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.output import tunnelling
from warp_contact.kernels.ties.attachment import Partners
from warp_contact.measure.trees import Trees


class Tunnelling:
    """Counts the points that go through a body or deep below a plane; remembers the last state.

    Attributes:
        count: of these points so far
        pair: labels of the bodies of the last of them, None before
    """

    def __init__(self, model: Model, names: list[str], trees: Trees, partners: Partners):
        """Before the first state; ``names`` are those of bodies, then of planes."""
        self.count = 0
        self.pair: tuple[str, str] | None = None
        self._model, self._names, self._trees, self._partners = model, names, trees, partners
        self._last: wp.array | None = None

    def memory(self) -> dict[str, np.ndarray]:
        """What it remembers of the states seen so far."""
        if self._last is None:
            return {}
        kept = {"last": self._last, "entered": self._inside.entered, "deep": self._inside.deep}
        memory = {name: array.numpy() for name, array in kept.items()}
        pair = np.array(self.pair or (), dtype=str)
        return memory | {"tunnelled": np.array(self.count), "tunnelled_pair": pair}

    def remember(self, memory: dict[str, np.ndarray]) -> None:
        """Continue from the ``memory`` of another instance of the same model."""
        if not memory:
            return
        self._begin(wp.array(memory["last"], dtype=wp.vec3))
        self._inside.entered.assign(memory["entered"])
        self._inside.deep.assign(memory["deep"])
        self.count = int(memory["tunnelled"])
        self.pair = tuple(memory["tunnelled_pair"].tolist()) or None

    def follow(self, x: wp.array) -> None:
        """Count the points that went through something since the last call."""
        model = self._model
        if self._last is None:
            self._begin(wp.clone(x))
            return
        self._trees.refit(self._last, x)
        passed = wp.zeros(len(self._ends), dtype=int)
        wp.launch(
            tunnelling.follow_points,
            dim=len(self._ends),
            inputs=[self._trees.bodies.id, self._trees.mesh, self._ends]
            + [model.body_world, model.body_thickness, self._partners, self._last, x],
            outputs=[self._inside, passed],
        )
        wp.copy(self._last, x)
        body = passed.numpy()
        through = np.flatnonzero(body >= 0)
        self.count += len(through)
        if len(through):
            own = model.vert_body.numpy()[self._ends.numpy()[through[-1], 0]]
            self.pair = self._names[own], self._names[body[through[-1]]]

    def jump(self, x: wp.array, placed: np.ndarray) -> None:
        """Continue from ``x``; bodies ``placed``, a mask, were put there without motion."""
        own = self._model.vert_body.numpy()[self._ends.numpy()[:, 0]]
        entered, deep = self._inside.entered.numpy(), self._inside.deep.numpy()
        into = np.where(entered < 0, -1, self._model.tri_body.numpy()[entered])
        anew = placed[own] | ((into >= 0) & placed[into])
        self._inside.entered.assign(np.where(anew, np.int32(-1), entered))
        self._inside.deep.assign(np.where(anew, np.int32(0), deep))
        wp.copy(self._last, x)

    def _begin(self, x: wp.array) -> None:
        """Remember the first state."""
        surf = np.repeat(self._model.surf.numpy()[:, None], 2, axis=1)
        ends = np.concatenate([surf, self._model.edges.numpy()[:, :2]])
        self._ends = wp.array(ends, dtype=wp.vec2i)
        self._inside = tunnelling.Inside()
        self._inside.entered = wp.full(len(ends), -1, dtype=int)
        self._inside.deep = wp.zeros(len(ends), dtype=int)
        self._last = x
