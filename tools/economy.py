"""What contact costs when little of it happens: the same 64 spheres in ever more contact.

    python tools/economy.py [--quick] [--repeats N] [--device NAME] [--out FILE]

The spheres are far apart; or so many pairs of them touch, the others far apart; or each rests on a
floor by itself; or all have collapsed into a pile on it. The floor is a plane or a mesh. Columns:

    case, friction   what touches, and Coulomb's coefficient
    vertices, contacts
    launches         kernels, fills, copies, scans and Bvh refits of a step
    step, elastic    a captured step [ms], and one without contact: damping, predict, drift
    damp ... close   the stages of the step [ms]: damping, predict (and drift), candidates,
                     vertex_contacts, edge_contacts, impulses, closure
    KiB              of the Warp arrays of model, state and work

Times are measured as in ``tools/bench.py``; all rows take the same number of steps in a frame.
Below the table, for each friction: ``nothing near / contact off`` is step over elastic while all
are apart; what contact adds is step - elastic. ``slope over pairs`` is the exponent p of what it
adds beyond the row apart, ~ pairs^p: 1 where each pair costs the same and none costs nothing.
``ms for any pair`` and ``ms per pair`` are the straight line through it; ``mesh / plane`` is the
ratio of what contact adds on both floors.

Last, frames of 32 blocks in 16 columns [ms]: while they settle, at rest, and asleep, with how far
sleep let them come from where they else are.
"""

import argparse
import sys
from time import perf_counter

import numpy as np
import warp as wp
from clock.crowd import blocks, rows
from clock.figures import log_slope, step_figures
from clock.machine import write
from clock.options import count
from clock.stages import STAGES
from clock.window import Timing, measure

from warp_contact import Simulation

FRICTIONS = 0.3, 0.0
SUBSTEPS = 20
SETTLING, REST, LONG, SAMPLE = 20, 40, 900, 20  # frames of the blocks
SHORT = "damp", "predict", "cand", "verts", "edges", "impulse", "close"  # as in STAGES
COLUMNS = "vertices", "contacts", "launches", "step", "elastic", *SHORT, "KiB"


def main() -> int:
    """Measure line by line, then print what follows from them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one friction, floors not settled")
    parser.add_argument("--repeats", type=count, help="of a window; 5, or 3 with --quick")
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    parser.add_argument("--out", metavar="FILE", help="write all figures there as JSON")
    args = parser.parse_args()
    wp.config.log_level = wp.LOG_WARNING
    repeats = args.repeats or (3 if args.quick else 5)
    print(f"{'case':<16} {'friction':>8} " + " ".join(f"{name:>8}" for name in COLUMNS))
    found: dict[str, float] = {}
    said: list[str] = []
    for friction in FRICTIONS[: 1 if args.quick else None]:
        timings, pairs = {}, {}
        for row in rows(args.quick):
            sim = Simulation(row.build(friction), substeps=SUBSTEPS, device=args.device)
            for _ in sim.frames(row.frames):
                pass
            timing = timings[row.name] = measure(sim, repeats)
            if row.pairs:
                pairs[row.name] = row.pairs
            print(line(row.name, friction, sim.model.n_vert, timing), flush=True)
            new = {"contacts": timing.contacts, "bytes": timing.bytes}
            new |= step_figures(timing, sim.model)
            found |= {f"{row.name}.{friction:g}.{name}": value for name, value in new.items()}
        for name, value in summary(timings, pairs).items():
            found[f"{name}.{friction:g}"] = value
            said.append(f"friction {friction:g}: {name} {value:.3g}")
    for name, value in sleep_figures(args.device).items():
        found[f"blocks.{name}"] = value
        said.append(f"blocks: {name} {value:.3g}")
    print("", *said, sep="\n")
    if args.out:
        write(args.out, wp.get_device(args.device), found)
    return 0


def sleep_figures(device: str | None) -> dict[str, float]:
    """What a frame of blocks costs settling, at rest and asleep, and what sleep changes."""
    sims = [Simulation(blocks(), sleeping=sleeping, device=device) for sleeping in (False, True)]
    awake, asleep = sims
    settling = frame_ms(awake, SETTLING)
    while asleep.frame < REST or (asleep.state.v.numpy().any() and asleep.frame < LONG):
        asleep.step_frame()
    while awake.frame < asleep.frame:
        awake.step_frame()
    resting, sleeping = frame_ms(awake, SAMPLE), frame_ms(asleep, SAMPLE)
    apart = np.abs(awake.positions() - asleep.positions()).max() / awake.model.body_edge.numpy()[0]
    return {
        "settling ms": settling,
        "at rest ms": resting,
        "asleep ms": sleeping,
        "asleep / settling": sleeping / settling,
        "frames until all sleep": float(asleep.frame - SAMPLE),
        "sleep moved, of an edge": float(apart),
    }


def frame_ms(sim: Simulation, frames: int) -> float:
    """Median time of the next frames [ms]."""
    times = []
    for _ in range(frames):
        start = perf_counter()
        sim.step_frame()
        wp.synchronize_device(sim.device)
        times.append(1e3 * (perf_counter() - start))
    return float(np.median(times))


def line(name: str, friction: float, vertices: int, timing: Timing) -> str:
    """One line of the table."""
    cells = [f"{vertices}", f"{timing.contacts:.1f}", f"{sum(timing.launches.values()):.1f}"]
    cells += [f"{timing.step_ms:.3f}", f"{timing.elastic_ms:.3f}"]
    cells += [f"{timing.ms.get(stage, 0.0):.3f}" for stage in STAGES]
    cells += [f"{timing.bytes / 1024:.0f}"]
    return f"{name:<16} {friction:>8g} " + " ".join(f"{cell:>8}" for cell in cells)


def summary(timings: dict[str, Timing], pairs: dict[str, int]) -> dict[str, float]:
    """What the lines of one friction say together."""
    added = {name: timings[name].step_ms - timings[name].elastic_ms for name in timings}
    beyond = {pairs[name]: added[name] - added["apart"] for name in pairs}
    dearer = {k: ms for k, ms in beyond.items() if ms > 0.0}
    each, fixed = np.polyfit(list(beyond), list(beyond.values()), 1)
    apart = timings["apart"]
    return {
        "nothing near / contact off": apart.step_ms / apart.elastic_ms,
        "slope over pairs": log_slope(list(dearer), list(dearer.values())),
        "ms for any pair": float(fixed),
        "ms per pair": float(each),
        "mesh / plane, apart": added["on a mesh"] / added["on a plane"],
        "mesh / plane, pile": added["pile on a mesh"] / added["pile on a plane"],
    }


if __name__ == "__main__":
    sys.exit(main())
