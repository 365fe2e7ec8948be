"""Where and when something was measured."""

import datetime
import os
import platform
import re
from importlib.metadata import version
from pathlib import Path

import warp as wp

PACKAGES = "warp_contact", "warp-lang", "numpy"


def about(device: str | None = None) -> dict:
    """Machine, device, versions and date; ``device`` as Warp names it, the default one if None."""
    used, info = wp.get_device(device), Path("/proc/cpuinfo")
    model = re.search(r"model name\s*: (.*)", info.read_text() if info.exists() else "")
    cpu = model[1] if model else platform.processor() or platform.machine()
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": platform.system(),
        "device": used.alias,
        "device_name": used.name if used.is_cuda else cpu,
        "versions": {"python": platform.python_version()} | {p: version(p) for p in PACKAGES},
        "date": datetime.date.today().isoformat(),
    }


def line(device: str | None = None) -> str:
    """The same in one line."""
    a = about(device)
    versions = ", ".join(f"{name} {number}" for name, number in a["versions"].items())
    return f"{a['date']}, {versions}, {a['device']}: {a['device_name']}, {a['cores']} cores"
