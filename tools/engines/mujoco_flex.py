"""MuJoCo's flex bodies: St. Venant-Kirchhoff tets, soft contact by regularised constraints.

Knobs: ``steps`` in a frame, most ``iterations`` of the solver, ``time_constant`` of contact over a
step (2 is the stiffest that MuJoCo allows), and the ``radius`` of a vertex over an edge: surfaces
meet where they are two of them apart. Its friction, gravity, masses and stiffness-proportional
damping are those of the scene. Held vertices that move ride on a body on rails; vertex masses are
overwritten with the lumped ones.
"""

import mujoco
import numpy as np
from job import CannotDo, main, mean_edge

RAILS = "".join(f'<joint type="slide" axis="{a}"/>' for a in ("1 0 0", "0 1 0", "0 0 1"))
RAILS += '<inertial pos="0 0 0" mass="1e6" diaginertia="1 1 1"/>'


class Engine:
    """Steps a model."""

    def __init__(self, scene, job: dict, setting: dict):
        """Lay out the model and its start."""
        self.steps = setting["steps"]
        dt = 1.0 / (job["fps"] * self.steps)
        self.model = m = mujoco.MjModel.from_xml_string(xml(scene, job, setting, dt))
        self.data = d = mujoco.MjData(m)
        owner = m.flex_vertbodyid
        if len(owner) != len(scene.x):
            raise CannotDo(f"flex has {len(owner)} vertices, the scene {len(scene.x)}")
        self.loose = np.flatnonzero(~scene.fixed)
        free = owner[self.loose]
        m.body_mass[free] = scene.mass[self.loose]
        m.body_inertia[free] = 1e-6 * scene.mass[self.loose, None]
        mujoco.mj_setConst(m, d)
        self.dof = m.body_dofadr[free][:, None] + np.arange(3)
        place = m.jnt_qposadr[m.body_jntadr[free]][:, None] + np.arange(3)
        d.qpos[place] = (scene.x - scene.rest)[self.loose]
        d.qvel[self.dof] = scene.v[self.loose]
        self.rails = []
        for k in range(m.nbody):
            if m.body(k).name.startswith("held"):
                held = scene.fixed & (scene.body == int(m.body(k).name[4:]))
                self.rails.append((m.body_dofadr[k] + np.arange(3), scene.v[held][0].copy()))
        mujoco.mj_forward(m, d)

    def step_frame(self) -> None:
        """One frame."""
        for _ in range(self.steps):
            for dof, v in self.rails:
                self.data.qvel[dof] = v
            mujoco.mj_step(self.model, self.data)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s]."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_flex(self.model, self.data)
        v = np.zeros_like(self.data.flexvert_xpos)
        v[self.loose] = self.data.qvel[self.dof]
        return self.data.flexvert_xpos.copy(), v

    def halt(self) -> None:
        """What is on rails stands still from now on."""
        self.rails = [(dof, 0.0 * v) for dof, v in self.rails]


def xml(scene, job: dict, setting: dict, dt: float) -> str:
    """The model in MuJoCo's language."""
    mu = job["friction"]
    touch = f'friction="{max(mu, 1e-5):g} 0 0" condim="{3 if mu else 1}" '
    touch += f'solref="{setting["time_constant"] * dt:.9g} 1"'
    parts = [
        f'<geom type="plane" size="0 0 1" zaxis="{_row(n)}" pos="{_row(np.array(n) * h)}" {touch}/>'
        for *n, h in scene.planes.tolist()
    ]
    radius = setting["radius"] * mean_edge(scene)
    for k in range(len(scene.young)):
        mine = np.flatnonzero(scene.body == k)
        held = np.flatnonzero(scene.fixed[mine])
        moving = len(held) and np.abs(scene.v[mine][held]).max() > 0.0
        if moving and np.ptp(scene.v[mine][held], axis=0).max() > 1e-12:
            raise CannotDo("held vertices of one body with several velocities")
        pin = f'<pin id="{" ".join(map(str, held))}"/>' if len(held) else ""
        rails = RAILS if moving else ""
        parts.append(
            f'<body name="{"held" if moving else "body"}{k}" gravcomp="{int(moving)}">{rails}'
            f'<flexcomp name="flex{k}" type="direct" dim="3" mass="{scene.mass[mine].sum()}" '
            f'radius="{radius}" point="{_row(scene.rest[mine].ravel())}" '
            f'element="{" ".join(map(str, (scene.tets[scene.tet_body == k] - mine[0]).ravel()))}">'
            f'<elasticity young="{scene.young[k]}" poisson="{scene.poisson[k]}" '
            f'damping="{scene.damping[k]}"/><contact selfcollide="none" {touch}/>{pin}'
            "</flexcomp></body>"
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
