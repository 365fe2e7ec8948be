"""Damaged and crafted files for what reads files: nothing may crash, hang or be nonsense.

    python tests/trials/fuzz_files.py N SEED     # N damaged files; exit code 1 for any fault

A worker loads each file, or runs ``info``, ``validate`` or ``render`` with it, and is ended after
20 s. Faults, in capitals: a crash, a hang, an error that is not ValueError or OSError, words that
do not name the file or are no single line, a mesh that is nonsense, a crafted file that is taken.
Files with faults stay in ``out/fuzz``.
"""

import contextlib
import io
import json
import os
import random
import re
import resource
import select
import shutil
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import damage

FOLDER = Path("out/fuzz").resolve()
SECONDS = 20
MEMORY = 8 * 2**30  # of the worker [bytes]: libraries reserve some that they do not use
PLAUSIBLE = 1e6  # sizes [m] beyond are taken with a warning only


def work() -> None:
    """Answer each line ``command<tab>path`` with what came of it."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    answer, nowhere = os.fdopen(os.dup(1), "w", buffering=1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # libraries print
    os.dup2(nowhere, 2)
    from warp_contact.command import cli

    cli.start_warp()
    print("ready", file=answer, flush=True)
    for line in sys.stdin:
        command, path = line.rstrip("\n").split("\t")
        print(json.dumps(outcome(cli, command, path)), file=answer, flush=True)


def outcome(cli, command: str, path: str) -> tuple[str, str]:
    """``taken``, ``refused`` or a fault, and what was said."""
    import warp_contact as wc

    if command == "load":
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                return judged(wc.TetMesh.load(path), said)
            except (ValueError, OSError) as error:
                return plain(str(error), path)
            except BaseException as error:
                return "TRACEBACK", f"{type(error).__name__}: {error}"
    small = ["--size", "16x9", "--samples", "1", "--frames=-1", "--quiet"]
    more = [*small, "--out", str(FOLDER / "pictures")] if command == "render" else []
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main([command, path, *more])
    if code == 1:
        text = err.getvalue() if command != "validate" else out.getvalue().splitlines()[0]
        lines = [line for line in text.splitlines() if "warning:" not in line]
        return plain("\n".join(lines), path if command != "validate" else "")
    return ("taken", "") if code == 0 else ("WRONG CODE", f"{code} {err.getvalue()}")


def plain(text: str, path: str) -> tuple[str, str]:
    """``refused``, if the text is one line that names the file and no class of error of ours."""
    named = Path(path).stem in text
    leak = re.search(r"(Type|Key|Index|Attribute|Overflow|ZeroDivision|Runtime)Error: ", text)
    leak = leak if leak and "cannot be read (" not in text else None
    ok = named and not leak and text and "\n" not in text and len(text) < 700
    return ("refused" if ok else "UNCLEAR"), text


def judged(mesh, said: list) -> tuple[str, str]:
    """``taken`` for a mesh that can be simulated, or whose size was warned of."""
    x, t = mesh.vertices, mesh.tets
    ok = np.isfinite(x).all() and (mesh.volumes > 0.0).all() and t.min() == 0 and t.max() < len(x)
    return ("taken" if ok and (np.ptp(x) < PLAUSIBLE or said) else "NONSENSE"), repr(mesh)


class Worker:
    """A process that works, ended and started again where it does not answer."""

    def __init__(self):
        given = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen([sys.executable, __file__, "--work"], **given)
        self.process.stdout.readline()

    def ask(self, command: str, path: Path) -> tuple[str, str]:
        """What comes of a command with a file."""
        print(f"{command}\t{path}", file=self.process.stdin, flush=True)
        ready = select.select([self.process.stdout], [], [], SECONDS)[0]
        line = self.process.stdout.readline() if ready else ""
        if line:
            return tuple(json.loads(line))
        self.process.kill()
        code = self.process.wait()
        self.__init__()
        return ("CRASH", f"exit code {code}") if ready else ("HANG", "")


def main(n: int, seed: int) -> int:
    """Try all files, name those with faults, count what came."""
    worker, count, faults = Worker(), Counter(), 0
    for k, (command, path) in enumerate(damage.trials(FOLDER, n, random.Random(seed))):
        kind, said = worker.ask(command, path)
        kind = "TAKEN" if kind == "taken" and path.parent.name == "crafted" else kind
        count[command, kind] += 1
        if kind.isupper():
            faults += 1
            kept = FOLDER / f"fault_{seed}_{k}{path.suffix}"
            (shutil.copytree if path.is_dir() else shutil.copy)(path, kept)
            print(f"{kind}: {command} {kept}: {' '.join(said.split())[-300:]}", flush=True)
    for (command, kind), number in sorted(count.items()):
        print(f"{command:9} {kind:10} {number}")
    print(f"{count.total()} files, {faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    if sys.argv[1] == "--work":
        work()
    else:
        sys.exit(main(int(sys.argv[1]), int(sys.argv[2])))
