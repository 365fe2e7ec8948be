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
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from unittest import mock

import numpy as np
import warp as wp
from measure.run import command_line, one_of

import warp_contact as wc
from warp_contact.scenes import load

JELLY = wc.NeoHookean(5e4, 0.3, 1000.0, 2e-3)
FIRM = wc.NeoHookean(5e5, 0.4, 1000.0, 1e-3)
SHAKY = wc.NeoHookean(5e4, 0.3, 1000.0)
UP = (0.0, 0.0, 1.0)


class Trace:
    """The hash of a run so far."""

    def __init__(self) -> None:
        """Of nothing yet."""
        self.hash = sha256()

    def add(self, sim: wc.Simulation) -> None:
        """The state after a frame, and what contact did in it."""
        for values in (sim.positions(), sim.velocities(), *sim.contact_fields().values()):
            self.hash.update(np.ascontiguousarray(values).tobytes())
        measured = sim.measure()
        self.hash.update(repr(sorted(measured.forces.items())).encode())
        self.hash.update(repr((sim.substeps, measured.n_contacts, measured.overlap)).encode())

    def run(self, sim: wc.Simulation, frames: int) -> wc.Simulation:
        """Step and add some frames."""
        for _ in sim.frames(frames):
            self.add(sim)
        return sim


def paper(name: str, frames: int, **arguments) -> Callable[[Trace], None]:
    """A scene of the paper."""
    return lambda trace: trace.run(wc.Simulation(load(name).build(**arguments)), frames)


def two_blocks(lower=JELLY, upper=JELLY, gap: float = 0.002, **scene) -> wc.Scene:
    """A block falls on another, a little aside, on a floor."""
    built = wc.Scene(**scene)
    built.add_plane(UP, 0.0)
    built.add_body(wc.box(0.1, 3), lower, (0.0, 0.0, 0.05 + gap))
    built.add_body(wc.box(0.08, 2), upper, (0.01, 0.02, 0.14 + 2.0 * gap), velocity=(0.1, 0, -0.5))
    return built


def with_response(response) -> Callable[[Trace], None]:
    """The same two blocks with another response."""
    return lambda trace: trace.run(wc.Simulation(two_blocks(), response, fps=120), 15)


def inside(search: str) -> Callable[[Trace], None]:
    """Blocks that start inside each other."""

    def run(trace: Trace) -> None:
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
        scene.add_body(wc.box(0.1, 3), JELLY, (0.0, 0.0, 0.0))
        scene.add_body(wc.box(0.1, 4), FIRM, (0.02, 0.01, 0.06))
        trace.run(wc.Simulation(scene, wc.ContactSurface(search)), 6)

    return run


def tilted(trace: Trace) -> None:
    """Corners and edges strike and slide."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.4)
    scene.add_body(wc.box(0.1, 4), JELLY, velocity=(0.0, 0.0, 0.5))
    turn = np.array([0.3, 0.4, 0.5, 0.7]) / np.sqrt(0.99)
    scene.add_body(wc.box(0.1, 5), FIRM, (0.02, 0.013, 0.13), turn, velocity=(0.1, 0.0, -0.5))
    trace.run(wc.Simulation(scene, fps=240), 25)


def crossed(trace: Trace) -> None:
    """Bars that lie across each other touch along their edges alone."""
    scene = wc.Scene(friction=0.3)
    half = np.sqrt(0.5)
    base = wc.box((0.4, 0.04, 0.04), (8, 1, 1))
    edge = np.array([np.sin(np.pi / 8), 0.0, 0.0, np.cos(np.pi / 8)])
    scene.add_body(base, FIRM, rotation=edge, fixed=np.abs(base.vertices[:, 0]) > 0.19)
    across = np.array([edge[0] * half, edge[0] * half, edge[3] * half, edge[3] * half])
    scene.add_body(base, JELLY, (0.03, 0.0, 0.058), across)
    trace.run(wc.Simulation(scene), 20)


def friction(trace: Trace) -> None:
    """A block slides down a slope, made of a plane, into a wall."""
    scene = wc.Scene(friction=0.3)
    slope = np.array([np.sin(0.5), 0.0, np.cos(0.5)])
    scene.add_plane(slope, 0.0)
    scene.add_plane((-1.0, 0.0, 0.0), -0.15)
    turn = (0.0, np.sin(0.25), 0.0, np.cos(0.25))
    scene.add_body(wc.box(0.1, 2), JELLY, 0.0502 * slope, turn, velocity=(0.5, 0.1, 0.0))
    trace.run(wc.Simulation(scene), 30)


def materials(trace: Trace) -> None:
    """Every material, damped and not, on each other."""
    scene = wc.Scene(friction=0.5)
    scene.add_plane(UP, 0.0)
    kinds = (
        wc.Corotated(1e5, 0.3, 1000.0, 1e-3),
        wc.SpringNetwork(0.5, 0.5, 2.0, 1000.0, 1e-3),
        SHAKY,
        wc.NeoHookean(5e4, 0.3, 1000.0, 2e-2),
    )
    for k, kind in enumerate(kinds):
        place = (0.01 * (-1) ** k, 0.0, 0.041 + 0.082 * k)
        scene.add_body(wc.box(0.08, 2 + k % 2), kind, place)
    trace.run(wc.Simulation(scene), 12)


def worlds(trace: Trace) -> None:
    """Copies that never meet, each a little faster than the one before."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane(UP, 0.0)
    for world in range(4):
        scene.add_body(wc.sphere(0.05, 95), JELLY, (0.0, 0.0, 0.051), world=world)
        velocity = (0.0, 0.0, -0.5 - 0.2 * world)
        scene.add_body(wc.box(0.06, 2), FIRM, (0.01, 0.0, 0.14), velocity=velocity, world=world)
    trace.run(wc.Simulation(scene), 12)


