"""MuJoCo's flex bodies: stable neo-Hookean tets, soft contact by regularised constraints.

Knobs: ``steps`` in a frame, most ``iterations`` of the solver, ``time_constant`` of contact over a
step (2 is the stiffest that MuJoCo allows), and the ``radius`` of a vertex over an edge: surfaces
meet where they are two of them apart. Its friction, gravity, masses and stiffness-proportional
damping are those of the scene; its energy is that of this package to the last digits. Held vertices
of a body that move, all at one velocity, ride on rails; vertex masses are overwritten with the
lumped ones.
"""

import mujoco
import numpy as np
from job import main

RAILS = "".join(f'<joint type="slide" axis="{a}"/>' for a in ("1 0 0", "0 1 0", "0 0 1"))
RAILS += '<inertial pos="0 0 0" mass="1e6" diaginertia="1 1 1"/>'
NEO_HOOKEAN = 1  # a material for which its XML has no word


class Engine:
    """Steps a model."""

    def __init__(self, scene, setting: dict):
        """Lay out the model and its start."""
        self.substeps = setting["steps"]
        held = np.where(scene.fixed[:, None], scene.v, 0.0)
        moved = [held[part][np.abs(held[part]).sum(axis=1).argmax()] for part in scene.parts]
        spec = mujoco.MjSpec.from_string(xml(scene, setting, moved))
        for flex in spec.flexes:
            flex.elastic3d = NEO_HOOKEAN
        self.model = m = spec.compile()
        self.data = d = mujoco.MjData(m)
        self.loose = np.flatnonzero(~scene.fixed)
        free = m.flex_vertbodyid[self.loose]
        m.body_mass[free] = scene.mass[self.loose]
        m.body_inertia[free] = 1e-6 * scene.mass[self.loose, None]
        mujoco.mj_setConst(m, d)
        self.dof = m.body_dofadr[free][:, None] + np.arange(3)
        place = m.jnt_qposadr[m.body_jntadr[free]][:, None] + np.arange(3)
        d.qpos[place] = (scene.x - scene.rest)[self.loose]
        d.qvel[self.dof] = scene.v[self.loose]
        self.rails = [
            (m.body(f"body{k}").dofadr[0] + np.arange(3), v) for k, v in enumerate(moved) if v.any()
        ]
        mujoco.mj_forward(m, d)

    def step_frame(self) -> None:
        """One frame."""
        for _ in range(self.substeps):
            for dof, v in self.rails:
                self.data.qvel[dof] = v
            mujoco.mj_step(self.model, self.data)

    def positions(self) -> np.ndarray:
        """Of all vertices [m]."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_flex(self.model, self.data)
        return self.data.flexvert_xpos.copy()

    def velocities(self) -> np.ndarray:
        """Of all vertices [m/s]; zero where they are held."""
        v = np.zeros_like(self.data.flexvert_xpos)
        v[self.loose] = self.data.qvel[self.dof]
        return v

    def halt(self) -> None:
        """What is on rails stands still from now on."""
        self.rails = [(dof, 0.0 * v) for dof, v in self.rails]


def xml(scene, setting: dict, moved: list[np.ndarray]) -> str:
    """The model in MuJoCo's language; bodies whose held vertices are ``moved`` ride on rails."""
    dt, mu = 1.0 / (scene.fps * setting["steps"]), scene.friction
    touch = f'friction="{max(mu, 1e-5):g} 0 0" condim="{3 if mu else 1}" '
    touch += f'solref="{setting["time_constant"] * dt:.9g} 1"'
    parts = [
        f'<geom type="plane" size="0 0 1" zaxis="{_row(n)}" pos="{_row(np.array(n) * h)}" {touch}/>'
        for n, h in scene.planes
    ]
    for k, (body, part, v) in enumerate(zip(scene.bodies, scene.parts, moved, strict=True)):
        held = np.flatnonzero(scene.fixed[part])
        parts.append(
            f'<body name="body{k}" gravcomp="{int(v.any())}">{RAILS if v.any() else ""}'
            f'<flexcomp name="flex{k}" type="direct" dim="3" mass="{scene.mass[part].sum()}" '
            f'radius="{setting["radius"] * scene.edge}" point="{_row(scene.rest[part].ravel())}" '
            f'element="{_row(body.tets.ravel())}"><elasticity young="{body.youngs_modulus}" '
            f'poisson="{body.poisson_ratio}" damping="{body.damping}"/>'
            f'<contact selfcollide="none" {touch}/>'
            + (f'<pin id="{_row(held)}"/>' if len(held) else "")
            + "</flexcomp></body>"
        )
    return (
        f'<mujoco><option timestep="{dt:.12g}" integrator="discrete" '
        f'gravity="{_row(scene.gravity)}" iterations="{setting["iterations"]}"/><size memory="1G"/>'
        f"<worldbody>{''.join(parts)}</worldbody></mujoco>"
    )


def _row(values) -> str:
    return " ".join(f"{x:.12g}" for x in values)


if __name__ == "__main__":
    main(Engine)
