"""newton/refusals.py: what cannot be simulated is refused by name, never left out silently."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402

from warp_contact.newton import SolverContactSurface  # noqa: E402

STILL = wp.quat_identity()
DT = 1.0 / 240.0


def _add_ball(builder, x, **more):
    ball = builder.add_body(xform=wp.transform(wp.vec3(x, 0.0, 5.0), STILL))
    builder.add_shape_sphere(ball, radius=0.05, cfg=newton.ModelBuilder.ShapeConfig(**more))


def _add_balls(builder, **more):
    _add_ball(builder, 1.0, **more)
    _add_ball(builder, 2.0)


def _bare(builder):
    builder.add_body(mass=1.0, inertia=wp.mat33(np.eye(3)), label="bare")


def _materials(builder):
    builder.tet_materials[-1] = (1e6, 1e6, 0.0)


def _skin(builder):
    builder.tri_materials[0] = (1.0, 0.0, 0.0, 0.0, 0.0)


def _belt(builder):
    mesh = newton.Mesh.create_box(0.2, 0.2, 0.2)
    mesh.enable_surface_velocity = True
    builder.add_shape_mesh(-1, mesh=mesh)


def _filtered(builder):
    _add_balls(builder)
    builder.add_shape_collision_filter_pair(0, 1)


BUILT = {
    "'bare' has no shape that collides": _bare,
    "volume_0 has tets of several materials": _materials,
    "CONE": lambda b: b.add_shape_cone(-1, radius=0.1, half_height=0.1),
    "particles 27 belong to no tet": lambda b: b.add_particle(wp.vec3(), wp.vec3(), 1.0),
    "1 springs": lambda b: b.add_spring(0, 1, 1.0, 1.0, 0.0),
    "tri_materials": _skin,
    "shape_margin of shapes 0": lambda b: _add_balls(b, margin=0.01),
    "shape_material_ka of shapes 0": lambda b: _add_balls(b, ka=0.01),
    "shape_material_restitution of shapes 0": lambda b: _add_balls(b, restitution=0.5),
    "shapes 0 have a surface velocity": _belt,
    "shapes 0 do not collide with particles": lambda b: _add_balls(b, has_particle_collision=False),
    "shapes 0 'shape_0' and 1 'shape_1' do not touch": _filtered,
    "shapes 0 .* do not touch in": lambda b: _add_balls(b, collision_group=2),
    "and 1 .* do not touch in this": lambda b: _add_balls(b, has_shape_collision=False),
}


@pytest.mark.parametrize("message", BUILT)
def test_what_cannot_be_simulated_is_refused_by_name(device, message, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    BUILT[message](builder)
    with pytest.raises(ValueError, match=message):
        SolverContactSurface(builder.finalize(device=device))


def test_groups_and_filters_of_what_does_not_move_are_no_matter(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    builder.add_ground_plane()
    wall = newton.ModelBuilder.ShapeConfig(has_shape_collision=False)
    builder.add_shape_box(-1, hx=0.1, hy=0.1, hz=0.1, cfg=wall)
    for half in 0.1, 0.2:
        still = builder.add_body(is_kinematic=True)
        builder.add_shape_box(still, hx=half, hy=half, hz=half, cfg=wall)
    SolverContactSurface(builder.finalize(device=device))


@pytest.mark.parametrize("name", ["soft_contact_restitution", "particle_adhesion"])
def test_a_setting_of_the_model_is_refused(device, name, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    model = builder.finalize(device=device)
    setattr(model, name, 0.5)
    with pytest.raises(ValueError, match=f"{name} is 0.5"):
        SolverContactSurface(model)


def test_what_is_asked_of_another_interface_is_refused(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    run = run_of(builder, device)
    kinds = newton.solvers.SolverBase
    with pytest.raises(ValueError, match="finds contacts in each step"):
        run.solver.set_collision_frequency(
            collision_frequency_type={
                kinds.CollisionSlot.SOFT_SELF_CONTACT: kinds.CollisionFrequencyType.PRE_INIT
            }
        )
    with pytest.raises(NotImplementedError, match="particle_contact_f"):
        run.solver.update_contacts(None)
    with pytest.raises(ValueError, match="'contact_f'"):
        run.solver.observables({"contact_f"})
    run.control = run.model.control()
    run.control.tet_activations = wp.full(run.model.tet_count, 0.5, dtype=float, device=device)
    with pytest.raises(ValueError, match="tet_activations"):
        run.step()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_deprecated_attributes_of_a_state_are_refused(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    builder.request_state_attributes("body_qdd")
    with pytest.raises(ValueError, match="state attributes body_qdd"):
        SolverContactSurface(builder.finalize(device=device))
