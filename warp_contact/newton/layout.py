"""A Newton model as a scene: what stands for which particles, bodies and shapes."""

from dataclasses import dataclass

import numpy as np
from newton import Model, StateFlags

from warp_contact.newton.joints import attach, attach_particles, start_poses
from warp_contact.newton.refusals import active, collides, kinematic, numbers, refuse, some
from warp_contact.newton.shapes import half_space, mesh_of, union
from warp_contact.scene.materials import NeoHookean, Rigid
from warp_contact.scene.mesh import MeshError, TetMesh
from warp_contact.scene.pieces import components
from warp_contact.scene.scene import Scene

STRAIN = 1e-3  # of tets where the model begins, against their rest poses
STATE = StateFlags.PARTICLE_Q, StateFlags.PARTICLE_QD, StateFlags.BODY_Q, StateFlags.BODY_QD
SAME = 1e-4  # relative: materials of one body


@dataclass(frozen=True)
class Soft:
    """A soft body.

    Attributes:
        index: its place in the scene
        vertices: its part of those of the scene
        particles: of the model, in the order of its vertices, shape (n,)
        held: which of them go where the user puts them, shape (n,)
    """

    index: int
    vertices: slice
    particles: np.ndarray
    held: np.ndarray


@dataclass(frozen=True)
class Solid:
    """A rigid body.

    Attributes:
        index: its place in the scene
        vertices: its part of those of the scene
        body: its number in the model
        driven: whether it goes where the user puts it
    """

    index: int
    vertices: slice
    body: int
    driven: bool


@dataclass(frozen=True)
class Layout:
    """A scene and what its bodies stand for; those of static shapes follow behind.

    Attributes:
        scene: with all bodies where the model had them
        soft: those of tets
        solid: those that are rigid
        start: ``particle_q``, ``particle_qd``, ``body_q`` and ``body_qd`` there
    """

    scene: Scene
    soft: list[Soft]
    solid: list[Solid]
    start: tuple[np.ndarray, ...]

    def restore(self, state, particles: np.ndarray, bodies: np.ndarray, flags: int) -> None:
        """Write into a state what ``flags`` name, of chosen particles and bodies, masks (n,)."""
        arrays = state.particle_q, state.particle_qd, state.body_q, state.body_qd
        chosen = particles, particles, bodies, bodies
        for flag, array, start, own in zip(STATE, arrays, self.start, chosen, strict=True):
            if flags & int(flag) and own.any():
                now = array.numpy()
                now[own] = start[own]
                array.assign(now)


def lay_out(model: Model, thickness: float | None) -> Layout:
    """Translate a model, where it begins.

    Raises:
        ValueError: for what cannot be simulated, with its label or number
    """
    refuse(model)
    scene = Scene(gravity=_gravity(model), friction=float(model.soft_contact_mu))
    worlds = _worlds(model)
    soft = _add_soft(model, scene, worlds)
    poses = start_poses(model)
    solid = _add_solids(model, scene, worlds, poses, thickness)
    bodies = {one.body: scene.bodies[one.index] for one in solid}
    attach(model, scene, bodies, poses)
    of = {int(i): (scene.bodies[s.index], k) for s in soft for k, i in enumerate(s.particles)}
    attach_particles(model, scene, of, bodies, poses)
    _add_static(model, scene, worlds, thickness)
    start = numbers(model.particle_q), numbers(model.particle_qd), poses, numbers(model.body_qd)
    return Layout(scene, soft, solid, tuple(a.copy() for a in start))


def _gravity(model: Model) -> list[float]:
    g = model.gravity.numpy().astype(np.float64)
    if (g != g[0]).any():
        raise ValueError(f"gravity differs between worlds, {g.tolist()}: give all the same")
    return g[0].tolist()


