"""Every kernel compiles for a GPU; that needs no driver."""

import subprocess
import sys

import pytest

# In a process of its own: compiling ahead leaves its options on the modules.
SCRIPT = """
import importlib, pkgutil, sys
import warp as wp
import warp_contact.kernels

arch, folder = int(sys.argv[1]), sys.argv[2]
for info in pkgutil.walk_packages(warp_contact.kernels.__path__, "warp_contact.kernels."):
    module = importlib.import_module(info.name)
    if any(isinstance(value, wp.Kernel) for value in vars(module).values()):
        wp.compile_aot_module(wp.get_module(info.name), arch=arch, module_dir=folder, use_ptx=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("arch", [80, 90])
def test_all_kernels_compile_for_cuda(tmp_path, arch):
    command = [sys.executable, "-c", SCRIPT, str(arch), str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert len(list(tmp_path.glob("*.ptx"))) > 25
