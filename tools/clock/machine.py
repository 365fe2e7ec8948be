"""Where and when something was measured."""

import datetime
import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

import warp as wp


def about(device: wp.Device) -> dict:
    """Machine, device, versions and date."""
    packages = "warp_contact", "warp-lang", "numpy"
    versions = {"python": platform.python_version()} | {name: version(name) for name in packages}
    return {
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "device": device.alias,
        "device_name": device.name if device.is_cuda else _cpu(),
        "versions": versions,
        "date": datetime.date.today().isoformat(),
    }


def write(path: str, device: wp.Device, figures: dict[str, float]) -> None:
    """Write figures and where they come from as JSON."""
    text = json.dumps(about(device) | {"figures": figures}, indent=1)
    Path(path).write_text(text + "\n", encoding="utf-8")


def _cpu() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
