"""Newton's solvers: vertex block descent, and extended position-based dynamics.

Knobs of both: ``steps`` in a frame and ``iterations``. Its small-strain Lame parameters and its
stable neo-Hookean energy are those of this package.

``vbd``: implicit Euler, contact at a margin, a penalty inside it. Knobs: ``contact`` stiffness over
E edge, and the ``margin`` over an edge at which contact begins. Its contact knows triangles and
edges, and takes all bodies as one mesh. It is looked for within two margins; between two looks no
vertex moves further than 0.85 margins. Its lists of pairs, of which it drops the
rest without a word, are four times as long as by default. Its damping sees the rate of F^T F: for a
stress 2 beta mu of the strain rate it takes beta mu / 2, and it has no part for the volume.

``xpbd``: constraints of tets, relaxed all at once. Knobs: ``relaxation`` and ``radius``. Between
soft bodies its contact knows particles only: balls about the vertices, of a radius over a mean edge
of the finest body. Two of one body that are closer than two radii push each other apart at rest,
too: in cells of ``box`` from 0.44 on, in sheets one layer thick always. Its damping of a constraint
is the coefficient over the modulus: that of the shape is beta as in the scene, that of the volume
beta mu / lambda. Its constraints tr(F^T F) - 3 and det F - 1 both see no more than the change of
volume at small strains; forces are read as those of the law that the scene asks for.
"""

import sys

import newton
import numpy as np
import warp as wp
from job import main

wp.config.log_level = wp.LOG_WARNING

POINT = 1e-3  # radius of a particle over a mean edge, where the radius is no knob


@wp.kernel
def drive(v: wp.array[wp.vec3], dt: float, q: wp.array[wp.vec3]):
    """Move held particles, whose ``v`` [m/s] is not zero, by a step."""
    i = wp.tid()
    q[i] = q[i] + dt * v[i]


def vbd(scene, setting: dict) -> "Engine":
    """The engine with vertex block descent."""
    model = build(scene, 0.5, setting["contact"], POINT * scene.edge)
    solver = newton.solvers.SolverVBD(
        model,
        iterations=setting["iterations"],
        particle_enable_self_contact=len(scene.bodies) > 1,
        particle_self_contact_margin=setting["margin"] * scene.edge,
        particle_self_contact_gap=setting["margin"] * scene.edge,
        particle_enable_tile_solve=False,
        particle_vertex_contact_buffer_size=128,
        particle_edge_contact_buffer_size=256,
    )
    return Engine(scene, setting, model, solver)


def xpbd(scene, setting: dict) -> "Engine":
    """The engine with extended position-based dynamics."""
    if min(body.lame[1] for body in scene.bodies) <= 0.0:
        raise NotImplementedError("its tets have no forces where the second Lame parameter is zero")
    radius = (POINT if len(scene.bodies) == 1 else setting["radius"]) * scene.edge
    model = build(scene, 1.0, 1.0, radius)
    relaxation = {f"soft_{part}_relaxation": setting["relaxation"] for part in ("body", "contact")}
    solver = newton.solvers.SolverXPBD(model, iterations=setting["iterations"], **relaxation)
    return Engine(scene, setting, model, solver)


def build(scene, damping: float, contact: float, radius: float) -> newton.Model:
    """A coloured model with the masses of the scene; a mass of zero holds a particle.

    The damping of a tet is over beta mu, the stiffness of contact over the smallest modulus and an
    edge of the finest body; the radius [m] is that of the particles.
    """
    builder = newton.ModelBuilder(gravity=scene.gravity)
    place = {"pos": wp.vec3(), "rot": wp.quat_identity(), "scale": 1.0, "vel": wp.vec3()}
    for body, part in zip(scene.bodies, scene.parts, strict=True):
        mu, lam = body.lame
        builder.add_soft_mesh(
            vertices=[wp.vec3(*p) for p in scene.rest[part].tolist()],
            indices=body.tets.ravel().tolist(),
            density=body.density,
            k_mu=mu,
            k_lambda=lam,
            k_damp=damping * body.damping * mu,
            particle_radius=radius,
            **place,
        )
    builder.particle_mass = np.where(scene.fixed, 0.0, scene.mass).tolist()
    stiffness = contact * min(body.youngs_modulus for body in scene.bodies) * scene.edge
    config = newton.ModelBuilder.ShapeConfig(ke=stiffness, kd=0.0, mu=scene.friction)
    for n, h in scene.planes:
        builder.add_shape_plane(plane=(*n, -h), width=0.0, length=0.0, cfg=config)
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd = stiffness, 0.0
    # The solvers mix that of planes and that of particles.
    model.soft_contact_mu = model.particle_mu = scene.friction
    return model


class Engine:
    """Steps a model with a solver, frame by frame as a captured graph."""

    def __init__(self, scene, setting: dict, model: newton.Model, solver):
        """Lay out the states; ``solver`` steps from the one to the other."""
        self.model, self.solver = model, solver
        self.substeps = setting["steps"]
        self.dt = 1.0 / (scene.fps * self.substeps)
        self.now, self.then = model.state(), model.state()
        held = np.where(scene.fixed[:, None], scene.v, 0.0).astype(np.float32)
        for state in (self.now, self.then):
            state.particle_q.assign(scene.x.astype(np.float32))
            state.particle_qd.assign((scene.v - held).astype(np.float32))
        self.held = wp.array(held, dtype=wp.vec3, device="cpu")
        self.control, self.pipeline = model.control(), newton.CollisionPipeline(model)
        self.contacts, self.graph = self.pipeline.contacts(), None

    def step_frame(self) -> None:
        """One frame; the first is stepped as it is and captured for the others."""
        if self.graph is not None:
            wp.capture_launch(self.graph)
            return
        self._steps()
        with wp.ScopedCapture(device="cpu") as capture:
            self._steps()
        self.graph = capture.graph

    def positions(self) -> np.ndarray:
        """Of all particles [m]."""
        return self.now.particle_q.numpy().astype(float)

    def velocities(self) -> np.ndarray:
        """Of all particles [m/s]."""
        return self.now.particle_qd.numpy().astype(float)

    def halt(self) -> None:
        """Held particles stand still from now on."""
        self.held.zero_()

    def _steps(self) -> None:
        a, b = self.now, self.then
        for _ in range(self.substeps):
            a.clear_forces()
            inputs = [self.held, self.dt]
            wp.launch(drive, dim=self.model.particle_count, inputs=inputs, outputs=[a.particle_q])
            self.pipeline.collide(a, self.contacts)
            self.solver.step(a, b, self.control, self.contacts, self.dt)
            a, b = b, a
        if a is not self.now:  # an odd number of steps
            wp.copy(self.now.particle_q, a.particle_q)
            wp.copy(self.now.particle_qd, a.particle_qd)


if __name__ == "__main__":
    main({"Newton VBD": vbd, "Newton XPBD": xpbd}[sys.argv[1]])
