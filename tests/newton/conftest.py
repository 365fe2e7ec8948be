"""Models of Newton with a block of tets, and their runs; Newton is imported where it is needed."""

import numpy as np
import pytest
import warp as wp

DT = 1.0 / 240.0
SIZE, CELLS = 0.1, 2  # of a block [m]
DENSITY = 1000.0
GRID = {"dim_x": CELLS, "dim_y": CELLS, "dim_z": CELLS, "density": DENSITY}
GRID |= {f"cell_{axis}": SIZE / CELLS for axis in "xyz"}
GRID |= {"k_mu": 5e4, "k_lambda": 1e5, "k_damp": 200.0}


def _add_block(builder, at, velocity=(0.0, 0.0, 0.0), **more) -> None:
    builder.add_soft_grid(
        pos=wp.vec3(*at), rot=wp.quat_identity(), vel=wp.vec3(*velocity), **(GRID | more)
    )


class _Run:
    """A model with a solver, one state after the other."""

    def __init__(self, builder, device, **settings):
        from warp_contact.newton import SolverContactSurface

        self.model = builder.finalize(device=device)
        self.solver = SolverContactSurface(self.model, **settings)
        self.now, self.then = self.model.state(), self.model.state()
        self.seen = self.solver.observables(self.solver.supported_observables)
        self.control = None

    def step(self, n: int = 1, dt: float = DT) -> None:
        for _ in range(n):
            self.solver.step(self.now, self.then, self.control, None, dt, observables=self.seen)
            self.now, self.then = self.then, self.now

    @property
    def x(self) -> np.ndarray:
        return self.now.particle_q.numpy().copy()

    @property
    def force(self) -> np.ndarray:
        return self.seen.particle_contact_f.numpy().astype(float)


@pytest.fixture
def add_block():
    """Adds one of 0.1 m, ``add_block(builder, at, velocity, **others of add_soft_grid)``."""
    return _add_block


@pytest.fixture
def run_of():
    """A model with a solver, ``run_of(builder, device)``: ``step(n, dt)``, ``now``, ``x``."""
    return _Run
