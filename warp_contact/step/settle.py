"""Stage 5, impulses: bodies that are strained answer by their present stiffness.

Where no body takes implicit steps nothing of this runs.
"""

import warp as wp

from warp_contact.data.launch import while_any
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.implicit import settle as kernels
from warp_contact.kernels.worlds import FIRST_LOOK
from warp_contact.step import implicit, impulse


def settle(model: Model, state: State, work: Work, keeps: bool = True) -> None:
    """Change ``state.v`` and the impulses until bodies lack little of their answer to them.

    With ``keeps``, the next step makes up for the rest and starts from these impulses.
    """
    w = work.implicit
    wp.launch(kernels.begin, model.n_body, inputs=[], outputs=[w.settling, w.unsettled])
    _find_lacking(model, state, work, keeps)
    while_any(w.unsettled, _pass, model, state, work, keeps)


def _pass(model: Model, state: State, work: Work, keeps: bool) -> None:
    w = work.implicit
    wp.launch(kernels.next_pass, dim=1, inputs=[], outputs=[w.settling, w.unsettled])
    implicit.solve_present(w.deforming, state.x, work)
    inputs = [state.x, w.dv, w.bodies, w.of]
    wp.launch(kernels.add_answer, model.n_vert, inputs=inputs, outputs=[state.v])
    impulse.exchange(model, state.v, work, FIRST_LOOK, keeps, finer=True)
    _find_lacking(model, state, work, keeps)


def _find_lacking(model: Model, state: State, work: Work, keeps: bool) -> None:
    w = work.implicit
    work.worlds.open.zero_()
    implicit.multiply_change(w.deforming, state, w)
    lacking = work.warm.lacking if keeps else w.p
    outputs = [w.settling, work.worlds, lacking, w.r, w.unsettled]
    inputs = [w.bodies, w.total, w.ap, work.ties.attached if work.ties else w.every]
    wp.launch(kernels.find_lacking, model.n_body, inputs=inputs, outputs=outputs)
