"""Does the suite notice? Wrong changes to a copy of the tree, one at a time, each with its test.

    python tools/mutate.py [--only TEXT]

``mutations.toml`` lists them: in a ``file`` the text ``old``, which stands there once, becomes
``new``, and ``test`` should fail, once it has passed without. ``kind`` names the mistake.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import warp as wp
from measure.run import command_line

ROOT = Path(__file__).resolve().parent.parent
LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "results", "*.egg-info")
PYTEST = sys.executable, "-P", "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"


def changes(root: Path = ROOT) -> list[dict[str, str]]:
    """The list, in its order."""
    return tomllib.loads((root / "tools/mutations.toml").read_text(encoding="utf-8"))["change"]


def passes(root: Path, *tests: str, **env: str) -> bool:
    """Whether all tests pass in a tree; RuntimeError where none could run."""
    env = os.environ | {"PYTHONPATH": str(root)} | env
    run = subprocess.run([*PYTEST, *tests], cwd=root, env=env, capture_output=True, text=True)
    if run.returncode > 1:
        raise RuntimeError(run.stdout + run.stderr)
    return run.returncode == 0


def catches(root: Path, change: dict[str, str], **env: str) -> bool:
    """Whether the test of a change fails with it; ValueError where it has not one place."""
    path = root / change["file"]
    before = path.read_text(encoding="utf-8")
    if (n := before.count(change["old"])) != 1:
        raise ValueError(f"{change['file']} has {n} times {change['old']!r}")
    path.write_text(before.replace(change["old"], change["new"]), encoding="utf-8")
    caught = not passes(root, change["test"], **env)
    path.write_text(before, encoding="utf-8")
    return caught


def main() -> int:
    """Try the changes whose file, kind or test has the text asked for."""
    parser = command_line(__doc__)
    parser.add_argument("--only", default="", metavar="TEXT")
    only, found = parser.parse_args().only, []
    wp.init()
    with tempfile.TemporaryDirectory() as folder:
        tree = shutil.copytree(ROOT, Path(folder) / "tree", symlinks=True, ignore=LEFT_OUT)
        kernels = Path(wp.config.kernel_cache_dir)  # compiled ones; others are added to the copy
        env = {"WARP_CACHE_PATH": folder}
        shutil.copytree(kernels, Path(folder) / kernels.name)
        chosen = [c for c in changes(tree) if only in f"{c['file']} {c['kind']} {c['test']}"]
        if not chosen:
            parser.error(f"no change has {only!r} in its file, kind or test")
        if not passes(tree, *sorted({c["test"] for c in chosen}), **env):
            raise RuntimeError("a test fails without any change")
        for change in chosen:
            found.append(catches(tree, change, **env))
            word = "caught" if found[-1] else "NOT CAUGHT"
            print(f"{word}: {change['file']}, {change['kind']}, {change['test']}", flush=True)
    print(f"{sum(found)} of {len(found)} caught")
    return int(not all(found))


if __name__ == "__main__":
    sys.exit(main())
