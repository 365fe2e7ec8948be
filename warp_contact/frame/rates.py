"""The rates that limit the step, at the end of a frame, or what is wrong with its state."""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame.diagnosis import flattest_tet, lost_vertex, vertex_name
from warp_contact.frame.spectrum import Spectrum

NO_RATES = np.full((2, 1), np.inf)  # of a state that is lost


def rates_now(
    model: Model, state: State, spectrum: Spectrum, of: np.ndarray | None
) -> tuple[np.ndarray, str]:
    """Rates of the present state [1/s], (2, n_world), and what is wrong with it, or nothing.

    Only the worlds ``of``, a mask, are looked at; None for all.
    """
    lost = lost_vertex(state)
    if lost is not None:
        return NO_RATES, f"{vertex_name(model, lost)} is no longer finite"
    rates = spectrum.rates(state.x, of)
    if not np.isfinite(rates).all():
        tet = flattest_tet(model, state.x)
        return NO_RATES, f"stiffness is no longer finite, the flattest is {tet}"
    return rates, ""
