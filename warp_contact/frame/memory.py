"""What a checkpoint needs of a stepper, beside the state."""

from dataclasses import astuple

import numpy as np

from warp_contact.data import damping, warm_start
from warp_contact.data.overflow import Capacity
from warp_contact.data.work import Work
from warp_contact.frame import checkpoint
from warp_contact.frame.buffers import Buffers
from warp_contact.frame.last_frame import LastFrame, last_frame_of
from warp_contact.frame.sleeping import Sleeping
from warp_contact.frame.spectrum import Spectrum


def values_of(
    last: LastFrame, spectrum: Spectrum, work: Work, sleeping: Sleeping | None
) -> dict[str, np.ndarray]:
    """All that the next frame depends on; where a frame that explodes ends, on the room too."""
    groups = {"last": last.values(), "start": spectrum.starts()}
    groups |= {"warm": warm_start.values(work.warm), "damping": damping.values(work.damping)}
    groups["room"] = {"capacity": np.array(astuple(work.capacity))}
    if sleeping:
        groups["sleeping"] = sleeping.values(work)
    return checkpoint.ungroup(groups)


def restore(
    values: dict[str, np.ndarray], spectrum: Spectrum, buffers: Buffers, sleeping: Sleeping | None
) -> LastFrame:
    """Put the ``values`` back; return the numbers of the last frame."""
    spectrum.start_from(checkpoint.group(values, "start"))
    buffers.replace(Capacity(*values["room.capacity"].tolist()))
    warm_start.restore(buffers.work.warm, checkpoint.group(values, "warm"))
    damping.restore(buffers.work.damping, checkpoint.group(values, "damping"))
    if sleeping:
        sleeping.restore(checkpoint.group(values, "sleeping"), buffers.work)
    return last_frame_of(checkpoint.group(values, "last"))
