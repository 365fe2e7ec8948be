"""What does not change within a frame.

All arrays are flat over the whole scene. A body is a range of vertices, tets and triangles.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
import warp as wp

from warp_contact.data.tie_table import TieTable


@dataclass(frozen=True)
class Elements:
    """The tets that share one material model.

    Attributes:
        kernels: the model's kernel file
        tet: tet ids, shape (n,)
        param: parameters of each tet in the order of the model's class, shape (n,) of its ``ROW``
        damped: whether any of them has a damping time above zero
    """

    kernels: ModuleType
    tet: wp.array
    param: wp.array
    damped: bool


@dataclass(frozen=True)
class Solid:
    """What a rigid body weighs, in the frame of its mesh.

    Attributes:
        mass: [kg]
        centre: of mass [m], shape (3,)
        inertia: about it [kg m^2], shape (3, 3)
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class Model:
    """What does not change during a run, gravity, friction and restitution within a frame.

    Attributes:
        labels: name of each body
        materials: material of each body, as given by the user
        solids: of each body that is rigid and moves freely, None for the others
        elements: the tets of bodies that deform by forces, one entry for each material model in use
        gravity: acceleration [m/s^2], NumPy, shape (3,)
        g: the same where kernels read it, shape (1,)
        friction: Coulomb coefficient of each body, then of each plane, shape (n_body + n_plane,)
        restitution: the same of restitution
        n_body: number of bodies
        n_vert: number of vertices
        n_tet: number of tets
        n_tri: number of surface triangles
        n_edge: number of surface edges
        n_surf: number of surface vertices
        n_plane: number of half-spaces
        cell: edge of the hash cells, the mean edge length of the tets [m]
        body_vert: first vertex of each body, shape (n_body + 1,)
        body_tet: first tet of each body, shape (n_body + 1,)
        body_tri: first surface triangle of each body, shape (n_body + 1,)
        body_world: bodies of different worlds never touch, shape (n_body,)
        body_edge: mean edge length of each body [m], shape (n_body,)
        body_thickness: twice the volume over the surface area of each body [m], shape (n_body,)
        vert_body: body of each vertex, shape (n_vert,)
        mass: vertex masses [kg], shape (n_vert,); in a rigid body they have the right sum alone
        inv_mass: their inverses, 0 for a fixed vertex [1/kg], shape (n_vert,)
        rest: vertices of the mesh of each body, as it was given [m], NumPy, shape (n_vert, 3)
        surf: ids of the surface vertices, ascending, shape (n_surf,)
        on_surface: 1 for a surface vertex, shape (n_vert,)
        tets: positively oriented, shape (n_tet,)
        tet_body: body of each tet, and of each plane behind them, shape (n_tet + n_plane,)
        pose: inverse of the rest edge matrix of each tet [1/m], shape (n_tet,)
        volume: rest volume of each tet [m^3], shape (n_tet,)
        tris: surface triangles, outward, shape (n_tri,)
        tri_body: body of each triangle, shape (n_tri,)
        edges: surface edges and their two triangles (p, q, t1, t2), shape (n_edge,)
        vt_start: first entry of each vertex in ``vt_corner``, shape (n_vert + 1,)
        vt_corner: tet corners at each vertex, as 4 tet + corner, shape (4 n_tet,)
        vs_start: first entry of each vertex in ``vs_tri``, shape (n_vert + 1,)
        vs_tri: surface triangles at each vertex, shape (3 n_tri,)
        vn_start: first entry of each vertex in ``vn_vert``, shape (n_vert + 1,)
        vn_vert: neighbours of each vertex along tet edges, ascending
        plane_n: outward unit normals, shape (n_plane,)
        plane_h: offsets along the normals [m], shape (n_plane,)
        ties: the attachments, None where there is none
    """

    labels: tuple[str, ...]
    materials: tuple
    solids: tuple[Solid | None, ...]
    elements: tuple[Elements, ...]
    gravity: np.ndarray
    g: wp.array
    friction: wp.array
    restitution: wp.array
    n_body: int
    n_vert: int
    n_tet: int
    n_tri: int
    n_edge: int
    n_surf: int
    n_plane: int
    cell: float
    body_vert: wp.array
    body_tet: wp.array
    body_tri: wp.array
    body_world: wp.array
    body_edge: wp.array
    body_thickness: wp.array
    vert_body: wp.array
    mass: wp.array
    inv_mass: wp.array
    rest: np.ndarray
    surf: wp.array
    on_surface: wp.array
    tets: wp.array
    tet_body: wp.array
    pose: wp.array
    volume: wp.array
    tris: wp.array
    tri_body: wp.array
    edges: wp.array
    vt_start: wp.array
    vt_corner: wp.array
    vs_start: wp.array
    vs_tri: wp.array
    vn_start: wp.array
    vn_vert: wp.array
    plane_n: wp.array
    plane_h: wp.array
    ties: TieTable | None = None
