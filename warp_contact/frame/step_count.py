"""The number of steps that the next frame of a simulation takes, from its state."""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.errors import SimulationError
from warp_contact.frame import step_bounds
from warp_contact.frame.diagnosis import flattest_tet
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce


class StepCount:
    """What step_bounds.py needs to know of one scene; the formulas are there.

    Attributes:
        fps: frames per second
        wanted: steps in a frame that the user chose, or None
        most: steps in a frame that are taken if the user chose none
    """

    def __init__(
        self,
        model: Model,
        response: ContactSurface | Penalty | PredictedForce,
        fps: float,
        wanted: int | None,
        most: int,
    ):
        """Read sizes and worlds of the bodies once."""
        self.fps = fps
        self.wanted = wanted
        self.most = most
        self._model = model
        self._response = response
        self._leaves = not isinstance(response, ContactSurface) or response.search == "literal"
        self._thickness = float(model.body_thickness.numpy().min())
        self._edge = float(model.body_edge.numpy().min())
        of_bodies = np.unique(model.body_world.numpy(), return_inverse=True)[1]
        self._world = of_bodies[model.vert_body.numpy()]
        self._largest_inv_mass = float(model.inv_mass.numpy().max())

    def steps(
        self, state: State, omega: float, stiffest: int, last: int, frame: int, overlapping: bool
    ) -> int:
        """Steps of frame number ``frame``, after one of ``last`` steps.

        Args:
            state: at its start
            omega: largest frequency of the elastic forces [1/s]
            stiffest: the body with that frequency
            last: steps of the frame before
            frame: its number, for the message
            overlapping: whether there may be overlaps that no step created

        Raises:
            SimulationError: no step is stable, or more than ``most`` are needed
        """
        if not np.isfinite(omega):
            tet = flattest_tet(self._model, state.x)
            raise SimulationError(f"frame {frame}: {tet} is too flat: no step is stable")
        if self.wanted:
            return self.wanted
        omega, speed = self._with_response(omega), self._speed(state)
        sizes = self._thickness, self._edge
        per_second = step_bounds.steps_per_second(omega, speed, *sizes, overlapping or self._leaves)
        n = step_bounds.steps_in_frame(per_second, self.fps, last)
        if n > self.most:
            cause = self._of_stiffness(state, stiffest, omega)
            if per_second > step_bounds.PATIENCE * omega:  # the speed asks for them
                cause = self._of_speed(state, speed)
            few = f"max_substeps={self.most}"
            raise SimulationError(f"frame {frame} needs {n} substeps, more than {few}: {cause}")
        return n

    def _of_stiffness(self, state: State, body: int, omega: float) -> str:
        """Why a step is short, and what to do, where vibrations limit it."""
        if isinstance(self._response, Penalty):
            stiffness = self._response.stiffness
            return f"a penalty of {stiffness:g} N/m is too stiff for the lightest vertex"
        name = f"body '{self._model.labels[body]}'"
        flattest = f"the flattest tet is {flattest_tet(self._model, state.x)}"
        remedy = "check density [kg/m^3], modulus [Pa], size [m] and tets, or raise max_substeps"
        return f"{name} vibrates at {omega / (2.0 * np.pi):.3g} Hz ({flattest}); {remedy}"

    def _of_speed(self, state: State, speed: float) -> str:
        """The same where motion limits it."""
        vertex = int(np.linalg.norm(state.v.numpy(), axis=1).argmax())
        name = f"body '{self._model.labels[self._model.vert_body.numpy()[vertex]]}'"
        remedy = "check its velocity [m/s], or raise max_substeps"
        return f"{name} moves at up to {speed:.3g} m/s against others; {remedy}"

    def check(self, state: State, omega: float, frame: int) -> None:
        """Refuse steps that the user chose too long; the motion in a step counts in frame 1 only.

        Args:
            state: at the start of the frame
            omega: largest frequency of the elastic forces [1/s]
            frame: number of the frame

        Raises:
            SimulationError: a step is unstable, or bodies could pass through each other
        """
        if not self.wanted:
            return
        speed = self._speed(state) if frame == 1 else 0.0
        dt = 1.0 / (self.fps * self.wanted)
        wrong = step_bounds.fault(dt, self._with_response(omega), speed, self._thickness)
        if wrong:
            raise SimulationError(f"frame {frame}: substeps={self.wanted} is too few: {wrong}")

    def _with_response(self, omega: float) -> float:
        """The frequency [1/s] of the elastic forces, or that of a penalty with them."""
        if isinstance(self._response, Penalty):
            return step_bounds.with_penalty(omega, self._response.stiffness, self._largest_inv_mass)
        return omega

    def _speed(self, state: State) -> float:
        """Largest relative speed within a world in the frame to come [m/s]."""
        v = state.v.numpy()
        most, least = np.full((2, self._world.max() + 1, 3), -np.inf)
        np.maximum.at(most, self._world, v)
        np.maximum.at(least, self._world, -v)
        speed = float(np.linalg.norm(most + least, axis=1).max())
        return speed + float(np.linalg.norm(self._model.gravity)) / self.fps
