"""Elastic and damping forces of all bodies."""

import warp as wp

from warp_contact.data.model import Model


def internal_forces(model: Model, x: wp.array, mask: wp.array, f_tet: wp.array) -> None:
    """Set ``f_tet`` [N], shape (4 n_tet,), of the tets where ``mask`` is not 0.

    Undamped forces on the corners of each tet at the positions ``x`` [m]. ``motion.kick`` and
    ``predict.sum_forces`` sum them over the tets of a vertex. One launch per material model.
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