def sleeping(trace: Trace) -> None:
    """Blocks fall asleep, and one of them is woken."""
    scene = wc.Scene()
    scene.add_plane(UP, 0.0)
    strong = wc.NeoHookean(3e4, 0.3, 1000.0, 1e-2)
    for k in range(2):
        scene.add_body(wc.box(0.1, 2), strong, (0.01 * k, 0.0, 0.0502 + 0.1004 * k))
    alone = scene.add_body(wc.box(0.1, 2), strong, (1.0, 0.0, 0.0502))
    sim = trace.run(wc.Simulation(scene, sleeping=True), 150)
    sim.set_velocity(alone, (-2.0, 0.0, 1.0))
    trace.run(sim, 40)


def driven(trace: Trace) -> None:
    """A finger that is moved by hand presses a ball against a fixed block, then lets it go."""
    scene = wc.Scene(friction=0.6)
    scene.add_body(wc.box((0.2, 0.2, 0.05), (4, 4, 1)), FIRM, fixed=True)
    ball = scene.add_body(wc.sphere(0.04, 95), JELLY, (0.0, 0.0, 0.066))
    tip = wc.box(0.06, 2)
    top = tip.vertices[:, 2] > 0.029
    finger = scene.add_body(tip, FIRM, (0.0, 0.0, 0.14), fixed=top)
    sim = wc.Simulation(scene)
    sim.set_velocity(finger, (0.0, 0.0, -0.2), top)
    trace.run(sim, 12)
    sim.set_velocity(finger, (0.1, 0.0, 0.3), top)
    trace.run(sim, 6)
    sim.set_positions(ball, sim.positions(ball) + [0.0, 0.0, 0.005])
    trace.run(sim, 6)


def resumed(trace: Trace) -> None:
    """A run that goes on from its checkpoint in another simulation."""
    first = trace.run(wc.Simulation(two_blocks()), 8)
    with tempfile.TemporaryDirectory() as folder:
        first.save(Path(folder) / "half.npz")
        second = wc.Simulation(two_blocks())
        second.load(Path(folder) / "half.npz")
    trace.run(second, 8)


def crushed(trace: Trace) -> None:
    """Tets are pressed flat, and frames repeated."""
    scene = wc.Scene()
    scene.add_plane(UP, 0.0)
    scene.add_body(wc.box(0.05, 2), JELLY, (0.0, 0.0, 0.026))
    heavy = wc.NeoHookean(5e5, 0.3, 40000.0, 1e-3)
    scene.add_body(wc.box(0.1, 2), heavy, (0.0, 0.0, 0.105), velocity=(0.0, 0.0, -2.0))
    trace.run(wc.Simulation(scene), 12)


def chosen(trace: Trace) -> None:
    """Steps that the user chose."""
    trace.run(wc.Simulation(two_blocks(friction=0.4), substeps=40), 10)


