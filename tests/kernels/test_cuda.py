"""Every kernel compiles for a GPU; that needs no driver."""

import importlib
import pkgutil

import pytest
import warp as wp

import warp_contact.kernels


def modules() -> list[str]:
    """Names of the kernel files with kernels in them."""
    found = []
    for info in pkgutil.walk_packages(warp_contact.kernels.__path__, "warp_contact.kernels."):
        module = importlib.import_module(info.name)
        if any(isinstance(value, wp.Kernel) for value in vars(module).values()):
            found.append(info.name)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("arch", [80, 90])
def test_all_kernels_compile_for_cuda(tmp_path, arch):
    names = modules()
    assert len(names) > 25
    for name in names:
        folder = tmp_path / name
        wp.compile_aot_module(
            wp.get_module(name), arch=arch, module_dir=folder, use_ptx=True, strip_hash=True
        )
        assert list(folder.glob("*.ptx")), name
