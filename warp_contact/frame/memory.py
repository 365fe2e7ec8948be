"""What a checkpoint needs of a stepper, beside the state."""

from dataclasses import astuple

import numpy as np

from warp_contact.data import damping, warm_start
from warp_contact.data.overflow import Capacity
from warp_contact.frame import checkpoint
from warp_contact.frame.last_frame import last_frame_of
from warp_contact.frame.stepper import Stepper


def values_of(stepper: Stepper) -> dict[str, np.ndarray]:
    """All that its next frame depends on; where a frame that explodes ends, on the room too."""
    work, sleeping = stepper.work, stepper.sleeping
    groups = {"last": stepper.last.values(), "start": stepper.spectrum.starts()}
    groups |= {"warm": warm_start.values(work.warm), "damping": damping.values(work.damping)}
    groups["room"] = {"capacity": np.array(astuple(work.capacity))}
    groups["wrench"] = stepper.wrench.values()
    if work.ties:
        groups["ties"] = work.ties.values()
    if sleeping:
        groups["sleeping"] = sleeping.values(work)
    return checkpoint.ungroup(groups)


def restore(stepper: Stepper, values: dict[str, np.ndarray]) -> None:
    """Take over the values of another stepper with the same scene and settings."""
    stepper.last = last_frame_of(checkpoint.group(values, "last"))
    stepper.spectrum.start_from(checkpoint.group(values, "start"))
    stepper.buffers.replace(Capacity(*values["room.capacity"].tolist()))
    warm_start.restore(stepper.work.warm, checkpoint.group(values, "warm"))
    damping.restore(stepper.work.damping, checkpoint.group(values, "damping"))
    wrench = checkpoint.group(values, "wrench")
    stepper.wrench.restore(wrench["last"], wrench["next"], wrench["driven"])
    if stepper.work.ties:
        stepper.work.ties.restore(**checkpoint.group(values, "ties"))
    if stepper.sleeping:
        stepper.sleeping.restore(checkpoint.group(values, "sleeping"), stepper.work)
