"""Explicit against implicit steps: time, steps, energy and overlap of the same scenes.

    python tools/integrators.py [case ...] [--frames N]

    case        ``blocks_E``: a block of 0.1 m and modulus E [Pa] falls by 1 mm onto another;
                ``tool``: one of steel, 2e11 Pa, on foam; ``pile``: a tenth of the bowl;
                ``shell``: a ball at 8 m/s on a shell of 1 mm that is held;
                ``gripper``: 64 worlds of a ball between two fingers; the scenes of the paper
    integrator  that the row is of
    s_per_s     CPU time of the process per simulated time, frames after the first
    steps       of the last frame, and the most of any
    energy      over that at the start, the sum of all [-]; nan where vertices are held
    overlap     deepest at the end of any frame, in edges; then in the last
    weight      mean force on the floor in the last quarter, over the weight, where there is a floor
    inverted    tets at the end

Explicit steps are left out where the model says that a frame would take more than MOST.
"""

import sys
import time
from functools import partial

import numpy as np
from measure import machine
from measure.report import Table
from measure.run import command_line, count, one_of

import warp_contact as wc
from warp_contact import scenes

MOST = 1500  # explicit steps a frame that are waited for
KINDS = "explicit", "implicit"
COLUMNS = {"case": 18, "integrator": 10, "s_per_s": 8, "steps": 6, "most": 6, "energy": 8}
TABLE = Table(**COLUMNS, overlap=8, last=8, weight=7, inverted=0)


def main() -> int:
    """Run the cases with both integrators."""
    parser = command_line(__doc__)
    parser.add_argument("cases", nargs="*", type=one_of(CASES), metavar="case", help="or all")
    parser.add_argument("--frames", type=count, default=36, help="of 1/60 s; default: %(default)s")
    args = parser.parse_args()
    print(f"{machine.line()}\n{TABLE.head()}")
    for name in args.cases or CASES:
        for kind in KINDS:
            print(row(name, kind, args.frames), flush=True)
    return 0


def row(name: str, kind: str, frames: int) -> str:
    """One line of the table."""
    sim = wc.Simulation(CASES[name](), integrator=kind, max_substeps=1_000_000)
    if kind == "explicit" and sim.next_substeps() > MOST:
        return TABLE.line(name, kind, "-", str(sim.next_substeps()), *6 * ["-"])
    start, edge = sim.measure().energy, sim.model.body_edge.numpy().min()
    spent, steps, deepest, forces = 0.0, 0, 0.0, []
    for frame in range(frames):
        begun = time.process_time()
        sim.step_frame()
        spent += (time.process_time() - begun) * (frame > 0)
        steps, now = max(steps, sim.substeps), sim.measure()
        deepest = max(deepest, now.overlap)
        forces.append(sum(f for pair, f in now.forces.items() if "plane0" in pair))
    mobile = sim.model.mass.numpy()[sim.model.inv_mass.numpy() > 0.0].sum()
    weight = mobile * np.linalg.norm(sim.model.gravity)
    share = f"{np.mean(forces[-frames // 4 :]) / weight:.4f}" if any(forces) else "-"
    kept = now.energy / start if sim.model.inv_mass.numpy().all() else np.nan
    numbers = spent * sim.fps / (frames - 1), sim.substeps, steps, kept
    numbers += deepest / edge, now.overlap / edge
    return TABLE.line(name, kind, *(f"{n:.3g}" for n in numbers), share, str(now.inverted))


def blocks(modulus: float) -> wc.Scene:
    """A block on another."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0))
    for k in range(2):
        place = (0.01 * k, 0.02 * k, 0.051 + 0.101 * k)
        scene.add_body(wc.box(0.1, 4), wc.NeoHookean(modulus, 0.3, 1000.0, 1e-3), place)
    return scene


def tool() -> wc.Scene:
    """A block of steel on one of foam."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.box(0.1, 4), wc.NeoHookean(5e4, 0.3, 100.0, 2e-3), (0.0, 0.0, 0.05))
    steel = wc.NeoHookean(2e11, 0.3, 7800.0, 1e-3)
    scene.add_body(wc.box(0.03, 3), steel, (0.0, 0.0, 0.116))
    return scene


def shell() -> wc.Scene:
    """A soft ball that flies at a thin shell."""
    scene = wc.Scene(friction=0.3, gravity=(0.0, 0.0, 0.0))
    rubber = wc.NeoHookean(1e5, 0.4, 1000.0, 1e-3)
    scene.add_body(wc.heightfield(np.zeros((7, 7)), 0.4, 1e-3), wc.Rigid(1000.0), fixed=True)
    scene.add_body(wc.sphere(0.05, 147), rubber, (0.01, 0.02, 0.08), velocity=(1.0, 0.0, -8.0))
    return scene


def gripper() -> wc.Scene:
    """A ball on the floor between two fingers, in each of 64 worlds."""
    rubber = wc.NeoHookean(1e5, 0.4, 1000.0, 2e-3)
    ball, tip = wc.sphere(0.03, 147), wc.box((0.02, 0.03, 0.06), (3, 4, 7))
    scene = wc.Scene(friction=0.8)
    scene.add_plane((0.0, 0.0, 1.0), -0.0301)
    for world in range(64):
        scene.add_body(ball, rubber, world=world)
        for side in (-1.0, 1.0):
            outer = side * tip.vertices[:, 0] > 0.0099
            place, speed = (side * 0.0405, 0.0, 0.0), (-side * 0.02, 0.0, 0.0)
            scene.add_body(tip, rubber, place, velocity=speed, fixed=outer, world=world)
    return scene


CASES = {f"blocks_1e{k}": partial(blocks, 10.0**k) for k in range(4, 13)}
CASES |= {"tool": tool, "shell": shell, "gripper": gripper}
CASES |= {"pile": lambda: scenes.load("bowl").build(fraction=0.1)}
PAPER = "two_bodies", "squeezed_sphere", "cubes_on_membrane", "membrane_stack"
CASES |= {name: scenes.load(name).build for name in PAPER}


if __name__ == "__main__":
    sys.exit(main())
