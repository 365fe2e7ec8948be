"""One owner at a time: a file that its process locks, and that names it."""

import json
import os
import socket
import weakref
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: a lock that a killed process left has to be removed by hand
    fcntl = None


class Lock:
    """Holds a lock file from its construction until it is released, or forgotten.

    The system frees what a process held, however that ends; the file may stay behind, and is taken
    over. A file that names another machine is not: some file systems tell no machine of the locks
    of another.
    """

    def __init__(self, path: Path):
        """Take the lock at ``path``.

        Raises:
            FileExistsError: another process has it, or another holder in this one
        """
        number = None
        while number is None:
            number = _take(path)
        self.release = weakref.finalize(self, _release, path, number)


def _take(path: Path) -> int | None:
    """The descriptor of the file, locked; None if its owner removed it meanwhile."""
    number, is_new = _open(path)
    if number is None:
        return None
    try:
        is_free = _lock(number)
        host, process = _owner(number)
        here = socket.gethostname()
        if not (is_new if is_free is None else is_free) or host not in ("", here):
            raise FileExistsError(f"{path.parent} is in use by {_words(path, host, process)}")
        if not _is_at(path, number):
            os.close(number)
            return None
        os.ftruncate(number, 0)
        os.lseek(number, 0, os.SEEK_SET)
        os.write(number, json.dumps({"host": here, "process": os.getpid()}).encode())
        return number
    except BaseException:
        os.close(number)
        raise


def _open(path: Path) -> tuple[int | None, bool]:
    """Descriptor of the lock file and whether it is new."""
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), True
    except FileExistsError:
        pass
    try:
        return os.open(path, os.O_RDWR), False
    except FileNotFoundError:
        return None, False


def _lock(number: int) -> bool | None:
    """Whether the file could be locked; None where files cannot be."""
    try:
        if fcntl:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
    except BlockingIOError:
        return False
    except OSError:
        pass
    return None


def _owner(number: int) -> tuple[str, int]:
    """Host and process that the file names; "" and 0 if it names none."""
    try:
        owner = json.loads(os.read(number, 4096))
        return str(owner["host"]), int(owner["process"])
    except (ValueError, KeyError, TypeError):
        return "", 0


def _words(path: Path, host: str, process: int) -> str:
    """Who has the lock, and the remedy."""
    if (host, process) == (socket.gethostname(), os.getpid()):
        return "this process: close what writes there, or choose another folder"
    where = f"process {process} on {host or 'an unknown machine'}"
    return f"{where}: choose another folder, or remove {path} if that has ended"


def _is_at(path: Path, number: int) -> bool:
    """Whether it is this file that the name stands for."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(number))
    except FileNotFoundError:
        return False


def _release(path: Path, number: int) -> None:
    """Remove the file while it is still locked."""
    if _is_at(path, number):
        path.unlink(missing_ok=True)
    os.close(number)
