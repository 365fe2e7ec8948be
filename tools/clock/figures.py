"""The figures of a case, of sleep and of a start by name; what they are: ``tools/bench.py``."""

import gc
import os
import resource
import subprocess
import sys
import tempfile
from statistics import median
from time import perf_counter, process_time
from unittest import mock

import numpy as np
import warp as wp

import warp_contact as wc
from clock.scenes import FRACTION, Case, blocks, cases
from clock.window import Timing, measure

START = """
from time import perf_counter
begin = perf_counter()
import warp_contact as wc
imported = perf_counter()
from warp_contact.scenes import squeezed_sphere
wc.Simulation(squeezed_sphere.build(), device={!r}).step_frame()
print(imported - begin, perf_counter() - imported)
"""
STARTS = 3  # with kernels that are compiled already
SETTLING, REST, LONG, SAMPLE = 20, 40, 900, 20  # frames of the blocks that fall asleep
SHOWN_FRAMES = 3  # of which the median gives the frames per second
WRITTEN = "two_bodies", "cubes_on_membrane", "squeezed_sphere", "bowl"  # from their starts
WRITTEN_FRAMES = 60
BOUND = 90.0, 150.0, 1000.0  # ns that a tet, a surface vertex, a contact with its sweeps may take


def figures(
    case: Case, frames: int | None, repeats: int, integrator: str, device: str | None
) -> dict[str, float]:
    """Run a case until there are contacts, then time it."""
    wp.config.log_level = wp.LOG_WARNING
    chosen = {"substeps": case.substeps, "integrator": integrator, "device": device}
    sim = wc.Simulation(case.build(), **chosen)
    frame_times(sim, case.frames if frames is None else frames)
    timing, model, spectrum = measure(sim, repeats), sim.model, sim._stepper.spectrum
    choice, rates = [], spectrum.rates

    def timed(x: wp.array, of=None):
        start = perf_counter()
        found = rates(x, of)
        choice.append(perf_counter() - start)
        return found

    with mock.patch.object(spectrum, "rates", timed):
        times = frame_times(sim, SHOWN_FRAMES)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "vertices": model.n_vert,
        "surface_vertices": model.n_surf,
        "tets": model.n_tet,
        "bodies": model.n_body,
        "substeps": sim.substeps,
        "window_steps": timing.steps,
        **step_figures(timing, model),
        "frame.launches": sim.substeps * sum(cost.launches for cost in timing.stages.values()),
        "frames_per_second": 1.0 / median(times),
        "frame.choice_of_step_share": sum(choice) / sum(times),
        "array_bytes_per_vertex": timing.bytes / model.n_vert,
        "peak_rss_bytes": peak if sys.platform == "darwin" else 1024 * peak,
    }


def step_figures(timing: Timing, model) -> dict[str, float]:
    """The whole step, then each stage."""
    step, costs = timing.step_ms, timing.stages.values()
    launches, operations = (sum(of) for of in zip(*costs, strict=True))
    overhead = 1e3 * (step - operations)
    sizes = model.n_tet, model.n_surf, timing.contacts
    bound = sum(ns * n for ns, n in zip(BOUND, sizes, strict=True))
    found = {
        "contacts": timing.contacts,
        "step.launches": launches,
        "step.ms": step,
        "step.ns_per_vertex": 1e6 * step / model.n_vert,
        "step.elastic_ms": timing.elastic_ms,
        "step.operations_ms": operations,
        "step.overhead_us_per_launch": overhead / launches,
        "step.overhead_us": overhead,
        "step.us_per_contact": 1e3 * (step - timing.elastic_ms) / (timing.contacts or np.nan),
        "step.of_bound": 1e6 * step / bound,
    }
    for stage, cost in timing.stages.items():
        found |= {f"{stage}.{name}": value for name, value in cost._asdict().items()}
        found[f"{stage}.share"] = cost.ms / (operations or 1.0)  # a clock may be too coarse
    return found


def frame_times(sim: wc.Simulation, frames: int) -> list[float]:
    """Wall time of each of the next frames [s], that on the host included."""
    times = []
    for _ in range(frames):
        start = perf_counter()
        sim.step_frame()
        wp.synchronize_device(sim.device)
        times.append(perf_counter() - start)
    return times


def sleep_figures(device: str | None) -> dict[str, float]:
    """What a frame of blocks costs settling, at rest and asleep, and what sleep changes."""
    awake, asleep = (wc.Simulation(blocks(), sleeping=s, device=device) for s in (False, True))
    settling = frame_times(awake, SETTLING)
    while asleep.frame < REST or (asleep.state.v.numpy().any() and asleep.frame < LONG):
        asleep.step_frame()
    while awake.frame < asleep.frame:
        awake.step_frame()
    until = float(asleep.frame)
    times = settling, frame_times(awake, SAMPLE), frame_times(asleep, SAMPLE)
    names = "settling_ms", "at_rest_ms", "asleep_ms"
    found = {name: 1e3 * median(t) for name, t in zip(names, times, strict=True)}
    apart = np.abs(awake.positions() - asleep.positions()).max() / awake.model.body_edge.numpy()[0]
    return found | {"frames_until_all_sleep": until, "moved": float(apart)}


def writer_figures(device: str | None) -> dict[str, float]:
    """What frames and the writing of them cost, in turns [ms], and what the second adds."""
    found = {}
    for name, case in ((n, c) for n, c in cases(False, FRACTION).items() if n in WRITTEN):
        sim, spent = wc.Simulation(case.build(), device=device), np.zeros((2, 2))
        sim.step_frame()
        gc.collect()  # what the scene before has left
        with tempfile.TemporaryDirectory(dir=".") as folder, wc.UsdWriter(folder, sim) as usd:
            for _ in range(WRITTEN_FRAMES):
                for row, act in zip(spent, (sim.step_frame, usd.write), strict=True):
                    begin = process_time(), perf_counter()
                    act()
                    row += np.subtract((process_time(), perf_counter()), begin)
        frame, write = 1e3 * spent / WRITTEN_FRAMES
        for clock, f, w in zip(("cpu", "wall"), frame, write, strict=True):
            found |= {f"{name}.frame_{clock}_ms": f, f"{name}.write_{clock}_ms": w}
            found[f"{name}.{clock}_added"] = w / f
    return found


def start_times(device: str | None) -> dict[str, float]:
    """Seconds of the import, and from there to the end of the first frame.

    ``cold_frame_s`` compiles all kernels, ``warm_frame_s`` finds them compiled.
    """
    command = [sys.executable, "-c", START.format(device)]
    with tempfile.TemporaryDirectory() as cache:
        run = {"env": os.environ | {"WARP_CACHE_PATH": cache}, "stdout": subprocess.PIPE}
        starts = []
        for _ in range(1 + STARTS):
            done = subprocess.run(command, text=True, check=True, **run)
            starts.append([float(seconds) for seconds in done.stdout.splitlines()[-1].split()])
    imports, frames = zip(*starts[1:], strict=True)
    first = {"import_s": median(imports), "warm_frame_s": median(frames)}
    return first | {"cold_frame_s": starts[0][1]}
