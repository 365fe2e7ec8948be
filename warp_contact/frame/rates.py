"""The rates that limit the step, at the end of a frame, and what is wrong with its state."""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame.diagnosis import finite_vertices, flattest_tet, vertex_name
from warp_contact.frame.spectrum import Spectrum


def rates_now(
    model: Model, state: State, spectrum: Spectrum, of: np.ndarray | None
) -> tuple[np.ndarray, str]:
    """Rates of the present state [1/s], (2, n_world), and what is wrong with it, or nothing.

    Only the worlds ``of``, a mask, are looked at; None for all. Those that are lost have infinite
    rates.
    """
    worlds, finite, wrong = spectrum.worlds, finite_vertices(state), ""
    lost = np.bincount(worlds.of_vert, ~finite, worlds.n) > 0
    if lost.any():
        wrong = f"{vertex_name(model, int(finite.argmin()))} is no longer finite"
    if lost.all():
        return np.full((2, worlds.n), np.inf), wrong
    rates = spectrum.rates(state.x, ~lost if of is None else of & ~lost)
    if not wrong and not np.isfinite(rates).all():
        tet = flattest_tet(model, state.x)
        wrong = f"stiffness is no longer finite, the flattest is {tet}"
    return np.where(lost, np.inf, rates), wrong
