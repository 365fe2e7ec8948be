"""Newton's extended position-based dynamics: constraints of tets, relaxed all at once.

Knobs: ``steps`` in a frame, ``iterations`` and ``relaxation``. Between soft bodies its
contact knows particles only: balls of a radius about the vertices, here ``RADIUS`` of an edge.
Its constraints tr(F^T F) - 3 and det F - 1 both see no more than the change of volume at small
strains; forces are read as those of the law that the scene asks for.
"""

import newton
from job import CannotDo, main, mean_edge
from newton_common import Engine, build, stiffness

RADIUS = 0.3  # of a particle, over a mean edge: two of one body do not touch at rest
ALONE = 1e-3  # the same where there is one body and planes


def make(scene, job: dict, setting: dict) -> Engine:
    """The engine for one setting."""
    if scene.lame[:, 1].min() <= 0.0:
        raise CannotDo("its tets have no forces where the second Lame parameter is zero")
    alone = len(scene.young) == 1
    radius = (ALONE if alone else RADIUS) * mean_edge(scene)
    model = build(scene, stiffness(scene, 1.0), radius)
    model.soft_contact_mu = model.particle_mu = job["friction"]
    solver = newton.solvers.SolverXPBD(
        model,
        iterations=setting["iterations"],
        soft_body_relaxation=setting["relaxation"],
        soft_contact_relaxation=setting["relaxation"],
    )
    return Engine(scene, job, setting, model, solver)


if __name__ == "__main__":
    main(make)
