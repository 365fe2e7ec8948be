"""Whether a scene takes explicit or implicit steps.

An explicit step has to be shorter than the fastest vibration of the stiffest tet, an implicit one
not. It costs more, damps vibrations that it does not resolve, and needs the inverse of a matrix for
each shape. It gets shorter where bodies are fast: the choice reckons with their speed at the start
and with a fall through their world. Where steps are implicit, bodies too large for that take
explicit ones beside the others: their frequency then sets how many steps their world takes.
"""

from dataclasses import dataclass

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame import implicit_shapes, step_bounds
from warp_contact.frame.implicit_shapes import mobile, too_large
from warp_contact.frame.spectrum import Spectrum
from warp_contact.frame.worlds import WorldIds
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce

KINDS = "explicit", "implicit", "auto"
DEARER = 3.0  # time of an implicit step, in explicit ones, of bodies of few vertices
DENSE = 15.0  # vertices of a body that add as much as an explicit step: an inverse is dense
BESIDE = 1.2  # the same of bodies that take explicit ones beside them: their number is rounded up
DEFAULT = "the default"
REMEDY = "take integrator='implicit'"
NAMED = 3  # bodies that a summary names


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
    bounces = model.restitution.numpy().any()
    if bounces:
        refuse_restitution(response)
    if rigid:
        if obstacle:
            raise ValueError(f"body '{rigid}' is rigid and takes implicit steps: {obstacle}")
        return Integrator(True, f"body '{rigid}' is rigid{_beside(model)}")
    if model.ties or bounces:
        name = f"attachment '{model.ties.labels[0]}'" if model.ties else "restitution"
        if obstacle or wanted == "explicit":
            raise ValueError(f"{name} needs implicit steps: {obstacle or REMEDY}")
        return Integrator(True, f"{name} needs them{_beside(model)}")
    if wanted == "explicit":
        return Integrator(False, DEFAULT)
    if wanted == "implicit":
        if obstacle:
            raise ValueError(f"integrator='implicit' is not possible: {obstacle}")
        return Integrator(True, f"as asked for{_beside(model)}")
    if not isinstance(response, ContactSurface):
        obstacle = "their number follows from the response"
    if obstacle:
        return Integrator(False, obstacle)
    return _cheaper(model, state)


def reason(chosen: Integrator, model: Model, state: State) -> str:
    """Why it was chosen; of the default also what it costs, in the present shapes."""
    if chosen.why != DEFAULT:
        return chosen.why
    return f"{DEFAULT}; {_asks(model, _of_bodies(model, state)[0])}"


def refuse_restitution(response, implicit: bool = True) -> None:
    """Raise ValueError where a response, or explicit steps, take no restitution."""
    if not isinstance(response, ContactSurface):
        raise ValueError(f"restitution needs wc.ContactSurface(), and {response} is given")
    if not implicit:
        raise ValueError(f"restitution needs implicit steps: {REMEDY}")


def _cheaper(model: Model, state: State) -> Integrator:
    """The kind of steps that takes less time."""
    of_bodies, speed = _of_bodies(model, state)
    large = too_large(model)
    n, dear = np.where(mobile(model), np.diff(model.body_vert.numpy()), 0), np.inf
    if n.any():
        passing = speed[n > 0] / (step_bounds.STRIDE * model.body_thickness.numpy()[n > 0])
        taken = max(step_bounds.RESOLVED, passing.max(), of_bodies[large].max(initial=0.0))
        dear = np.average(np.where(large, BESIDE, DEARER + n / DENSE), weights=n) * taken
    implicit = of_bodies.max() > dear
    why = f"{_asks(model, of_bodies)}, as dear as implicit ones from {dear:.0f} on"
    return Integrator(implicit, why + _beside(model) if implicit else why)


def _of_bodies(model: Model, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Explicit steps a second that each body asks for, and its speed [m/s], (n_body,)."""
    spectrum = Spectrum(model)
    spectrum.rates(state.x)
    speed = _speeds(model, state)
    stable = spectrum.of_bodies[0] / (2.0 * step_bounds.SAFETY)
    return np.maximum(stable, speed / (step_bounds.REACH * model.body_thickness.numpy())), speed


def _asks(model: Model, of_bodies: np.ndarray) -> str:
    """Which body asks for most explicit steps."""
    thing = model.labels[int(of_bodies.argmax())]
    return f"body '{thing}' asks for {of_bodies.max():.0f} explicit steps a second"


def _speeds(model: Model, state: State) -> np.ndarray:
    """Speed against each body that its world may come to [m/s], (n_body,): at the start, by a fall.

    The fall is one through the height of the world, down to its floor. A body that is alone is
    passed by nothing, and passes no floor.
    """
    x, v = state.x.numpy().astype(np.float64), state.v.numpy().astype(np.float64)
    g, worlds = model.g.numpy()[0].astype(np.float64), WorldIds(model)
    down = g / max(float(np.linalg.norm(g)), 1e-30)
    along = np.column_stack([v, x @ down])
    most, least = np.full((2, worlds.n, 4), -np.inf)
    np.maximum.at(most, worlds.of_vert, along)
    np.maximum.at(least, worlds.of_vert, -along)
    for n, h in zip(model.plane_n.numpy(), model.plane_h.numpy(), strict=True):
        if n @ down < 0.0:
            floor = along[:, 3] - (x @ n - h) / (n @ down)
            np.maximum.at(most[:, 3], worlds.of_vert, floor)
    extent = most + least
    speed = np.linalg.norm(extent[:, :3], axis=1) + np.sqrt(2.0 * (g @ down) * extent[:, 3])
    alone = np.bincount(worlds.of_body) == 1
    return np.where(alone, 0.0, speed)[worlds.of_body]


def _rigid(model: Model) -> str | None:
    """A rigid body that can move, or None."""
    return next((name for name, s in zip(model.labels, model.solids, strict=True) if s), None)


def _beside(model: Model) -> str:
    """Which bodies take explicit steps beside implicit ones, and why; empty if none does."""
    names = [f"'{model.labels[b]}'" for b in np.flatnonzero(too_large(model))]
    if not names:
        return ""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    one = len(names) == 1
    which = f"body {names[0]} takes" if one else f"bodies {', '.join(names[:NAMED])}{more} take"
    return f"; {which} explicit ones, having more than {implicit_shapes.LARGEST} vertices"


def _obstacle(model: Model, response) -> str:
    """Why implicit steps are not possible; empty if they are."""
    if isinstance(response, ContactSurface) and response.search == "literal":
        return "the literal search moves vertex by vertex; take another response"
    large = too_large(model)
    if large.any() and (large == mobile(model)).all():
        body = int(large.argmax())
        n = int(np.diff(model.body_vert.numpy())[body])
        name = f"body '{model.labels[body]}'"
        return f"{name} has {n} vertices, more than {implicit_shapes.LARGEST}: use a coarser mesh"
    return ""
