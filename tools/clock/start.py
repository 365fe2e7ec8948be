"""How long it takes until there is a first frame; as a script, one such start.

    python start.py [DEVICE]

prints the seconds of the import, and from there to the end of the first frame of a small scene.
"""

import os
import subprocess
import sys
import tempfile
from statistics import median
from time import perf_counter

REPEATS = 3  # of what is fast


def start_times(device: str | None, cold: bool) -> dict[str, float]:
    """Seconds: of the import, and from there to the end of the first frame.

    ``cold_frame_s`` compiles all kernels, ``warm_frame_s`` finds them compiled.
    """
    figures = {}
    with tempfile.TemporaryDirectory() as cache:
        environment = dict(os.environ)
        if cold:
            environment["WARP_CACHE_PATH"] = cache
            figures["cold_frame_s"] = _start(device, environment)[1]
        runs = [_start(device, environment) for _ in range(REPEATS)]
    imports, frames = zip(*runs, strict=True)
    return {"import_s": median(imports), "warm_frame_s": median(frames), **figures}


def _start(device: str | None, environment: dict[str, str]) -> list[float]:
    """One start, in a process of its own."""
    command = [sys.executable, __file__, *([device] if device else [])]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"the start failed: {done.stderr.strip()}")
    return [float(seconds) for seconds in done.stdout.splitlines()[-1].split()]


if __name__ == "__main__":
    begin = perf_counter()
    import warp_contact as wc

    imported = perf_counter()
    from warp_contact.scenes import squeezed_sphere

    device = sys.argv[1] if len(sys.argv) > 1 else None
    wc.Simulation(squeezed_sphere.build(), device=device).step_frame()
    print(imported - begin, perf_counter() - imported)
