"""Scenes for the solvers of Newton, and the frame loop, replayed as a captured graph.

Newton's small-strain Lame parameters and its stable neo-Hookean energy are those of this package.
Both solvers damp tets by one coefficient, each in its own way: see the adapters.
"""

import newton
import numpy as np
import warp as wp
from job import mean_edge

wp.config.log_level = wp.LOG_WARNING


@wp.kernel
def drive(v: wp.array[wp.vec3], dt: float, q: wp.array[wp.vec3]):
    """Move held particles, whose ``v`` [m/s] is not zero, by a step."""
    i = wp.tid()
    q[i] = q[i] + dt * v[i]


def build(scene, friction: float, damping: float, stiffness: float, radius: float) -> newton.Model:
    """A coloured model with the masses of the scene; a mass of zero holds a particle.

    Args:
        scene: arrays of a job
        friction: of planes and particles [-]; the solvers mix both
        damping: coefficient of a tet, over beta mu [-]
        stiffness: of contact [N/m]
        radius: of the particles [m]
    """
    builder = newton.ModelBuilder(gravity=tuple(scene.gravity.tolist()))
    for k in range(len(scene.young)):
        mine = scene.body == k
        first = int(np.flatnonzero(mine)[0])
        mu, lam = scene.lame[k].tolist()
        builder.add_soft_mesh(
            pos=wp.vec3(),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(),
            vertices=[wp.vec3(*p) for p in scene.rest[mine].tolist()],
            indices=(scene.tets[scene.tet_body == k] - first).ravel().tolist(),
            density=float(scene.density[k]),
            k_mu=mu,
            k_lambda=lam,
            k_damp=damping * float(scene.damping[k]) * mu,
            particle_radius=radius,
        )
    builder.particle_mass = np.where(scene.fixed, 0.0, scene.mass).tolist()
    config = newton.ModelBuilder.ShapeConfig(ke=stiffness, kd=0.0, mu=friction)
    for *n, h in scene.planes.tolist():
        builder.add_shape_plane(plane=(*n, -h), width=0.0, length=0.0, cfg=config)
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd = stiffness, 0.0
    model.soft_contact_mu = model.particle_mu = friction
    return model


class Engine:
    """Steps a model with a solver."""

    def __init__(self, scene, job: dict, setting: dict, model: newton.Model, solver):
        """Lay out the states; ``solver`` steps from the one to the other."""
        self.model, self.solver = model, solver
        self.steps = setting["steps"]
        self.dt = 1.0 / (job["fps"] * self.steps)
        self.now, self.then = model.state(), model.state()
        held = np.where(scene.fixed[:, None], scene.v, 0.0).astype(np.float32)
        for state in (self.now, self.then):
            state.particle_q.assign(scene.x.astype(np.float32))
            state.particle_qd.assign((scene.v - held).astype(np.float32))
        self.held = wp.array(held, dtype=wp.vec3, device="cpu")
        self.control = model.control()
        self.pipeline = newton.CollisionPipeline(model)
        self.contacts = self.pipeline.contacts()
        self.graph = None

    def step_frame(self) -> None:
        """One frame; the first is stepped as it is and captured for the others."""
        if self.graph is None:
            self._steps()
            with wp.ScopedCapture(device="cpu") as capture:
                self._steps()
            self.graph = capture.graph
        else:
            wp.capture_launch(self.graph)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s]."""
        return self.now.particle_q.numpy().copy(), self.now.particle_qd.numpy().copy()

    def halt(self) -> None:
        """Held particles stand still from now on."""
        self.held.zero_()

    def _steps(self) -> None:
        a, b = self.now, self.then
        for _ in range(self.steps):
            a.clear_forces()
            inputs = [self.held, self.dt]
            wp.launch(drive, dim=self.model.particle_count, inputs=inputs, outputs=[a.particle_q])
            self.pipeline.collide(a, self.contacts)
            self.solver.step(a, b, self.control, self.contacts, self.dt)
            a, b = b, a
        if a is not self.now:  # an odd number of steps
            wp.copy(self.now.particle_q, a.particle_q)
            wp.copy(self.now.particle_qd, a.particle_qd)


def stiffness(scene, times: float) -> float:
    """Of contact [N/m]: ``times`` the smallest modulus and an edge of the finest body."""
    return times * float(scene.young.min()) * mean_edge(scene)
