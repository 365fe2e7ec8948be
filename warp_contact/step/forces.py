"""Elastic and damping forces of all bodies."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.kernels.motion import motion


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
    ``share`` [-], shape (1,). No mode grows for dt lambda_max(M^-1 C) up to ``reach`` of
    frame/damping.py. Momentum is kept, and vertices with ``inv_mass`` [1/kg] 0 keep their velocity.
    Scratch: ``f_tet`` (4 n_tet,) and two arrays (n_vert,). Nothing is launched without a damped
    body.
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
