"""What a user reads of attachments between frames, and how they are let go."""

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.exclusive import exclusively
from warp_contact.frame.stepper import Stepper
from warp_contact.scene.attachments import Attachment

FARTHEST = 1e6  # [m], [rad] of a target


class Joined:
    """Forces of the attachments of a simulation, and which hold."""

    fps: float
    frame: int
    device: object
    model: Model
    state: State
    _stepper: Stepper

    def attachment_force(self, attachment: Attachment | str) -> np.ndarray:
        """Mean force of the last frame on the first body of an attachment [N], shape (3,).

        Raises:
            ValueError: there is no such attachment
        """
        which = self._attachment(attachment)
        with exclusively(self.device):
            impulse = self._stepper.work.ties.attachments.impulse.numpy()[which]
        return impulse * self.fps if self.frame else np.zeros(3)

    def set_motor(
        self,
        attachment: Attachment | str,
        velocity: float,
        limit: float,
        target: float | None = None,
    ) -> None:
        """Let a motor lead the first body of a hinge or a slider, from the next frame on.

        It leads to a velocity against the other body along the axis, or about it, as fast as its
        force allows, and keeps it; with a ``target``, to that place at a speed up to it, and keeps
        the place. The other body gets the opposite. Bodies of its world wake.

        Args:
            attachment: a hinge or a slider, or its label
            velocity: along the axis [m/s], of a hinge about it [rad/s]; the largest speed on the
                way to a target
            limit: of its force [N], of a hinge of its torque [N m]; 0 switches it off
            target: as ``attachment_position`` has it [m], [rad]; None for none

        Raises:
            ValueError: there is no such attachment, it has no axis or does not hold, or a number is
                out of range
        """
        which = self._with_axis(attachment, "a motor drives a hinge or a slider")
        if limit and not self.is_attached(attachment):
            label = self.model.ties.labels[which]
            raise ValueError(f"attachment '{label}' is broken or let go: its motor has no hold")
        velocity = checks.number(velocity, "velocity", -checks.FASTEST, checks.FASTEST)
        limit = checks.number(limit, "limit", least=0.0)
        goal = np.nan
        if target is not None:
            goal = checks.number(target, "target", -FARTHEST, FARTHEST)
            if velocity == 0.0:
                raise checks.refuse("velocity", velocity, "a speed that leads to the target")
        with exclusively(self.device):
            work = self._stepper.work
            motors = work.ties.motors
            motors.speed[which : which + 1].fill_(velocity)
            motors.target[which : which + 1].fill_(goal)
            motors.limit[which : which + 1].fill_(limit)
            work.ties.driven = bool(motors.limit.numpy().any())
            self._expect(which, velocity if limit else 0.0)
            self._wake_world_of(which)

    def attachment_position(self, attachment: Attachment | str) -> float:
        """How far the first body has moved along a slider [m], or turned about a hinge [rad].

        Against the other body, from where both stood when they were attached. Whole turns count
        while a motor leads to a target; else a hinge is half a turn away at most.

        Raises:
            ValueError: there is no such attachment, or it has no axis
        """
        which = self._with_axis(attachment, "only a hinge or a slider has a position")
        with exclusively(self.device):
            return float(self._stepper.work.ties.places(self.state.x).numpy()[which])

    def motor_force(self, attachment: Attachment | str) -> float:
        """Mean force [N] of a motor in the last frame along its axis, of a hinge torque [N m].

        On the first body; ``attachment_force`` does not count it.

        Raises:
            ValueError: there is no such attachment, or it has no axis
        """
        which = self._with_axis(attachment, "a motor drives a hinge or a slider")
        with exclusively(self.device):
            impulse = float(self._stepper.work.ties.motors.sum.numpy()[which])
        return impulse * self.fps if self.frame else 0.0

    def is_attached(self, attachment: Attachment | str) -> bool:
        """Whether an attachment holds: it neither broke nor was let go.

        Raises:
            ValueError: there is no such attachment
        """
        which = self._attachment(attachment)
        with exclusively(self.device):
            return bool(self._stepper.work.ties.attachments.broken.numpy()[which] == 0)

    def detach(self, attachment: Attachment | str) -> None:
        """Let an attachment go for good, between frames; its bodies wake, and may touch then.

        Raises:
            ValueError: there is no such attachment
        """
        which, stepper = self._attachment(attachment), self._stepper
        with exclusively(self.device):
            work = stepper.work
            work.ties.attachments.broken[which : which + 1].fill_(1)
            stepper.wrench.driven[which] = 0.0
            work.broad_phase.stale.fill_(1)
            self._wake_world_of(which)

    def _expect(self, which: int, velocity: float) -> None:
        """Let steps be short enough for bodies that a motor may bring to a velocity."""
        ties, x = self.model.ties, self.state.x.numpy()
        bodies = [b for b in ties.body[which] if b >= 0]
        own = np.isin(self.model.vert_body.numpy(), bodies)
        reach = np.linalg.norm(np.ptp(x[own], axis=0)) if ties.kind[which] == "hinge" else 1.0
        self._stepper.wrench.driven[which] = abs(velocity) * reach

    def _with_axis(self, attachment: Attachment | str, why: str) -> int:
        which, ties = self._attachment(attachment), self.model.ties
        if ties.kind[which] not in ("hinge", "slider"):
            raise ValueError(f"attachment '{ties.labels[which]}' is a {ties.kind[which]}: {why}")
        return which

    def _wake_world_of(self, which: int) -> None:
        stepper = self._stepper
        if stepper.sleeping:
            world = stepper.worlds.of_body[self.model.ties.body[which, 0]]
            woken = np.arange(stepper.worlds.n) == world
            stepper.sleeping.wake_all(woken, stepper.work)

    def _attachment(self, attachment: Attachment | str) -> int:
        labels = self.model.ties.labels if self.model.ties else ()
        label = attachment.label if isinstance(attachment, Attachment) else attachment
        if not isinstance(label, str):
            raise checks.refuse("attachment", attachment, "an attachment or its label")
        if label not in labels:
            known = ", ".join(labels) or "none"
            raise ValueError(f"there is no attachment '{label}': the scene has {known}")
        return labels.index(label)
