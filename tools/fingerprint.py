"""One hash for each of some short runs that together reach every kernel of a simulation.

    python tools/fingerprint.py [run ...] [--out FILE] [--against FILE] [--reach] [--contracted]

A hash is of positions, velocities, contact forces and contact fields after every frame, to the last
bit: a change that is meant to change nothing leaves all of them as they were, and one that is meant
to change something says which. Bits depend on the processor and on the version of Warp, so compare
on one machine only: ``--out`` writes the hashes, ``--against`` compares with those of a file, and
the exit status is 1 when any differs. ``--reach`` prints which kernels no run has launched.

Kernels are compiled so that each product and each sum is rounded by itself. As simulations run them
(``--contracted``) the compiler contracts products and sums as it sees fit, which depends on how the
arrays lie in memory: the same formulas on the same numbers then round in another way.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from pathlib import Path
from unittest import mock

import numpy as np
import warp as wp
from measure.run import command_line, one_of
from trials.setting import NONE, UP, body, scene

import warp_contact as wc
from warp_contact.scenes import load

JELLY = wc.NeoHookean(5e4, 0.3, 1000.0, 2e-3)
FIRM = wc.NeoHookean(5e5, 0.4, 1000.0, 1e-3)
Run = Iterator[wc.Simulation]  # a simulation after each of its frames


def frames(sim: wc.Simulation, n: int) -> Run:
    """The next frames of a simulation."""
    for _ in sim.frames(n):
        yield sim


def paper(name: str, n: int, **arguments) -> Run:
    """A scene of the paper."""
    return frames(wc.Simulation(load(name).build(**arguments)), n)


def two_blocks(friction: float = 0.3) -> wc.Scene:
    """A block falls on another, a little aside, on a floor."""
    low = body(wc.box(0.1, 3), JELLY, 0.052)
    high = body(wc.box(0.08, 2), JELLY, (0.01, 0.02, 0.144), v=(0.1, 0.0, -0.5))
    return scene(low, high, planes=[UP], friction=friction)


def responding(response) -> Run:
    """The same two blocks with another response."""
    return frames(wc.Simulation(two_blocks(), response, fps=120), 15)


def inside(search: str) -> Run:
    """Blocks that start inside each other."""
    high = body(wc.box(0.1, 4), FIRM, (0.02, 0.01, 0.06))
    start = scene(body(wc.box(0.1, 3), JELLY), high, gravity=NONE)
    return frames(wc.Simulation(start, wc.ContactSurface(search)), 6)


def tilted() -> Run:
    """Corners and edges strike and slide."""
    turn = np.array([0.3, 0.4, 0.5, 0.7]) / np.sqrt(0.99)
    high = body(wc.box(0.1, 5), FIRM, (0.02, 0.013, 0.13), turn, (0.1, 0.0, -0.5))
    start = scene(body(wc.box(0.1, 4), JELLY, v=0.5), high, gravity=NONE, friction=0.4)
    return frames(wc.Simulation(start, fps=240), 25)


def crossed() -> Run:
    """Bars that lie across each other touch along their edges alone."""
    bar, s, c = wc.box((0.4, 0.04, 0.04), (8, 1, 1)), np.sin(np.pi / 8), np.cos(np.pi / 8)
    low = body(bar, FIRM, turn=(s, 0.0, 0.0, c), fixed=np.abs(bar.vertices[:, 0]) > 0.19)
    across = np.sqrt(0.5) * np.array([s, s, c, c])
    high = body(bar, JELLY, (0.03, 0.0, 0.058), across)
    return frames(wc.Simulation(scene(low, high)), 20)


def friction() -> Run:
    """A block slides down a slope, made of a plane, into a wall."""
    slope, turn = np.array([np.sin(0.5), 0.0, np.cos(0.5)]), (0.0, np.sin(0.25), 0.0, np.cos(0.25))
    block = body(wc.box(0.1, 2), JELLY, 0.0502 * slope, turn, (0.5, 0.1, 0.0))
    slide = scene(block, planes=[slope])
    slide.add_plane((-1.0, 0.0, 0.0), -0.15)
    return frames(wc.Simulation(slide), 30)


def materials() -> Run:
    """Every material, damped and not, on each other."""
    kinds = (
        wc.Corotated(1e5, 0.3, 1000.0, 1e-3),
        wc.SpringNetwork(0.5, 0.5, 2.0, 1000.0, 1e-3),
        wc.NeoHookean(5e4, 0.3, 1000.0),
        wc.NeoHookean(5e4, 0.3, 1000.0, 2e-2),
    )
    stack = []
    for k, kind in enumerate(kinds):
        place = 0.01 * (-1) ** k, 0.0, 0.041 + 0.082 * k
        stack.append(body(wc.box(0.08, 2 + k % 2), kind, place))
    return frames(wc.Simulation(scene(*stack, planes=[UP], friction=0.5)), 12)


def worlds() -> Run:
    """Copies that never meet, each a little faster than the one before."""
    bodies = []
    for world in range(4):
        bodies.append(body(wc.sphere(0.05, 95), JELLY, 0.051, world=world))
        place, v = (0.01, 0.0, 0.14), -0.5 - 0.2 * world
        bodies.append(body(wc.box(0.06, 2), FIRM, place, v=v, world=world))
    return frames(wc.Simulation(scene(*bodies, planes=[UP])), 12)


def sleeping() -> Run:
    """Blocks fall asleep, and one of them is woken."""
    places = (0.0, 0.0, 0.0502), (0.01, 0.0, 0.1506), (1.0, 0.0, 0.0502)
    strong = wc.NeoHookean(3e4, 0.3, 1000.0, 1e-2)
    blocks = scene(*(body(wc.box(0.1, 2), strong, at) for at in places), planes=[UP])
    sim = wc.Simulation(blocks, sleeping=True)
    yield from frames(sim, 150)
    sim.set_velocity(2, (-2.0, 0.0, 1.0))
    yield from frames(sim, 40)


def driven() -> Run:
    """A finger that is moved by hand presses a ball against a fixed block, then lets it go."""
    block, tip = wc.box((0.2, 0.2, 0.05), (4, 4, 1)), wc.box(0.06, 2)
    top = tip.vertices[:, 2] > 0.029
    ball, finger = body(wc.sphere(0.04, 95), JELLY, 0.066), body(tip, FIRM, 0.14, fixed=top)
    sim = wc.Simulation(scene(body(block, FIRM, fixed=True), ball, finger, friction=0.6))
    sim.set_velocity(2, (0.0, 0.0, -0.2), top)
    yield from frames(sim, 12)
    sim.set_velocity(2, (0.1, 0.0, 0.3), top)
    yield from frames(sim, 6)
    sim.set_positions(1, sim.positions(1) + [0.0, 0.0, 0.005])
    yield from frames(sim, 6)


def resumed() -> Run:
    """A run that goes on from its checkpoint in another simulation."""
    first, second = (wc.Simulation(two_blocks()) for _ in range(2))
    yield from frames(first, 8)
    with tempfile.TemporaryDirectory() as folder:
        first.save(Path(folder) / "half.npz")
        second.load(Path(folder) / "half.npz")
    yield from frames(second, 8)


def crushed() -> Run:
    """Tets are pressed flat, and frames repeated."""
    heavy = wc.NeoHookean(5e5, 0.3, 40000.0, 1e-3)
    low, high = body(wc.box(0.05, 2), JELLY, 0.026), body(wc.box(0.1, 2), heavy, 0.105, v=-2.0)
    return frames(wc.Simulation(scene(low, high, planes=[UP])), 12)


def chosen() -> Run:
    """Steps that the user chose."""
    return frames(wc.Simulation(two_blocks(friction=0.4), substeps=40), 10)


def pile() -> Run:
    """Many small bodies: lists outgrow their buffers."""
    rng, balls = np.random.default_rng(0), []
    for k in range(48):
        place = 0.062 * np.array([k % 4, k // 4 % 4, k // 16]) + rng.uniform(0.0, 0.003, 3)
        balls.append(body(wc.sphere(0.03, 41), JELLY, place + [0.0, 0.0, 0.031]))
    return frames(wc.Simulation(scene(*balls, planes=[UP])), 14)


RUNS: dict[str, Callable[[], Run]] = {
    "two_bodies": partial(paper, "two_bodies", 6),
    "sampling": partial(paper, "sampling", 5),
    "squeezed_sphere": partial(paper, "squeezed_sphere", 40),
    "cubes_on_membrane": partial(paper, "cubes_on_membrane", 20),
    "membrane_stack": partial(paper, "membrane_stack", 6),
    "bowl": partial(paper, "bowl", 20, fraction=0.1),
    "inside": partial(inside, "balanced"),
    "inside_literal": partial(inside, "literal"),
    "tilted": tilted,
    "crossed": crossed,
    "friction": friction,
    "materials": materials,
    "literal": partial(responding, wc.ContactSurface("literal")),
    "penalty": partial(responding, wc.Penalty(2000.0, 0.5)),
    "predicted": partial(responding, wc.PredictedForce()),
    "worlds": worlds,
    "sleeping": sleeping,
    "driven": driven,
    "resumed": resumed,
    "crushed": crushed,
    "chosen": chosen,
    "pile": pile,
    "sheets": partial(paper, "membrane_stack", 10, count=3, gap=0.002),  # vertex on vertex
}


def fingerprint(run: Run) -> str:
    """The hash of the state after each frame, and of what contact did in it."""
    found = sha256()
    for sim in run:
        for values in (sim.positions(), sim.velocities(), *sim.contact_fields().values()):
            found.update(np.ascontiguousarray(values).tobytes())
        measured = sim.measure()
        found.update(repr(sorted(measured.forces.items())).encode())
        found.update(repr((sim.substeps, measured.n_contacts, measured.overlap)).encode())
    return found.hexdigest()[:16]


def kernels() -> set[wp.Kernel]:
    """All that there are, but for those that draw pictures."""
    modules = [m for name, m in sys.modules.items() if name.startswith("warp_contact.kernels.")]
    return {k for module in modules for k in vars(module).values() if isinstance(k, wp.Kernel)}


def round_each_operation() -> None:
    """Compile all kernels without contraction of products and sums."""
    for module in {kernel.module for kernel in kernels()}:
        flags = module.options["cpu_compiler_flags"]
        module.options["cpu_compiler_flags"] = flags.replace("contract=fast", "contract=off")
        module.mark_modified()


def main() -> int:
    """Print the hashes; compare them where asked to."""
    parser = command_line(__doc__)
    parser.add_argument("runs", nargs="*", type=one_of(RUNS), metavar="run", help="or all")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the hashes there too")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with those of a file")
    parser.add_argument("--reach", action="store_true", help="name kernels that no run launched")
    parser.add_argument("--contracted", action="store_true", help="compile as simulations do")
    args = parser.parse_args()
    if not args.contracted:
        round_each_operation()
    lines = args.against.read_text(encoding="utf-8").splitlines() if args.against else []
    before = dict(line.split() for line in lines)
    found, launched, launch = {}, set(), wp.launch

    def noted(kernel: wp.Kernel, *given, **named):
        launched.add(kernel)
        return launch(kernel, *given, **named)

    with mock.patch.object(wp, "launch", noted):
        for name in args.runs or RUNS:
            found[name] = value = fingerprint(RUNS[name]())
            was = "" if before.get(name, value) == value else f"  was {before[name]}"
            print(f"{name:20}{value}{was}", flush=True)
    changed = [name for name, value in found.items() if before.get(name, value) != value]
    if args.out:
        text = "".join(f"{name} {value}\n" for name, value in found.items())
        args.out.write_text(text, encoding="utf-8")
    if args.reach:
        missed = sorted(f"{k.module.name}.{k.key}" for k in kernels() - launched)
        print("not launched:", ", ".join(missed) or "none")
    if args.against:
        print(f"{len(changed)} of {len(found)} changed")
    return int(bool(changed))


if __name__ == "__main__":
    sys.exit(main())
