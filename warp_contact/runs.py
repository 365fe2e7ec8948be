"""Many runs: one function for every case, each in a process, here or on a cluster.

A line in a file for every case that has ended, written by this process alone, says what is done:
whatever is killed, no case is lost or counted twice. A case gives the same bits in any process.
"""

import functools
import json
import os
import signal
import sys
import time
import traceback
from asyncio import CancelledError  # Dask's of a case is one of these
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread

import warp as wp

from warp_contact import checks
from warp_contact.files import HIDDEN, append
from warp_contact.usd.lock import Lock

FILE = "results.jsonl"
PAUSE = 0.01  # s between two looks at what runs
MAIN = "it has to be a function of a module or script, called under if __name__ == '__main__':"


def sweep(run: Callable, cases: Iterable[dict], executor=None, out=None, tries: int = 3) -> list:
    """What ``run(**case)`` returns for each case, in their order.

    Cases and results are plain: numbers, strings, lists, dicts, None; arrays become lists. Equal
    cases run once. An error of ``run`` ends its case, not the others.

    Args:
        run: a function that the processes can import
        cases: its arguments by name
        executor: how many processes of this machine, by default one for each GPU, or for each core
            where there is none; or anything whose ``submit`` returns what has ``done``, ``result``
            and ``cancel``: a pool of ``concurrent.futures``, a client of Dask, one of submitit
        out: a folder; what a case gives is a line of its ``results.jsonl`` once the case has
            ended. What is there is not run again
        tries: how often a case is begun whose process is killed

    Raises:
        ValueError: for cases that are not plain, a ``run`` that processes cannot import, or an
            ``out`` that has results of a function of another name or file
        FileExistsError: another sweep writes to ``out``
        RuntimeError: some cases failed; all others are done. Those that failed run again next time
    """
    tries = checks.count(tries, "tries")
    _check(run, cases, executor)
    given = [_key(case, k) for k, case in enumerate(cases)]
    results = Results(out, _name(run))
    try:
        todo = [key for key in dict.fromkeys(given) if "result" not in results.known.get(key, ())]
        if todo:
            with _places(executor, run, len(todo)) as places:
                _run(run, deque(todo), places, tries, results)
    finally:
        results.close()
    failed = [key for key in given if "error" in results.known[key]]
    if failed:
        first = f"the first {failed[0]}:\n{results.known[failed[0]]['error']}"
        raise RuntimeError(f"{len(failed)} of {len(given)} cases failed, {first}")
    return [results.known[key]["result"] for key in given]


def _check(run, cases, executor) -> None:
    """Raise ValueError for what cannot be these."""
    if not callable(run):
        raise checks.refuse("run", run, "give a function")
    if not isinstance(cases, Iterable):
        raise checks.refuse("cases", cases, "give a list of dicts")
    if executor is not None and not hasattr(executor, "submit"):
        checks.count(executor, "executor")


def _name(run: Callable) -> str:
    """Name of the file and the function; the same for a script and for what imports it."""
    while isinstance(run, functools.partial):
        run = run.func
    named = run if hasattr(run, "__qualname__") else type(run)
    place = sys.modules.get(named.__module__)
    return f"{Path(getattr(place, '__file__', None) or named.__module__).stem}.{named.__qualname__}"


def _run(run: Callable, waiting: deque, places: list, tries: int, results: "Results") -> None:
    """Give each of the cases to a place that is free, until all have ended."""
    begun: Counter = Counter()
    flying: list[tuple] = []  # what was submitted, the case, the place
    try:
        while waiting or flying:
            while waiting and places:
                key, place = waiting.popleft(), places.pop()
                begun[key] += 1  # for Dask: what was begun before is something else
                flying.append((place.submit(attempt, run, key, begun[key]), key, place))
            looked = [(one[0].done(), one) for one in flying]
            flying = [one for done, one in looked if not done]
            for future, key, place in (one for done, one in looked if done):
                places.append(place)
                answer = _answer(future, last=begun[key] >= tries)
                if answer:
                    results.add(key, answer)
                else:
                    waiting.append(key)
            if len(flying) == len(looked):
                time.sleep(PAUSE)
    finally:
        for future, *_ in flying:
            future.cancel()


def _answer(future, last: bool) -> dict:
    """What ``attempt`` found; nothing where its process was killed, unless this was the last."""
    try:
        return json.loads(future.result())
    except (Exception, CancelledError) as error:  # ``attempt`` has none
        lost = f"its process was lost each time: {type(error).__name__}: {error}"
        return {"error": lost} if last else {}