def _worlds(model: Model) -> list[int]:
    """Worlds of what moves; a model without worlds has one, 0."""
    found = {*numbers(model.particle_world).tolist(), *numbers(model.body_world).tolist()}
    own = sorted(int(w) for w in found - {-1})
    if len(own) > 1 and -1 in found:
        wanted = "particles and bodies of world -1 touch all others: put them into one"
        raise ValueError(f"the model has {len(own)} worlds; {wanted}")
    return own or [0]


def _last(scene: Scene) -> slice:
    """The vertices of the body that was added last."""
    end = sum(len(body.x) for body in scene.bodies)
    return slice(end - len(scene.bodies[-1].x), end)


def _world(world: int, worlds: list[int]) -> int:
    return worlds[0] if world < 0 else int(world)


def _add_soft(model: Model, scene: Scene, worlds: list[int]) -> list[Soft]:
    """Each piece of tets that hang together is a body."""
    tets = model.tet_indices.numpy().reshape(-1, 4)
    x, v = (a.numpy().astype(np.float64) for a in (model.particle_q, model.particle_qd))
    _check_rest(model, x, tets)
    piece = components(tets[:, [0, 1, 0, 2, 0, 3]].reshape(-1, 2), len(x))[tets[:, 0]]
    mass, moves = numbers(model.particle_mass), active(model)
    out: list[Soft] = []
    for first in np.unique(piece):
        own = np.flatnonzero(piece == first)
        particles, local = np.unique(tets[own], return_inverse=True)
        held = (mass[particles] == 0.0) | ~moves[particles]
        name = _label(model, own, scene)
        world = np.unique(model.particle_world.numpy()[particles])
        if len(world) > 1:
            raise ValueError(f"{name} is in worlds {some(world)}: a body is in one")
        mesh = TetMesh(x[particles], local.reshape(-1, 4))
        body = scene.add_body(
            mesh,
            _material(model, own, mesh, np.where(held, 0.0, mass[particles]), name),
            velocity=np.where(held[:, None], 0.0, v[particles]),
            fixed=held,
            label=name,
            world=_world(world[0], worlds),
        )
        out.append(Soft(body.index, _last(scene), particles, held))
    return out


def _label(model: Model, tets: np.ndarray, scene: Scene) -> str:
    """That of the volume where these tets are a whole one, with a number where it is taken."""
    label = f"tets {tets[0]} to {tets[-1]}"
    spans = zip(numbers(model.volume_tet_start), numbers(model.volume_tet_end), strict=True)
    for name, (start, end) in zip(model.volume_label, spans, strict=True):
        if start <= tets[0] and tets[-1] < end:
            label = name
    taken = {body.label for body in scene.bodies}
    return label if label not in taken else f"{label} {len(taken)}"


def _check_rest(model: Model, x: np.ndarray, tets: np.ndarray) -> None:
    """Raise ValueError where ``particle_q`` [m] of the model are not the shape at rest."""
    edges = np.swapaxes(x[tets[:, 1:]] - x[tets[:, :1]], 1, 2)
    f = edges @ model.tet_poses.numpy().astype(np.float64)
    strain = np.abs(np.swapaxes(f, 1, 2) @ f - np.eye(3)).max(axis=(1, 2))
    if strain.max() > STRAIN:
        where = f"tet {int(strain.argmax())} is strained by {strain.max():.2g} in model.particle_q"
        raise ValueError(f"{where}: begin at rest, and write a deformed start into the state")


def _material(
    model: Model, own: np.ndarray, mesh: TetMesh, mass: np.ndarray, name: str
) -> NeoHookean:
    """Of the tets ``own`` of a body; ``mass`` [kg] is that of its vertices, 0 where held."""
    rows = model.tet_materials.numpy()[own].astype(np.float64)
    if (np.ptp(rows, axis=0) > SAME * rows.max(axis=0)).any():
        raise ValueError(f"{name} has tets of several materials: a body has one")
    mu, lam, damping = rows[0].tolist()
    if mu <= 0.0:
        raise ValueError(f"{name} has a k_mu of {mu:g}: give one above zero")
    share = np.bincount(mesh.tets.ravel(), np.repeat(mesh.volumes / 4.0, 4), len(mass))
    free = mass > 0.0
    density = float(mass[free].sum() / share[free].sum()) if free.any() else 1.0
    young, ratio = mu * (3.0 * lam + 2.0 * mu) / (lam + mu), 0.5 * lam / (lam + mu)
    return NeoHookean(young, ratio, density, damping=4.0 * damping / young)


