"""Newton's extended position-based dynamics: constraints of tets, relaxed all at once.

Knobs: ``steps`` in a frame, ``iterations``, ``relaxation`` and ``radius``. Between soft bodies its
contact knows particles only: balls about the vertices, of a radius over a mean edge of the finest
body. Two of one body that are closer than two radii push each other apart at rest, too: in cells of
``box`` from 0.44 on, in sheets one layer thick always. Its damping of a constraint is the
coefficient over the modulus: that of the shape is beta as in the scene, that of the volume
beta mu / lambda. Its constraints tr(F^T F) - 3 and det F - 1 both see no more than the change of
volume at small strains; forces are read as those of the law that the scene asks for.
"""

import newton
from job import CannotDo, main, mean_edge
from newton_common import Engine, build, stiffness

ALONE = 1e-3  # radius over a mean edge where there is one body and planes


def make(scene, job: dict, setting: dict) -> Engine:
    """The engine for one setting."""
    if scene.lame[:, 1].min() <= 0.0:
        raise CannotDo("its tets have no forces where the second Lame parameter is zero")
    alone = len(scene.young) == 1
    radius = (ALONE if alone else setting["radius"]) * mean_edge(scene)
    model = build(scene, job["friction"], 1.0, stiffness(scene, 1.0), radius)
    solver = newton.solvers.SolverXPBD(
        model,
        iterations=setting["iterations"],
        soft_body_relaxation=setting["relaxation"],
        soft_contact_relaxation=setting["relaxation"],
    )
    return Engine(scene, job, setting, model, solver)


if __name__ == "__main__":
    main(make)
