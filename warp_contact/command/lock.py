"""One run at a time in a folder: a lock file that names its owner."""

import json
import os
import socket
from pathlib import Path

from warp_contact.errors import UsageError


class RunLock:
    """Holds ``.<name>.lock`` beside the root layer of a run; a context manager.

    A lock whose process has ended on this machine is taken over.
    """

    def __init__(self, root: Path):
        """Of the run whose root layer is ``root``."""
        self._path = root.with_name(f".{root.stem}.lock")

    def __enter__(self) -> "RunLock":
        """Take the lock; raises UsageError where another process has it."""
        self._is_new = not self._path.parent.exists()
        self._path.parent.mkdir(parents=True, exist_ok=True)
        owner = {"host": socket.gethostname(), "process": os.getpid()}
        for _ in range(2):
            try:
                with self._path.open("x", encoding="utf-8") as file:
                    json.dump(owner, file)
                return self
            except FileExistsError:
                self._refuse_unless_left_behind(owner["host"])
        raise UsageError(f"{self._path.parent} is being taken over by another run")

    def __exit__(self, *_) -> None:
        """Let others have it; a folder that was made for it and is empty goes too."""
        self._path.unlink(missing_ok=True)
        if self._is_new and not any(self._path.parent.iterdir()):
            self._path.parent.rmdir()

    def _refuse_unless_left_behind(self, host: str) -> None:
        """Remove the lock of a process that has ended."""
        try:
            other = json.loads(self._path.read_text(encoding="utf-8"))
            there, process = str(other["host"]), int(other["process"])
        except (OSError, ValueError, KeyError, TypeError):
            there, process = "an unknown machine", 0
        if there != host or (process and is_running(process)):
            raise UsageError(
                f"{self._path.parent} is in use by process {process} on {there}; "
                f"choose another --out, or remove {self._path} if that run has ended"
            )
        self._path.unlink(missing_ok=True)


def is_running(process: int) -> bool:
    """Whether there is such a process on this machine."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # that of another user
        return True
    return True