def attempt(run: Callable, key: str, _) -> str:
    """What ``run`` makes of a case, or the error with which it ended, as JSON."""
    try:
        return json.dumps({"result": run(**json.loads(key))}, default=_plain)
    except (Exception, SystemExit):
        return json.dumps({"error": traceback.format_exc()})


def _key(case: dict, k: int) -> str:
    """A case as JSON: equal cases have the same."""
    try:
        if not isinstance(case, dict) or not all(isinstance(name, str) for name in case):
            raise TypeError("it is no dict of arguments by name")
        return json.dumps(case, sort_keys=True, default=_plain)
    except (TypeError, ValueError) as error:
        raise ValueError(f"case {k}: {error}") from None


def _plain(value):
    """An array or a number of NumPy as JSON has it."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not plain: give numbers, strings, lists, dicts")


class Results:
    """What became of cases: ``known`` by case, and lines of a file in a folder if there is one.

    The line of a case is {"run": ..., "case": ..., "result": ...}, or has "error" with a traceback.
    """

    def __init__(self, folder, run: str):
        """Read what is there of the function ``run``.

        Raises FileExistsError where another sweep writes, ValueError for lines of another function.
        """
        self._run = run
        self.known: dict[str, dict] = {}
        self._path = self._lock = None
        if folder is not None:
            path = checks.path(folder, "out") / FILE
            path.parent.mkdir(parents=True, exist_ok=True)
            self._path, self._lock = path, Lock(path.with_name(f"{HIDDEN}lock"))
            try:
                if path.exists():
                    self._read()
            except BaseException:
                self.close()
                raise

    def _read(self) -> None:
        data = self._path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):  # the line at which a process was killed
            os.truncate(self._path, whole)
        for k, line in enumerate(data[:whole].splitlines(), 1):
            try:
                answer = json.loads(line)
                of, key = answer.pop("run"), _key(answer.pop("case"), k)
            except (ValueError, KeyError, AttributeError):
                raise ValueError(f"{self._path}, line {k}: it is no result of a case") from None
            if of != self._run:
                raise ValueError(f"{self._path} has results of {of}: give {self._run} another out")
            self.known[key] = answer

    def add(self, key: str, answer: dict) -> None:
        """Keep what became of a case."""
        if self._path:
            line = {"run": self._run, "case": json.loads(key)} | answer
            append(self._path, json.dumps(line) + "\n")
        self.known[key] = answer

    def close(self) -> None:
        """Let other sweeps write."""
        if self._lock:
            self._lock.release()


@contextmanager
def _places(executor, run: Callable, n_case: int) -> Iterator[list]:
    """A place for each case that may run at the same time: what has ``submit``."""
    if hasattr(executor, "submit"):
        yield [executor] * n_case
        return
    own = [Process(device) for device in _devices(executor, n_case)]
    try:
        for begun in [process.submit(_begun, run) for process in own]:
            try:
                begun.result()
            except BrokenExecutor:
                raise RuntimeError(
                    f"a process that should call run has not begun: {MAIN}"
                ) from None
            except Exception as error:
                raise ValueError(f"run cannot go to another process ({error}): {MAIN}") from None
        yield list(own)
    finally:
        for process in own:
            process.end()


def _devices(count: int | None, most: int) -> list[str]:
    """The device of each process, of ``most`` at most."""
    cores = getattr(os, "process_cpu_count", os.cpu_count)() or 1
    found = [str(device) for device in wp.get_cuda_devices()] or ["cpu"] * cores
    return [found[k % len(found)] for k in range(min(count or len(found), most))]


class Process:
    """A process that runs one case after the other on its device; a new one once it was killed."""

    def __init__(self, device: str):
        """Nothing runs before something is submitted."""
        self._device = device
        self._begin()

    def _begin(self) -> None:
        spawn = get_context("spawn")  # a fork would share the threads and the GPU of this process
        end, self._held = spawn.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(1, spawn, _prepare, (self._device, end))

    def submit(self, *job) -> Future:
        """As of an executor."""
        try:
            return self._pool.submit(*job)
        except BrokenExecutor:
            self.end()
            self._begin()
            return self._pool.submit(*job)

    def end(self) -> None:
        """End the process, whatever it does."""
        self._held.close()
        self._pool.shutdown(cancel_futures=True)


def _prepare(device: str, end: Connection) -> None:
    """What a new process does first. It ends with the one that began it, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the terminal: the other one sees to it
    Thread(target=_end_with, args=(end,), daemon=True).start()
    wp.config.log_level = wp.LOG_WARNING
    wp.set_device(device)


def _end_with(end: Connection) -> None:
    with suppress(EOFError, OSError):
        end.recv_bytes()
    os._exit(1)


def _begun(run: Callable) -> None:
    """Says by its end that ``run`` has arrived."""
