"""wc.sweep: every case once, whatever is killed; the same bits in any process."""

import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

import warp_contact as wc
from warp_contact import runs

sys.path.insert(0, str(Path(__file__).resolve().parent))  # for the processes too
import swept


class Here:
    """An executor that has no more than a sweep asks for, and runs at once."""

    def submit(self, *job):
        answer = job[0](*job[1:])
        return SimpleNamespace(done=lambda: True, result=lambda: answer)


def lines(folder) -> list[dict]:
    """What a sweep wrote."""
    return [json.loads(line) for line in (folder / runs.FILE).read_text().splitlines()]


def notes(folder) -> list[list[str]]:
    """Of each case the processes that began it."""
    return [path.read_text().split() for path in sorted(folder.glob("*.txt"))]


def test_killed_processes_lose_no_case_and_double_none(tmp_path):
    cases = [case | {"times": case["x"]} for case in swept.cases(tmp_path)]
    with pytest.raises(RuntimeError, match=r'1 of 4 cases .*"x": 3.*\n.*lost each time: Broken'):
        wc.sweep(swept.killed, cases, 2, out=tmp_path, tries=2)
    assert [len(note) for note in notes(tmp_path)] == [1, 2, 1, 2]
    assert {line["case"]["x"]: line.get("result") for line in lines(tmp_path)} == {
        0: 0,
        1: 1,
        2: 2,
        3: None,
    }
    assert len(lines(tmp_path)) == 4


def test_an_error_ends_its_case_alone_which_runs_again_next_time(tmp_path):
    cases = swept.cases(tmp_path)
    with pytest.raises(RuntimeError, match=r"(?s)1 of 4 cases failed.*swept\.py.*is missing"):
        wc.sweep(swept.missing, cases, Here(), out=tmp_path)
    (tmp_path / "there").touch()
    assert wc.sweep(swept.missing, cases, Here(), out=tmp_path) == [0, 1, 2, 3]
    assert wc.sweep(swept.missing, cases[::-1], Here(), out=tmp_path) == [3, 2, 1, 0]
    assert [len(note) for note in notes(tmp_path)] == [1, 2, 1, 1]


def test_numbers_of_numpy_come_back_as_plain_ones_in_the_order_of_the_cases():
    found = wc.sweep(swept.square, [{"x": np.float32(x)} for x in (3, 1, 2)], Here())
    assert [r["x"] for r in found] == [[3.0, 9.0], [1.0, 1.0], [2.0, 4.0]]
    assert [r["square"] for r in found] == [9.0, 1.0, 4.0]


def test_equal_cases_run_once(tmp_path):
    one, two = swept.cases(tmp_path, 2)
    same = dict(reversed(one.items())) | {"x": np.int64(0)}
    assert wc.sweep(swept.noted, [one, two, same, one], Here()) == [1, 1, 1, 1]


def is_there(process: str) -> bool:
    """Whether a process runs."""
    status = Path(f"/proc/{process}/status")
    return status.exists() and "State:\tZ" not in status.read_text()


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_is_stopped_leaves_no_process_and_goes_on(number, tmp_path):
    command = [sys.executable, "-P", swept.__file__, str(tmp_path)]
    sweep = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while len(notes(tmp_path)) < 2 or not (tmp_path / runs.FILE).exists():
        assert sweep.poll() is None, sweep.stderr.read()
        time.sleep(0.01)
    sweep.send_signal(number)
    sweep.communicate(timeout=60.0)  # 1 waits for a file that does not come
    for _, process in ((note, p) for note in notes(tmp_path) for p in note):
        while is_there(process):
            time.sleep(0.01)
    with (tmp_path / runs.FILE).open("a") as file:
        file.write('{"case": {"x": 1, "fol')  # killed while it wrote
    (tmp_path / "there").touch()
    assert wc.sweep(swept.waits, swept.cases(tmp_path), Here(), out=tmp_path) == [0, 1, 2, 3]
    assert [len(note) for note in notes(tmp_path)] == [1, 2, 1, 1]
    assert sorted(line["result"] for line in lines(tmp_path)) == [0, 1, 2, 3]


def test_a_case_has_the_same_bits_in_this_process_and_in_others():
    cases = [{"young": young} for young in (3e4, 1e5, 3e5)]
    here = wc.sweep(swept.bits, cases, Here())
    assert len(set(here)) == 3
    assert wc.sweep(swept.bits, cases, 2) == here


