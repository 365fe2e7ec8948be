"""Where time and memory go: one figure a line, as ``case.figure value``.

    python tools/bench.py [case ...] [--quick] [--large] [--frames N] [--fraction PART]
        [--repeats N] [--device NAME] [--kernels] [--out FILE]

Each case runs in a process of its own until there are contacts, then the same few steps again and
again (a window, begun from the same state each time): as one captured graph, and uncaptured with a
timer around every operation (``clock/stages.py``). Times are medians over the repeats, averaged
over the steps of the window; all are those of one step. On the CPU they are times of the thread,
so that other processes on the machine hardly count; those of frames and starts are wall times.

    step.launches              kernels, fills, copies, scans and Bvh refits
    step.ms                    the captured step, as simulations run it
    step.ns_per_vertex         the same for each vertex
    step.bytes                 sum of STAGE.bytes
    step.elastic_ms            a captured step without contact: damping, predict, drift
    step.operations_ms         sum of all operations, each without what its call costs
    step.overhead_us_per_launch  what the captured step takes beyond that, for each operation
    step.overhead_us           the same for the step
    step.of_bound              step.ms over 90 ns a tet, 150 ns a surface vertex, 1 us a contact
    STAGE.launches, .ms        of a stage: damping, predict (and drift), candidates,
                               vertex_contacts, edge_contacts, impulses, closure
    STAGE.bytes                of the arrays given to its operations, those of a launch once: what
                               moving each once would be; a list counts with all its room
    STAGE.share                of the sum of all operations
    STAGE.ns_per_tet, .ns_per_surface_vertex, .ns_per_contact
    STAGE.OPERATION.launches, .ms   of a kernel or memory operation; printed with --kernels
    frames_per_second          of whole frames of 1/60 s, with the choice of the step
    frame.choice_of_step_share    of the time of these frames
    contacts                   at the end of a step
    window_steps               steps of the window
    array_bytes                in the Warp arrays of model, state and work; without the Bvhs
    array_bytes_per_vertex     the same over the vertices
    peak_rss_bytes             largest resident size of the process

``launch_overhead_us`` is the overhead in the 95 vertices of squeezed_sphere, where it matters most.
``pile.slope`` and ``worlds.slope`` are the exponents p of step.ms ~ vertices^p. ``import_s`` is the
import of the package; ``warm_frame_s`` and ``cold_frame_s`` are the first frame after it, the scene
included, with the kernels compiled before and with an empty kernel cache.
"""

import argparse
import multiprocessing
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import warp as wp
from clock.cases import FRACTION, cases
from clock.figures import figures, log_slope
from clock.machine import write
from clock.options import count
from clock.start import start_times

START = "start"  # the case of the times until the first frame
OVERHEAD = "squeezed_sphere"


def main() -> int:
    """Run the cases and print their figures as they come."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", metavar="case", help="of those printed; or all")
    parser.add_argument("--quick", action="store_true", help="small cases, few repeats, no compile")
    parser.add_argument(
        "--large", action="store_true", help="also a pile of 1e6 vertices, 4096 worlds"
    )
    parser.add_argument("--frames", type=count, help="to run before, in place of each case's own")
    parser.add_argument(
        "--fraction", type=float, default=FRACTION, help="of the fruits in the bowl"
    )
    parser.add_argument("--repeats", type=count, help="of a window; 7, or 3 with --quick")
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    parser.add_argument("--kernels", action="store_true", help="print each operation as well")
    parser.add_argument("--out", metavar="FILE", help="write all figures there as JSON")
    args = parser.parse_args()
    known = cases(args.quick, args.large, args.fraction)
    chosen = args.cases or [*known, START]
    unknown = set(chosen) - set(known) - {START}
    if unknown:
        names = ", ".join([*known, START])
        parser.error(f"no case {', '.join(sorted(unknown))}; there are {names}")
    wp.config.log_level = wp.LOG_WARNING
    found: dict[str, float] = {}
    timed = [name for name in known if name in chosen]
    repeats = args.repeats or (3 if args.quick else 7)
    run = partial(figures, frames=args.frames, repeats=repeats, device=args.device)
    with ProcessPoolExecutor(
        1, multiprocessing.get_context("spawn"), max_tasks_per_child=1
    ) as pool:
        for name, result in zip(timed, pool.map(run, map(known.get, timed)), strict=True):
            show(
                {f"{name}.{figure}": value for figure, value in result.items()}, found, args.kernels
            )
    show(summary(found, {name: known[name].series for name in timed}), found)
    if START in chosen:
        times = start_times(args.device, cold=not args.quick)
        show({f"{START}.{figure}": value for figure, value in times.items()}, found)
    if args.out:
        write(args.out, wp.get_device(args.device), found)
    return 0


def show(new: dict[str, float], found: dict[str, float], kernels: bool = True) -> None:
    """Print figures and keep them; those of single operations only if ``kernels``."""
    for name, value in new.items():
        if kernels or name.count(".") < 3:
            print(f"{name} {value:.5g}", flush=True)
    found |= new


def summary(found: dict[str, float], series: dict[str, str]) -> dict[str, float]:
    """What takes more than one case, and the launch overhead."""
    new = {}
    if f"{OVERHEAD}.step.ms" in found:
        new["launch_overhead_us"] = found[f"{OVERHEAD}.step.overhead_us_per_launch"]
    for kind in sorted(set(series.values()) - {""}):
        names = [name for name, own in series.items() if own == kind]
        if len(names) > 1:
            new[f"{kind}.slope"] = slope(found, names)
    return new


def slope(found: dict[str, float], names: Iterable[str]) -> float:
    """Exponent of the time of a step over the vertices."""
    return log_slope(*([found[f"{n}.{f}"] for n in names] for f in ("vertices", "step.ms")))


if __name__ == "__main__":
    sys.exit(main())
