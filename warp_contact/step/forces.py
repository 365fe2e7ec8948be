"""Elastic and damping forces of all bodies."""

import math

import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.motion import motion

RATE_MARGIN = 1.1  # on the damping rate, which is estimated and grows within a frame
USED_RANGE = 0.95  # part of the stable range that is used: at its end the stages do not damp
SHARE = 0.5, 7.0 / 9.0  # least and largest: a mode changes sign at a sixth of its speed at most


def internal_forces(model: Model, x: wp.array, mask: wp.array, f_tet: wp.array) -> None:
    """Set ``f_tet`` [N], shape (4 n_tet,), of the tets where ``mask`` is not 0.

    Undamped forces on the corners of each tet at the positions ``x`` [m]. ``motion.gather`` and
    ``motion.predict`` sum them over the tets of a vertex. One launch per material model.
    """
    for e in model.elements:
        wp.launch(
            e.kernels.set_forces,
            dim=e.tet.shape[0],
            inputs=[e.tet, e.param, mask, model.tets, model.pose, model.volume, x],
            outputs=[f_tet],
        )


def apply_stiffness(model: Model, x: wp.array, dx: wp.array, f_tet: wp.array) -> None:
    """Set ``f_tet`` [N] to the corner entries of K(x) dx, K = -df/dx; ``dx`` [m]."""
    for e in model.elements:
        wp.launch(
            e.kernels.apply_stiffness,
            dim=e.tet.shape[0],
            inputs=[e.tet, e.param, model.tets, model.pose, model.volume, x, dx],
            outputs=[f_tet],
        )


def apply_damping(model: Model, x: wp.array, v: wp.array, f_tet: wp.array) -> None:
    """Set ``f_tet`` [N] of the damped models to the corner entries of C(x) v; ``v`` [m/s]."""
    for e in model.elements:
        if e.damped:
            wp.launch(
                e.kernels.apply_damping,
                dim=e.tet.shape[0],
                inputs=[e.tet, e.param, model.tets, model.pose, model.volume, x, v],
                outputs=[f_tet],
            )


def energies(model: Model, x: wp.array, energy: wp.array) -> None:
    """Set ``energy`` [J], shape (n_tet,), to the elastic energy of each tet."""
    for e in model.elements:
        wp.launch(
            e.kernels.energies,
            dim=e.tet.shape[0],
            inputs=[e.tet, e.param, model.tets, model.pose, model.volume, x],
            outputs=[energy],
        )


def damp(
    model: Model,
    x: wp.array,
    v: wp.array,
    inv_mass: wp.array,
    dt: wp.array,
    f_tet: wp.array,
    scratch: tuple[wp.array, wp.array],
    stages: int,
    share: wp.array,
) -> None:
    """Damp ``v`` [m/s] over ``dt`` [s], shape (1,), at fixed positions ``x`` [m].

    Solves M dv/dt = -C(x) v in ``stages`` stages of ``motion.relax``, whose result counts by
    ``share`` [-], shape (1,): no mode grows for dt lambda_max(M^-1 C) up to ``reach``. Momentum is
    kept, vertices with ``inv_mass`` [1/kg] 0 keep their velocity. Scratch:
    ``f_tet`` (4 n_tet,) and two arrays (n_vert,). Without a damped body nothing is launched.
    """
    if stages == 0 or not any(e.damped for e in model.elements):
        return
    if not all(e.damped for e in model.elements):
        f_tet.zero_()
    last, before = v, v
    for j in range(1, stages + 1):
        apply_damping(model, x, last, f_tet)
        out = v if j == stages else scratch[j % 2]
        wp.launch(
            motion.relax,
            dim=model.n_vert,
            inputs=[model.vt_start, model.vt_corner, f_tet, inv_mass, dt, j, stages, share, v],
            outputs=[last, before, out],
        )
        last, before = out, last


def stages_for(rate: float, dt: float) -> int:
    """Return the stages that ``damp`` needs for lambda_max ``rate`` [1/s] and step ``dt`` [s]."""
    z = RATE_MARGIN * rate * dt
    if z <= reach(1, SHARE[1]):
        return 1 if z > 0.0 else 0
    return max(2, math.ceil(0.5 * (math.sqrt(1.0 + 4.0 * z / (USED_RANGE * SHARE[1])) - 1.0)))


def share_for(rate: float, dt: float) -> float:
    """Return the smallest share that is stable then: it reverses fast modes the least."""
    stages = stages_for(rate, dt)
    needed = RATE_MARGIN * rate * dt / reach(stages, 1.0) if stages > 1 else 0.0
    return max(SHARE[0], needed)


def reach(stages: int, share: float) -> float:
    """Largest dt lambda_max of ``stages`` whose result counts by ``share``.

    One stage has p = 1 - z for any share: above 0 for z up to 1.
    """
    return float(stages) if stages < 2 else USED_RANGE * share * (stages * stages + stages)


def longest_step(stages: int, share: float) -> float:
    """Longest stable step times the frequency of a mode, whichever way it is damped.

    (h w)^2 < 2 (1 + p) with the least p of motion/motion.py, as P_s >= -1/2 within ``USED_RANGE``,
    or with p = 0 where that is less.
    """
    return 2.0 if stages == 0 else math.sqrt(2.0 if stages == 1 else min(2.0, 4.0 - 3.0 * share))
