"""A9: a fine block slides over the facets of a coarse one without friction; nothing may be felt.

    F_n = W, F_t = 0, constant height

The claim of Spillmann and Teschner (2005) is a force that stays continuous while contacts change
from facet to facet. The coarse block is flat and fixed, so that the answer is exact; or deformable,
and then the height depends on where the load is and is not judged.

What makes the force continuous are the weights of eqs. (1) and (2) and of the impulses: the
barycentric ones of a contact point in its triangle. They are switched off on the deformable block,
where they matter: on a flat rigid one any weights give the same. All is then on the closest vertex,
right after contacts were found. These figures are shown, next to the same with the weights as
reference, and have no limits.
"""

from unittest.mock import patch

import numpy as np
import warp as wp
from measure.figure import Figure, Figures, relative, rms, zero

import warp_contact as wc
from verification.setup import G, forces, masses, watch
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.measure.contact_fields import vertex_area
from warp_contact.step import narrow_phase

wp.set_module_options({"enable_backward": False})

EDGE, CELLS, DENSITY = 0.1, 4, 1000.0  # of the block that slides [m], [kg/m^3]
YOUNG, POISSON, DAMPING = 1e5, 0.3, 2e-3  # [Pa], [-], [s]
RATIOS = 4.0, 1.37  # cells of the coarse block over those of the fine one
LENGTH, WIDTH = 0.4, 0.2  # of the coarse block, about [m]
SPEED = 0.1  # [m/s]
SETTLE, SAMPLE = 0.8, 1.2  # [s]: the slow cell of ratio 4 lasts 1 s
FPS = 60

NORMAL, ALONG = (0.1, 0.02, 0.001), (0.05, 0.01, 0.001)  # rms of the force, of W
HEIGHT = 1e-3, 1e-4, 1e-5  # rms, of an edge


def run(quick: bool) -> Figures:
    """Both ratios on a fixed block; with and without weights on a deformable one, quick for one."""
    for ratio in RATIOS:
        yield from drag(ratio, fixed=True)
    for ratio in RATIOS[: 1 if quick else None]:
        yield from compare(ratio)


def drag(ratio: float, fixed: bool) -> Figures:
    """A fine block in motion on a coarse one: what is felt after it settled."""
    scene = wc.Scene(gravity=(0.0, 0.0, -G), friction=0.0)
    cell = ratio * EDGE / CELLS
    cells = [round(LENGTH / cell), round(WIDTH / cell), 1]
    size = cell * np.array(cells)
    material = wc.NeoHookean(YOUNG, POISSON, DENSITY, DAMPING)
    base = wc.box(size, cells)
    held = fixed | (base.vertices[:, 2] < 0.0)
    scene.add_body(base, material, (0.0, 0.0, -0.5 * size[2]), fixed=held)
    high = 0.5 * EDGE + 1e-3 * EDGE / CELLS
    place = 0.5 * (EDGE - size[0]) + 0.013, 0.007, high  # rims over no edge
    scene.add_body(wc.box(EDGE, CELLS), material, place, velocity=(SPEED, 0.0, 0.0))
    sim = wc.Simulation(scene, fps=FPS)
    mass = masses(sim, 1)

    def look() -> tuple[float, ...]:
        momentum = mass @ sim.velocities(1)[:, 0]
        height = mass @ sim.positions(1)[:, 2] / mass.sum()
        area = vertex_area(sim.model, sim.state.x)
        below = (sim.contact_fields()["pressure"] * area)[: -len(mass)]
        return forces(sim, ("body0", "body1"))[0], momentum, height, *below

    before = watch(sim, SETTLE, lambda: mass @ sim.velocities(1)[:, 0])[-1]
    normal, momentum, height, *below = watch(sim, SAMPLE, look).T
    label = f"A9 facets 1:{ratio:g}, {'fixed' if fixed else 'deformable'} base"
    weight = mass.sum() * G
    yield relative(label, "mean normal force [N]", normal.mean(), weight, NORMAL)
    yield zero(label, "ripple of the normal force [of W]", np.std(normal) / weight, NORMAL)
    along = rms(np.diff(momentum, prepend=before) * FPS) / weight
    yield zero(label, "rms of the force along [of W]", along, ALONG)
    ripple = np.std(height) / EDGE
    yield zero(label, "ripple of the height [of an edge]", ripple, HEIGHT if fixed else ())
    # Of the base, in a frame.
    jump = np.abs(np.diff(below, axis=1)).max() / weight
    yield Figure(label, "largest jump of the force at a vertex [of W]", float(jump))


def compare(ratio: float) -> Figures:
    """On the deformable block with the weights, then without; the reference is with them."""
    on = list(drag(ratio, fixed=False))
    yield from on
    with patch.object(narrow_phase, "count_contacts", count_closest):
        off = list(drag(ratio, fixed=False))
    for f, without in zip(on, off, strict=True):
        yield Figure(f"A9 facets 1:{ratio:g}, closest vertex", f.name, without.value, f.value)


def count_closest(work: Work, *others, count=narrow_phase.count_contacts) -> None:
    """Count contacts after those of vertices have lost their weights."""
    inputs = [work.mesh.n_body, work.contacts.n_vertex]
    wp.launch(level, work.capacity.contacts, inputs, outputs=[work.contacts.record])
    count(work, *others)


@wp.kernel
def level(
    # in
    n_body: int,
    n_contact: wp.array[int],  # (1,)
    # in, out
    contact: wp.array[Contact],  # (capacity,)
):
    """One thread per contact: the closest corner of the triangle takes all of it."""
    c = wp.tid()
    if c >= n_contact[0] or contact[c].pair[1] >= n_body or contact[c].coef[0] == 0.0:
        return
    coef = contact[c].coef  # of the triangle's corners from 2 on
    most = wp.where(coef[3] < coef[2], 3, 2)
    most = wp.where(coef[4] < coef[most], 4, most)
    for k in range(2, 5):
        coef[k] = wp.where(k == most, -1.0, 0.0)
    contact[c].coef = coef
