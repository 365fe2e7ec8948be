"""Where and when something was measured."""

import datetime
import os
import platform
from importlib.metadata import version
from pathlib import Path

import warp as wp

PACKAGES = "warp_contact", "warp-lang", "numpy"


def about(device: str | None = None) -> dict:
    """Machine, device, versions and date; ``device`` as Warp names it, the default one if None."""
    used = wp.get_device(device)
    versions = {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
    return {
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "device": used.alias,
        "device_name": used.name if used.is_cuda else _cpu(),
        "versions": versions,
        "date": datetime.date.today().isoformat(),
    }


def line(device: str | None = None) -> str:
    """The same in one line."""
    a = about(device)
    versions = ", ".join(f"{name} {number}" for name, number in a["versions"].items())
    return f"{a['date']}, {versions}, {a['device']}: {a['device_name']}, {a['cores']} cores"


def _cpu() -> str:
    try:
        for text in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if text.startswith("model name"):
                return text.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
