"""Files that outlive their process and the power of the machine.

A file appears complete or not at all: it is written under another name, put on the disk, renamed.
"""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HIDDEN = ".warp_contact."  # how the names of what is not finished begin


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name to write a file under, which takes the place of ``path`` at the end.

    After an error ``path`` is what it was.
    """
    part = path.with_name(f"{HIDDEN}{os.getpid()}.{secrets.token_hex(4)}{path.suffix}")
    try:
        yield part
        sync(part)
        os.replace(part, path)
        sync(path.parent)
    finally:
        part.unlink(missing_ok=True)


def append(path: Path, text: str) -> None:
    """Add to a file; after an error it is as long as before."""
    data = text.encode()
    with path.open("ab", buffering=0) as file:
        end = file.tell()
        try:
            if file.write(data) < len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
            os.fsync(file.fileno())
        except BaseException:
            file.truncate(end)
            raise


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    is_folder = path.is_dir()
    if is_folder and os.name == "nt":  # Windows cannot
        return
    number = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError:
        if not is_folder:  # some file systems, such as those of networks, cannot for folders
            raise
    finally:
        os.close(number)
