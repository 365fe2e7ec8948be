"""The steps of a frame as one loop on the device, for any response."""

from collections.abc import Callable
from functools import partial

import warp as wp

from warp_contact.data.launch import while_any
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.motion import motion
from warp_contact.step.damping import remember_contacts
from warp_contact.step.other_responses import step_literal, step_penalty, step_predicted
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.step.step import step


def take_steps(model: Model, state: State, work: Work, damping_stages: int, one: Callable) -> None:
    """Take ``work.steps`` steps by the function ``one``; for a capture."""
    while_any(work.steps, _take_one, model, state, work, damping_stages, one)


def step_of(response: ContactSurface | Penalty | PredictedForce, overlapping: bool) -> Callable:
    """The step of a response; ``overlapping`` where bodies may have overlapped in a world."""
    if isinstance(response, Penalty):
        return partial(step_penalty, response=response)
    if isinstance(response, PredictedForce):
        return step_predicted
    if response.search == "literal":
        return partial(step_literal, iterations=response.iterations)
    return partial(step, iterations=response.iterations if overlapping else 0)


def _take_one(model: Model, state: State, work: Work, damping_stages: int, one: Callable) -> None:
    one(model, state, work, damping_stages)
    if work.damping:
        remember_contacts(model, state, work.damping)
    wp.launch(motion.count_down, dim=1, inputs=[work.overflow.all], outputs=[work.steps])