def test_the_example_in_the_readme_runs(tmp_path):
    text = (Path(wc.__file__).parent / "README.md").read_text(encoding="utf-8")
    (code,) = [part for part in text.split("```python\n")[1:] if "wc.sweep(" in part]
    (tmp_path / "drop.py").write_text(code.partition("```")[0])
    command = [sys.executable, "-P", "drop.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.count("initialized") == 1  # the processes do not say what Warp found
    soft, soft_and_fast, stiff, stiff_and_fast = json.loads(done.stdout.splitlines()[-1])
    # The sums of forces over time are alike, and harder blows are shorter.
    assert 0.0 < soft < soft_and_fast < stiff_and_fast and soft < stiff < stiff_and_fast
    assert len(lines(tmp_path / "out" / "drop")) == 4


def test_an_executor_of_the_standard_library_will_do(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        assert wc.sweep(swept.noted, swept.cases(tmp_path), pool) == [1, 1, 1, 1]


def test_what_an_executor_still_runs_is_cancelled_after_an_error(tmp_path):
    left = []

    class Lost(Here):
        """Its folder is gone when the first case ends; the others go on."""

        def submit(self, *job):
            if not left:
                shutil.rmtree(tmp_path / "out")
                left.append(0)
                return super().submit(*job)
            return SimpleNamespace(done=lambda: False, cancel=lambda: left.append(1))

    with pytest.raises(FileNotFoundError):
        wc.sweep(swept.noted, swept.cases(tmp_path), Lost(), out=tmp_path / "out")
    assert left == [0, 1, 1, 1]


@pytest.mark.slow
def test_a_cluster_of_dask_loses_no_case_when_its_workers_are_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    kinds = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**kinds) as cluster, distributed.Client(cluster) as client:
        found = wc.sweep(swept.killed, swept.cases(tmp_path, 6), client, out=tmp_path)
        cases = [{"young": young} for young in (3e4, 1e5, 3e5)]
        bits = wc.sweep(swept.bits, cases, client)
    assert found == list(range(6))
    # What a worker had found and not yet sent is lost with it, and is found again.
    assert min(len(note) for note in notes(tmp_path)[1::2]) >= 2
    assert sorted(line["result"] for line in lines(tmp_path)) == found
    assert bits == wc.sweep(swept.bits, cases, Here())


@pytest.mark.slow
def test_an_executor_of_submitit_will_do(tmp_path, monkeypatch):
    submitit = pytest.importorskip("submitit")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))  # its jobs take no path over
    jobs = submitit.LocalExecutor(folder=tmp_path / "jobs")
    found = wc.sweep(swept.killed, swept.cases(tmp_path, 3), jobs, out=tmp_path)
    assert found == [0, 1, 2]
    assert [len(note) for note in notes(tmp_path)] == [1, 2, 1]


def test_each_process_gets_a_device(monkeypatch):
    monkeypatch.setattr(wp, "get_cuda_devices", lambda: ["cuda:0", "cuda:1"])
    assert runs._devices(None, 9) == ["cuda:0", "cuda:1"]
    assert runs._devices(3, 9) == ["cuda:0", "cuda:1", "cuda:0"]
    assert runs._devices(3, 1) == ["cuda:0"]
    monkeypatch.setattr(wp, "get_cuda_devices", lambda: [])
    assert runs._devices(3, 9) == ["cpu"] * 3


def test_two_sweeps_do_not_write_to_one_folder(tmp_path):
    def inner(x):
        return wc.sweep(swept.square, [], Here(), out=tmp_path)

    with pytest.raises(RuntimeError, match=r"FileExistsError.* is in use by this process"):
        wc.sweep(inner, [{"x": 0}], Here(), out=tmp_path)


@pytest.mark.parametrize("case", [{"x": object()}, {"x": 1 + 2j}, [1], "x"])
def test_a_case_that_is_not_plain_is_refused(case):
    with pytest.raises(ValueError, match="case 1: "):
        wc.sweep(swept.square, [{"x": 1}, case], Here())


def test_a_result_that_is_not_plain_is_an_error_of_its_case():
    with pytest.raises(RuntimeError, match="Here is not plain: give numbers"):
        wc.sweep(lambda x: Here(), [{"x": 1}], Here())


def test_a_function_that_processes_cannot_find_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"run cannot go to another process \(.*a function of a"):
        wc.sweep(lambda x: x, [{"x": 1}], 1)
    script = tmp_path / "script.py"
    script.write_text("import warp_contact as wc\ndef f(x): pass\nwc.sweep(f, [{'x': 1}], 1)")
    done = subprocess.run([sys.executable, "-P", str(script)], capture_output=True, text=True)
    assert "has not begun: it has to be a function" in done.stderr.splitlines()[-1]


def test_a_file_of_something_else_is_refused(tmp_path):
    (tmp_path / runs.FILE).write_text('{"frame": 1}\n')
    with pytest.raises(ValueError, match=r"results\.jsonl, line 1: it is no result"):
        wc.sweep(swept.square, [{"x": 1}], Here(), out=tmp_path)


def test_a_folder_with_results_of_another_function_is_refused(tmp_path):
    cases = [{"x": 2.0}]
    wc.sweep(swept.square, cases, Here(), out=tmp_path)
    named = functools.partial(swept.square)  # the same function, in other clothes
    assert wc.sweep(named, cases, Here(), out=tmp_path)[0]["square"] == 4.0
    for _ in range(2):  # and leaves it free
        with pytest.raises(ValueError, match=r"has results of swept\.square: give swept\.cube an"):
            wc.sweep(swept.cube, cases, Here(), out=tmp_path)
