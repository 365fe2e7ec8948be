"""How long it takes until there is a first frame, in processes of their own."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

SCRIPT = Path(__file__).with_name("first_frame.py")
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
            figures["cold_frame_s"] = _run(device, environment)[1]
        runs = [_run(device, environment) for _ in range(REPEATS)]
    imports, frames = zip(*runs, strict=True)
    return {"import_s": median(imports), "warm_frame_s": median(frames), **figures}


def _run(device: str | None, environment: dict[str, str]) -> tuple[float, float]:
    """Time of the import and of the first frame [s]."""
    options = ["--device", device] if device else []
    done = subprocess.run(
        [sys.executable, SCRIPT, *options],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{SCRIPT.name} failed: {done.stderr.strip()}")
    imported, frame = map(float, done.stdout.splitlines()[-1].split())
    return imported, frame
