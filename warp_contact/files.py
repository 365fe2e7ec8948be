"""Files that outlive their process and the power of the machine.

A file appears complete or not at all: it is written under another name, put on the disk, renamed.
Where one need not wait for the disk, a process that is killed still loses nothing, as the system
has it all; only the power of the machine takes what is not on the disk yet.
"""

import errno
import os
import secrets
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

HIDDEN = ".warp_contact."  # how the names of what is not finished begin
AT_ONCE = 16  # files: a disk takes them together, in hardly more time than one


@contextmanager
def replacing(path: Path, wait: bool = True) -> Iterator[Path]:
    """A name to write a file under, which takes the place of ``path`` at the end.

    After an error ``path`` is what it was. Without ``wait`` it is not put on the disk.
    """
    part = path.with_name(f"{HIDDEN}{os.getpid()}.{secrets.token_hex(4)}{path.suffix}")
    try:
        yield part
        if wait:
            sync(part)
        os.replace(part, path)
        if wait:
            sync(path.parent)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def renew(path: str, text: str) -> None:
    """Replace a file without waiting for the disk; in place if it is as long as before.

    For less than a page: one call writes it, which no kill divides and which needs no room.
    """
    data = text.encode()
    with suppress(FileNotFoundError), open(path, "r+b", buffering=0) as file:
        if os.fstat(file.fileno()).st_size == len(data):
            file.write(data)
            return
    with replacing(Path(path), wait=False) as part:
        part.write_bytes(data)


def append(path: Path, text: str, wait: bool = True) -> None:
    """Add to a file, without ``wait`` not on the disk; after an error it is as long as before."""
    data = text.encode()
    with path.open("ab", buffering=0) as file:
        end = file.tell()
        try:
            if file.write(data) < len(data):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
            if wait:
                os.fsync(file.fileno())
        except BaseException:
            file.truncate(end)
            raise


def sync_all(paths: Iterable[Path]) -> None:
    """Wait until files, and the names in folders, are on the disk."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        list(pool.map(sync, paths))  # raises what one of them has raised


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    is_folder = path.is_dir()
    if is_folder and os.name == "nt":  # Windows cannot
        return
    number = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError as error:
        if not is_folder:  # some file systems, such as those of networks, cannot for folders
            error.filename = str(path)
            raise
    finally:
        os.close(number)