def _add_solids(
    model: Model, scene: Scene, worlds: list[int], poses: np.ndarray, thickness: float | None
) -> list[Solid]:
    out: list[Solid] = []
    driven, shapes = kinematic(model), collides(model)
    for b in range(model.body_count):
        name = f"body {b} '{model.body_label[b]}'"
        mesh, friction = _geometry(model, b, name, shapes, thickness)
        q = poses[b].astype(np.float64)
        motion = {}
        if not driven[b]:
            qd = model.body_qd.numpy()[b].astype(np.float64)
            motion = {"velocity": qd[:3], "angular_velocity": qd[3:]}
        body = scene.add_body(
            mesh,
            Rigid(1.0) if driven[b] else _rigid(model, b),
            q[:3],
            q[3:],
            fixed=bool(driven[b]),
            label=name,
            world=_world(model.body_world.numpy()[b], worlds),
            friction=friction,
            **motion,
        )
        out.append(Solid(body.index, _last(scene), b, bool(driven[b])))
    return out


def _geometry(
    model: Model, b: int, name: str, shapes: np.ndarray, thickness: float | None
) -> tuple[TetMesh, float]:
    """Mesh and friction of a body: all its shapes that collide."""
    own = [k for k in model.body_shapes.get(b, []) if shapes[k]]
    if not own:
        raise ValueError(f"{name} has no shape that collides: give it one")
    mu = model.shape_material_mu.numpy()[own].astype(np.float64)
    if np.ptp(mu) > SAME * mu.max():
        raise ValueError(f"{name} has shapes with a mu of {some(mu)}: a body has one")
    try:
        return union([mesh_of(model, k, thickness) for k in own]), float(mu[0])
    except MeshError as error:
        raise ValueError(f"{name} has shapes {own} that make no body: {error}") from None


def _rigid(model: Model, b: int) -> Rigid:
    inertia = model.body_inertia.numpy()[b].astype(np.float64)
    mass, com = model.body_mass.numpy()[b], model.body_com.numpy()[b]
    return Rigid(
        mass=float(mass),
        centre=tuple(com.astype(np.float64)),
        inertia=tuple(map(tuple, 0.5 * (inertia + inertia.T))),
    )


def _add_static(model: Model, scene: Scene, worlds: list[int], thickness: float | None) -> None:
    """Endless planes as half-spaces, other shapes as held bodies, one in each of their worlds."""
    shapes = collides(model) & (numbers(model.shape_body) < 0)
    planes: dict[tuple, set[int]] = {}
    for k in np.flatnonzero(shapes).tolist():
        world, mu = int(model.shape_world.numpy()[k]), float(model.shape_material_mu.numpy()[k])
        own = worlds if world < 0 else [world]
        if plane := half_space(model, k):
            planes.setdefault((*plane, mu), set()).update(own)
            continue
        mesh = mesh_of(model, k, thickness)
        for w in own:
            label = f"shape {k} '{model.shape_label[k]}'" + (f" in {w}" if len(own) > 1 else "")
            scene.add_body(mesh, Rigid(1.0), fixed=True, label=label, world=w, friction=mu)
    for (normal, offset, mu), of in planes.items():
        if of.isdisjoint(worlds):
            continue
        if not of.issuperset(worlds):
            raise ValueError(f"a plane with normal {normal} is not in all worlds: here it is")
        scene.add_plane(normal, offset, friction=mu)
