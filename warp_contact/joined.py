"""What a user reads of attachments between frames, and how they are let go."""

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Model
from warp_contact.exclusive import exclusively
from warp_contact.frame.stepper import Stepper
from warp_contact.scene.attachments import Attachment


class Joined:
    """Forces of the attachments of a simulation, and which hold."""

    fps: float
    frame: int
    device: object
    model: Model
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
            work.broad_phase.stale.fill_(1)
            if stepper.sleeping:
                world = stepper.worlds.of_body[self.model.ties.body[which, 0]]
                woken = np.arange(stepper.worlds.n) == world
                stepper.sleeping.wake_all(woken, work)

    def _attachment(self, attachment: Attachment | str) -> int:
        labels = self.model.ties.labels if self.model.ties else ()
        label = attachment.label if isinstance(attachment, Attachment) else attachment
        if not isinstance(label, str):
            raise checks.refuse("attachment", attachment, "an attachment or its label")
        if label not in labels:
            known = ", ".join(labels) or "none"
            raise ValueError(f"there is no attachment '{label}': the scene has {known}")
        return labels.index(label)
