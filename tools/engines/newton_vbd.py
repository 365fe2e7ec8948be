"""Newton's vertex block descent: implicit Euler, contact at a margin, a penalty inside it.

Knobs: ``steps`` in a frame, ``iterations``, ``contact`` stiffness over E edge, and the ``margin``
over an edge at which contact begins. Its contact knows triangles and edges, and takes all bodies
as one mesh. It is looked for within two margins; between two looks no vertex moves further than
0.85 margins. Its damping sees the rate of F^T F: for a stress 2 beta mu of the strain rate it takes
beta mu / 2, and it has no part for the volume.
"""

import newton
from job import main, mean_edge
from newton_common import Engine, build, stiffness


def make(scene, job: dict, setting: dict) -> Engine:
    """The engine for one setting."""
    edge = mean_edge(scene)
    contact = stiffness(scene, setting["contact"])
    model = build(scene, job["friction"], 0.5, contact, radius=1e-3 * edge)
    margin = setting["margin"] * edge
    solver = newton.solvers.SolverVBD(
        model,
        iterations=setting["iterations"],
        particle_enable_self_contact=len(scene.young) > 1,
        particle_self_contact_margin=margin,
        particle_self_contact_gap=margin,
        particle_enable_tile_solve=False,
    )
    return Engine(scene, job, setting, model, solver)


if __name__ == "__main__":
    main(make)
