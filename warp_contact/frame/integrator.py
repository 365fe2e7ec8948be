"""Whether a scene takes explicit or implicit steps.

An explicit step has to be shorter than the fastest vibration of the stiffest tet, an implicit one
not. It costs more, damps vibrations that it does not resolve, and needs the inverse of a matrix for
each shape.
"""

from dataclasses import dataclass

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame import step_bounds
from warp_contact.frame.spectrum import Spectrum
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce

KINDS = "explicit", "implicit", "auto"
LARGEST = 800  # vertices of a body: its inverse takes 26 MB and seconds to find
DEARER = 3.0  # time of an implicit step, in explicit ones, of bodies of few vertices
DENSE = 15.0  # vertices of a body that add as much as an explicit step: an inverse is dense


@dataclass(frozen=True)
class Integrator:
    """What a simulation takes, and why.

    Attributes:
        implicit: whether steps are implicit
        why: the reason, for the user
    """

    implicit: bool
    why: str

    @property
    def name(self) -> str:
        """The word for it."""
        return "implicit" if self.implicit else "explicit"


def choose(
    wanted: str,
    model: Model,
    state: State,
    response: ContactSurface | Penalty | PredictedForce,
) -> Integrator:
    """The integrator that the user ``wanted``, or the cheaper one for ``auto``.

    Raises:
        ValueError: the scene takes no implicit steps
    """
    obstacle = _obstacle(model, response)
    rigid = _rigid(model)
    if rigid:
        if obstacle:
            raise ValueError(f"body '{rigid}' is rigid and takes implicit steps: {obstacle}")
        return Integrator(True, f"body '{rigid}' is rigid")
    if wanted == "explicit":
        return Integrator(False, "the default")
    if wanted == "implicit":
        if obstacle:
            raise ValueError(f"integrator='implicit' is not possible: {obstacle}")
        return Integrator(True, "as asked for")
    if not isinstance(response, ContactSurface):
        obstacle = "their number follows from the response"
    if obstacle:
        return Integrator(False, obstacle)
    spectrum = Spectrum(model)
    per_second = float(spectrum.rates(state.x)[0].max()) / (2.0 * step_bounds.SAFETY)
    stiffest = model.labels[int(spectrum.of_bodies[0].argmax())]
    n = np.diff(model.body_vert.numpy())[_mobile(model)].astype(float)
    dear = (DEARER + np.average(n, weights=n) / DENSE) * step_bounds.RESOLVED if len(n) else np.inf
    why = f"body '{stiffest}' would need {per_second:.0f} explicit steps a second"
    return Integrator(per_second > dear, f"{why}, as dear as implicit ones from {dear:.0f} on")


def _rigid(model: Model) -> str | None:
    """A rigid body that can move, or None."""
    return next((name for name, s in zip(model.labels, model.solids, strict=True) if s), None)


def _mobile(model: Model) -> np.ndarray:
    """Bodies of which not all vertices are fixed, shape (n_body,)."""
    return np.maximum.reduceat(model.inv_mass.numpy(), model.body_vert.numpy()[:-1]) > 0.0


def _obstacle(model: Model, response) -> str:
    """Why implicit steps are not possible; empty if they are."""
    if isinstance(response, ContactSurface) and response.search == "literal":
        return "the literal search moves vertex by vertex; take another response"
    for body in np.flatnonzero(_mobile(model)):
        n = int(np.diff(model.body_vert.numpy())[body])
        if model.materials[body].kernels is not None and n > LARGEST:
            name = f"body '{model.labels[body]}'"
            return f"{name} has {n} vertices, more than {LARGEST}: use a coarser mesh"
    return ""
