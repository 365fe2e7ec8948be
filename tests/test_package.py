"""What is installed: wheel and sdist hold the tree and work alone; what an extra lacks is named.

The clean environment has the base packages, by links, and nothing else.
"""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import warp_contact as wc

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("warp_contact", "kernels", "scenes", "tests")
FILES = ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE")
BUILD = "from setuptools import build_meta as b; b.build_wheel('out'); b.build_sdist('out')"
FRAME = """
import warp_contact as wc
scene = wc.Scene()
ball = scene.add_body(wc.sphere(0.05, 41), wc.NeoHookean(1e5, 0.3, 1000.0))
sim = wc.Simulation(scene, integrator="implicit")
sim.step_frame()
print("fell", round(1e4 * (ball.x - sim.positions(ball))[:, 2].mean()), wc.__version__)
"""


def run(*command, **options) -> str:
    """What a command printed; a failure of it is one of the test."""
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}:\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def build(folder: Path) -> Path:
    """The wheel of the tree in a folder; the sdist lies beside it."""
    run(sys.executable, "-c", BUILD, cwd=folder)
    return next((folder / "out").glob("*.whl"))


def modules(wheel: Path) -> set[str]:
    """What it puts beside other packages."""
    names = zipfile.ZipFile(wheel).namelist()
    return {name for name in names if ".dist-info/" not in name}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from a copy of the tree, with nothing of an earlier build."""
    pytest.importorskip("setuptools", "77")
    folder = tmp_path_factory.mktemp("tree")
    for part in PARTS:
        skip = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / part, folder / part, symlinks=True, ignore=skip)
    for name in FILES:
        shutil.copy(ROOT / name, folder)
    return build(folder)


@pytest.fixture(scope="module")
def clean(wheel, tmp_path_factory) -> Path:
    """The programs of an environment with the wheel and what it requires."""
    pytest.importorskip("pip")
    folder = tmp_path_factory.mktemp("clean")
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    site = Path(run(python, "-c", "import site; print(site.getsitepackages()[0])").strip())
    installed = run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", wheel)
    assert "Successfully installed" in installed
    own = next(iter(metadata.distributions(name="warp_contact", path=[str(site)])))
    for line in own.requires:
        if "extra ==" not in line:
            needed = metadata.distribution(re.match(r"[\w.-]+", line)[0])
            for top in {file.parts[0] for file in needed.files} - {"..", "__pycache__"}:
                os.symlink(Path(needed.locate_file(top)).resolve(), site / top)
    return folder / "bin"


def test_a_wheel_holds_the_modules_of_the_tree_and_nothing_else(wheel):
    files = [path for part in PARTS[1:3] for path in (ROOT / part).rglob("*.py")]
    tree = {f"warp_contact/{path.relative_to(ROOT).as_posix()}" for path in files}
    own = [*(ROOT / "warp_contact").rglob("*.py"), ROOT / "warp_contact" / "py.typed"]
    tree |= {path.relative_to(ROOT).as_posix() for path in own}
    assert modules(wheel) == tree
    assert len(tree) > 200


def test_a_wheel_of_the_sdist_is_that_of_the_tree(wheel, tmp_path):
    with tarfile.open(next(wheel.parent.glob("*.tar.gz"))) as archive:
        archive.extractall(tmp_path, filter="data")
    (folder,) = tmp_path.iterdir()
    assert not (folder / "tests").exists()
    assert modules(build(folder)) == modules(wheel)


def test_importing_it_says_nothing_and_warns_of_nothing(clean):
    assert run(clean / "python", "-I", "-W", "error", "-c", "import warp_contact") == ""


def test_an_installed_wheel_simulates_and_has_its_scenes_and_version(clean, wheel, tmp_path):
    (tmp_path / "frame.py").write_text(FRAME)
    said = run(clean / "python", "-I", "-W", "error", tmp_path / "frame.py")
    assert f"fell 14 {wc.__version__}" in said  # g t^2 / 2 after 1/60 s [0.1 mm]
    assert "bowl" in run(clean / "warp-contact", "scenes")
    assert wheel.name.split("-")[1] == wc.__version__


def test_what_needs_an_extra_names_it(clean, tmp_path):
    (tmp_path / "a.msh").write_text("$MeshFormat")
    lacking = ["wc.TetMesh.load('a.msh')", "animate([], 'a.webp')"]
    lacking += ["animate([], 'a.mp4')", "plot([], 'a.png')", "Viewer('.')"]
    lacking.append("__import__('warp_contact.newton')")
    script = "import warp_contact as wc\nfrom warp_contact.picture.files import animate\n"
    script += "from warp_contact.picture.plot import plot\n"
    script += "from warp_contact.picture.viewer import Viewer\n"
    script += "".join(f"try: {code}\nexcept Exception as e: print(e)\n" for code in lacking)
    (tmp_path / "a.py").write_text(script)
    said = run(clean / "python", "-I", tmp_path / "a.py", cwd=tmp_path).splitlines()
    for extra, line in zip(
        ("mesh", "render", "video", "plot", "view", "newton"), said, strict=True
    ):
        assert f"pip install 'warp_contact[{extra}]'" in line


def test_ruff_and_mypy_find_nothing(tmp_path):
    for tool, arguments in ("ruff", ["check"]), ("ruff", ["format", "--check"]), ("mypy", []):
        program = shutil.which(tool, path=Path(sys.executable).parent)
        if program is None:
            pytest.skip(f"no {tool}: pip install 'warp_contact[test]'")
        run(program, *arguments, "--cache-dir", tmp_path, cwd=ROOT)