def pile(trace: Trace) -> None:
    """Many small bodies: lists outgrow their buffers."""
    rng = np.random.default_rng(0)
    scene = wc.Scene(friction=0.3)
    scene.add_plane(UP, 0.0)
    for k in range(48):
        place = 0.062 * np.array([k % 4, k // 4 % 4, k // 16]) + rng.uniform(0.0, 0.003, 3)
        scene.add_body(wc.sphere(0.03, 41), JELLY, place + [0.0, 0.0, 0.031])
    trace.run(wc.Simulation(scene), 14)


def sheets(trace: Trace) -> None:
    """Thin sheets lie on each other, vertex on vertex."""
    trace.run(wc.Simulation(load("membrane_stack").build(count=3, gap=0.002)), 10)


RUNS: dict[str, Callable[[Trace], None]] = {
    "two_bodies": paper("two_bodies", 6),
    "sampling": paper("sampling", 5),
    "squeezed_sphere": paper("squeezed_sphere", 40),
    "cubes_on_membrane": paper("cubes_on_membrane", 20),
    "membrane_stack": paper("membrane_stack", 6),
    "bowl": paper("bowl", 20, fraction=0.1),
    "inside": inside("balanced"),
    "inside_literal": inside("literal"),
    "tilted": tilted,
    "crossed": crossed,
    "friction": friction,
    "materials": materials,
    "literal": with_response(wc.ContactSurface("literal")),
    "penalty": with_response(wc.Penalty(2000.0, 0.5)),
    "predicted": with_response(wc.PredictedForce()),
    "worlds": worlds,
    "sleeping": sleeping,
    "driven": driven,
    "resumed": resumed,
    "crushed": crushed,
    "chosen": chosen,
    "pile": pile,
    "sheets": sheets,
}


def round_each_operation() -> None:
    """Compile all kernels without contraction of products and sums."""
    for name in [name for name in sys.modules if name.startswith("warp_contact.kernels.")]:
        if any(isinstance(value, wp.Kernel) for value in vars(sys.modules[name]).values()):
            module = wp.get_module(name)
            flags = module.options["cpu_compiler_flags"]
            module.options["cpu_compiler_flags"] = flags.replace("contract=fast", "contract=off")
            module.mark_modified()


def fingerprints(names: list[str]) -> Iterator[tuple[str, str]]:
    """The hash of each run, as it ends."""
    for name in names:
        trace = Trace()
        RUNS[name](trace)
        yield name, trace.hash.hexdigest()[:16]


def title(kernel: wp.Kernel) -> str:
    """Room, file and name."""
    return f"{kernel.module.name.removeprefix('warp_contact.kernels.')}.{kernel.key}"


@contextmanager
def launched() -> Iterator[set[str]]:
    """Names of the kernels, with their modules, that are launched within."""
    names: set[str] = set()
    launch = wp.launch

    def noted(kernel, *args, **kwargs):
        names.add(title(kernel))
        return launch(kernel, *args, **kwargs)

    with mock.patch.object(wp, "launch", noted):
        yield names


def kernels() -> set[str]:
    """All that there are, but for those that draw pictures."""
    return {
        title(kernel)
        for name, module in list(sys.modules.items())
        if name.startswith("warp_contact.kernels.")
        for kernel in vars(module).values()
        if isinstance(kernel, wp.Kernel)
    }


def main() -> int:
    """Print the hashes; compare them where asked to."""
    parser = command_line(__doc__)
    parser.add_argument("runs", nargs="*", type=one_of(RUNS), metavar="run", help="or all")
    parser.add_argument("--out", metavar="FILE", help="write the hashes there too")
    parser.add_argument("--against", metavar="FILE", help="compare with the hashes of a file")
    parser.add_argument("--reach", action="store_true", help="name kernels that no run launched")
    parser.add_argument("--contracted", action="store_true", help="compile as simulations do")
    args = parser.parse_args()
    if not args.contracted:
        round_each_operation()
    lines = Path(args.against).read_text(encoding="utf-8").splitlines() if args.against else []
    before = dict(line.split() for line in lines)
    found, changed = {}, 0
    with launched() as seen:
        for name, value in fingerprints(args.runs or list(RUNS)):
            found[name] = value
            differs = name in before and before[name] != value
            changed += differs
            print(f"{name:20}{value}{'  was ' + before[name] if differs else ''}", flush=True)
    if args.out:
        text = "".join(f"{name} {value}\n" for name, value in found.items())
        Path(args.out).write_text(text, encoding="utf-8")
    if args.reach:
        print("not launched:", ", ".join(sorted(kernels() - seen)) or "none")
    if args.against:
        print(f"{changed} of {len(found)} changed")
    return int(changed > 0)


if __name__ == "__main__":
    sys.exit(main())
