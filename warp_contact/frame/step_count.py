"""The number of steps that the next frame of a simulation takes, from its state."""

import numpy as np

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.errors import SimulationError
from warp_contact.frame import step_bounds
from warp_contact.frame.diagnosis import flattest_tet
from warp_contact.frame.implicit_shapes import largest_mobilities
from warp_contact.frame.last_frame import LastFrame
from warp_contact.frame.reach import reaches
from warp_contact.frame.worlds import WorldIds
from warp_contact.frame.wrench import Wrench
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce


class StepCount:
    """What step_bounds.py needs to know of one scene; the formulas are there.

    Attributes:
        fps: frames per second
        wanted: steps in a frame that the user chose, or None
        most: steps in a frame that are taken if the user chose none
        wrench: what the user lets act on bodies
    """

    wrench: Wrench

    def __init__(
        self,
        model: Model,
        response: ContactSurface | Penalty | PredictedForce,
        fps: float,
        wanted: int | None,
        most: int,
        worlds: WorldIds,
        shapes: Shapes | None = None,
    ):
        """Read sizes of the bodies once; without ``shapes`` all take explicit steps."""
        self.fps = fps
        self.wanted = wanted
        self.most = most
        self._model = model
        self._response = response
        one_pass = isinstance(response, PredictedForce)
        self._rate = step_bounds.ONE_PASS if one_pass else step_bounds.RESOLVED
        self._leaves = not isinstance(response, ContactSurface) or response.search == "literal"
        self._worlds = worlds
        explicit = shapes.too_large if shapes else np.ones(model.n_body, dtype=bool)
        sizes = np.stack([model.body_thickness.numpy(), model.body_edge.numpy()])
        self._sizes = -worlds.most(np.where(explicit, -sizes.astype(np.float64), -np.inf))
        self._reach = model.body_thickness.numpy().astype(np.float64)
        if shapes:
            self._reach = reaches(model, worlds, shapes.kind)
        self._implicit, self._mixed = shapes is not None, worlds.most(explicit.astype(int)) > 0
        lightest = np.zeros(worlds.n)
        np.maximum.at(lightest, worlds.of_vert, largest_mobilities(model))
        self._largest_inv_mass = lightest

    def steps(
        self, state: State, of_bodies: np.ndarray, omega: np.ndarray, last: LastFrame, frame: int
    ) -> np.ndarray:
        """Steps of each world in frame number ``frame``, shape (n_world,).

        Args:
            state: at its start
            of_bodies: the largest frequency of each body [1/s], shape (n_body,)
            omega: the one that is reckoned with in each world [1/s], shape (n_world,)
            last: numbers of the frame before; ``overlapping`` is known
            frame: its number, for the message

        Raises:
            SimulationError: no step is stable, or more than ``most`` are needed
        """
        if not np.isfinite(omega).all():
            tet = flattest_tet(self._model, state.x)
            raise SimulationError(f"frame {frame}: {tet} is too flat: no step is stable")
        if self.wanted:
            return np.full(self._worlds.n, self.wanted)
        pushed = self._worlds.most(self.wrench.gains(1.0 / self.fps))
        omega, speed = self._with_response(omega), self._speed(state) + pushed
        overlaps = (last.overlapping > 0) | self._leaves
        thickness, edge = self._sizes
        per_second = step_bounds.steps_per_second(omega, speed, thickness, edge, overlaps)
        n = step_bounds.steps_in_frame(per_second, self.fps, last.n)
        if self._implicit:
            crossing, before = self._crossing(state), np.where(self._mixed, last.n, 0)
            lasts = (last.overlapping > 0) & ~self._leaves
            rate = np.where(lasts, step_bounds.RESOLVING, self._rate)
            given = per_second, crossing, self.fps, rate, before
            n = step_bounds.implicit_steps(*given).astype(int)
            per_second = np.maximum(per_second, crossing / step_bounds.STRIDE)
        w = int(n.argmax())
        if n[w] > self.most:
            body = int(np.where(self._worlds.of_body == w, of_bodies, -1.0).argmax())
            cause = self._of_stiffness(state, body, omega[w])
            stiff = self._mixed[w] or isinstance(self._response, Penalty)
            if self._implicit and not stiff:
                cause = f"{flattest_tet(self._model, state.x)} is crushed: a stiffer material helps"
            if per_second[w] > step_bounds.PATIENCE * omega[w]:  # the speed asks for them
                cause = self._of_speed(state, w, speed[w])
            few = f"max_substeps={self.most}"
            raise SimulationError(f"frame {frame} needs {n[w]} substeps, more than {few}: {cause}")
        return n

    def _of_stiffness(self, state: State, body: int, omega: float) -> str:
        """Why a step is short, and what to do, where vibrations limit it."""
        if isinstance(self._response, Penalty):
            given = f"{self._response.stiffness:g} N/m, {self._response.damping:g} N s/m"
            return f"a penalty of {given} is too stiff for the lightest vertex"
        name = f"body '{self._model.labels[body]}'"
        flattest = f"the flattest tet is {flattest_tet(self._model, state.x)}"
        remedy = "check density [kg/m^3], modulus [Pa], size [m] and tets, or raise max_substeps"
        return f"{name} vibrates at {omega / (2.0 * np.pi):.3g} Hz ({flattest}); {remedy}"

    def _of_speed(self, state: State, world: int, speed: float) -> str:
        """The same where motion limits it."""
        own = self._worlds.of_vert == world
        vertex = int(np.where(own, np.linalg.norm(state.v.numpy(), axis=1), -1.0).argmax())
        name = f"body '{self._model.labels[self._model.vert_body.numpy()[vertex]]}'"
        remedy = "check its velocity [m/s], or raise max_substeps"
        return f"{name} moves at up to {speed:.3g} m/s against others; {remedy}"

    def check(self, state: State, omega: np.ndarray, frame: int) -> None:
        """Refuse steps that the user chose too long; the motion in a step counts in frame 1 only.

        Args:
            state: at the start of the frame
            omega: largest frequency of the elastic forces of each world [1/s], shape (n_world,)
            frame: number of the frame

        Raises:
            SimulationError: a step is unstable, or bodies could pass through each other
        """
        if not self.wanted:
            return
        speed = self._speed(state) if frame == 1 else np.zeros(self._worlds.n)
        dt = 1.0 / (self.fps * self.wanted)
        for w, fastest in enumerate(self._with_response(omega)):
            wrong = step_bounds.fault(dt, fastest, speed[w], -self._worlds.most(-self._reach)[w])
            if wrong:
                few = f"substeps={self.wanted} is too few"
                raise SimulationError(f"frame {frame}: {few}: {wrong}")

    def _with_response(self, omega: np.ndarray) -> np.ndarray:
        """The frequencies [1/s] of the elastic forces, or those of a penalty with them."""
        if isinstance(self._response, Penalty):
            given = self._response.steepness, self._response.damping, self._largest_inv_mass
            return step_bounds.with_penalty(omega, *given)
        return omega

    def _crossing(self, state: State) -> np.ndarray:
        """Largest speed against a body over its reach [1/s], in each world, (n_world,)."""
        v, of_body = state.v.numpy().astype(np.float64), self._model.vert_body.numpy()
        count = np.maximum(np.bincount(of_body), 1)
        mean = np.stack([np.bincount(of_body, u) / count for u in v.T], axis=1)
        spread = np.zeros(len(count))
        np.maximum.at(spread, of_body, np.linalg.norm(v - mean[of_body], axis=1))
        most, least, fastest = self._extremes(v)
        box = np.linalg.norm(np.maximum(most - mean, mean - least), axis=1)
        ball = fastest + np.linalg.norm(mean, axis=1)
        gained = float(np.linalg.norm(self._model.gravity)) / self.fps
        gained = gained + self.wrench.gains(1.0 / self.fps)
        own = self._worlds.most(gained)[self._worlds.of_body]
        speed = np.minimum(box, ball) + spread + own
        return self._worlds.most(speed / self._reach)

    def _extremes(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Largest and least velocities and largest speed in the world of each body."""
        speed = np.zeros(self._worlds.n)
        np.maximum.at(speed, self._worlds.of_vert, np.linalg.norm(v, axis=1))
        most, least = self._box(v)
        of = self._worlds.of_body
        return most[of], least[of], speed[of]

    def _box(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Largest and least velocities [m/s] of each world, shape (n_world, 3)."""
        most, least = np.full((2, self._worlds.n, 3), -np.inf)
        np.maximum.at(most, self._worlds.of_vert, v)
        np.maximum.at(least, self._worlds.of_vert, -v)
        return most, -least

    def _speed(self, state: State) -> np.ndarray:
        """Largest relative speed within each world in the frame to come [m/s], shape (n_world,)."""
        most, least = self._box(state.v.numpy())
        speed = np.linalg.norm(most - least, axis=1)
        return speed + float(np.linalg.norm(self._model.gravity)) / self.fps
