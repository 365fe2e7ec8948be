"""What the solver tells beside the state: observables of Newton."""

from dataclasses import dataclass

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverBase

from warp_contact import Simulation
from warp_contact.newton.layout import Layout

FIELDS = {
    "particle_contact_f": "force",
    "particle_pressure": "pressure",
    "particle_penetration": "penetration",
}
SUPPORTED = frozenset({*FIELDS, "body_qdd"})


def field(dtype):
    """An observable of each particle."""
    every = newton.Model.AttributeFrequency.PARTICLE
    return SolverBase.Observables.field(dtype=dtype, frequency=every)


class ObservableKind(SolverBase.ObservableKind):
    """Of each particle, beside those of Newton."""

    PARTICLE_CONTACT_F = "particle_contact_f"
    PARTICLE_PRESSURE = "particle_pressure"
    PARTICLE_PENETRATION = "particle_penetration"


@dataclass(eq=False)
class Observables(SolverBase.Observables):
    """What contact did to each particle, soft against soft too.

    Of those of Newton there is ``body_qdd``, the mean of the step; 0 of a body that is driven.

    Attributes:
        particle_contact_f: mean contact force of the step [N], shape (particle_count,)
        particle_pressure: the same over the area of the surface there [Pa]
        particle_penetration: how deep it was inside another body before it was put right [m]
    """

    # They return fields, not defaults that are shared.
    particle_contact_f: wp.array | None = field(wp.vec3)  # noqa: RUF009
    particle_pressure: wp.array | None = field(wp.float32)  # noqa: RUF009
    particle_penetration: wp.array | None = field(wp.float32)  # noqa: RUF009


def observe(sim: Simulation, layout: Layout, gained: np.ndarray, observables: Observables) -> None:
    """Write what was asked for.

    Args:
        sim: after the step
        layout: of its scene
        gained: mean accelerations of the bodies of the model [m/s^2], [rad/s^2], shape (n, 6)
        observables: with their arrays
    """
    if observables.is_requested("body_qdd"):
        observables.body_qdd.assign(gained.astype(np.float32))
    asked = {kind: name for kind, name in FIELDS.items() if observables.is_requested(kind)}
    fields = sim.contact_fields() if asked else {}
    for kind, name in asked.items():
        array = getattr(observables, kind)
        out = np.zeros((array.shape[0], *fields[name].shape[1:]), np.float32)
        for soft in layout.soft:
            out[soft.particles] = fields[name][soft.vertices]
        array.assign(out)
