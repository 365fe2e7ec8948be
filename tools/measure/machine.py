"""Where and when something was measured."""

import datetime
import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

import warp as wp

PACKAGES = "warp_contact", "warp-lang", "numpy"


def line(device: str | None = None) -> str:
    """Date, versions, device and cores; ``device`` as Warp names it, the default one if None."""
    used, info = wp.get_device(device), Path("/proc/cpuinfo")
    model = re.search(r"model name\s*: (.*)", info.read_text() if info.exists() else "")
    cpu = model[1] if model else platform.processor() or platform.machine()
    versions = f"python {platform.python_version()}", *(f"{p} {version(p)}" for p in PACKAGES)
    name = f"{used.alias}: {used.name if used.is_cuda else cpu}"
    return ", ".join(
        [datetime.date.today().isoformat(), *versions, name, f"{os.cpu_count()} cores"]
    )
