"""Contact surfaces as a solver of Newton: the force between two soft bodies, which it lacks.

It takes the extra ``newton``. ``python -m warp_contact.scenes.examples.in_newton``
"""

import newton
import numpy as np
import warp as wp

from warp_contact.newton import SolverContactSurface

EDGE, CELLS = 0.1, 3  # of a block [m]
FPS = 60


def build() -> newton.Model:
    """Two blocks of tets, one upon the other, on the ground."""
    builder = newton.ModelBuilder()
    builder.add_ground_plane()
    for height in 0.001, EDGE + 0.002:
        builder.add_soft_grid(
            pos=wp.vec3(0.0, 0.0, height),
            rot=wp.quat_identity(),
            vel=wp.vec3(0.0, 0.0, 0.0),
            **{f"dim_{axis}": CELLS for axis in "xyz"},
            **{f"cell_{axis}": EDGE / CELLS for axis in "xyz"},
            density=1000.0,
            k_mu=4e4,
            k_lambda=6e4,
            k_damp=200.0,
        )
    return builder.finalize()


def main(frames: int = 60) -> tuple[np.ndarray, float]:
    """Contact force on each block [N], shape (2, 3), and its weight: the ground carries both."""
    model = build()
    solver = SolverContactSurface(model)  # in place of newton.solvers.SolverVBD(model)
    seen = solver.observables({"particle_contact_f"})
    now, then = model.state(), model.state()
    for _ in range(frames):
        solver.step(now, then, None, None, 1.0 / FPS, observables=seen)
        now, then = then, now
    force = seen.particle_contact_f.numpy().reshape(2, -1, 3).sum(axis=1)
    weight = 0.5 * float(model.particle_mass.numpy().sum()) * 9.81
    print("on the lower and the upper block", force.round(3), f"N; the weight: {weight:.3f} N")
    return force, weight


if __name__ == "__main__":
    main()
