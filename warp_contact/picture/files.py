"""Picture files: PNG by the standard library, WebP and GIF with Pillow, MP4 with ffmpeg."""

import contextlib
import struct
import subprocess
import zlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np

PILLOW = "PIL", "animations need Pillow: pip install 'warp_contact[render]'"
FFMPEG = "imageio_ffmpeg", "an MP4 needs imageio-ffmpeg: pip install 'warp_contact[video]'"
NEEDS = {"webp": PILLOW, "gif": PILLOW, "mp4": FFMPEG}  # by suffix: module, what to say without it


def write_png(path, picture: np.ndarray) -> None:
    """Write an (height, width, 3) uint8 array, with Pillow if it is there."""
    try:
        from PIL import Image
    except ImportError:
        Path(path).write_bytes(png(picture))
    else:
        Image.fromarray(picture).save(path)


def read_picture(path) -> np.ndarray | None:
    """Linear colours of a picture, shape (height, width, 3); None if Pillow cannot read it."""
    try:
        from PIL import Image

        with Image.open(path) as image:
            srgb = np.asarray(image.convert("RGB"), dtype=np.float32) / 255.0
    except (ImportError, OSError, ValueError):
        return None
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def png(picture: np.ndarray) -> bytes:
    """A PNG file by the standard library alone."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)

    height, width, _ = picture.shape
    rows = np.ascontiguousarray(picture, dtype=np.int16).reshape(height, 3 * width)
    rows = np.diff(rows, axis=0, prepend=np.zeros((1, 3 * width), np.int16)).astype(np.uint8)
    lines = np.insert(rows, 0, 2, axis=1)  # filter 2: each byte minus the one above
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(lines.tobytes(), 6))
        + chunk(b"IEND", b"")
    )


def animate(pictures: Iterable, path, fps: float = 30.0) -> None:
    """Join picture files into an animated WebP, a GIF or an MP4, by the suffix of ``path``.

    A GIF plays at 50 pictures a second at most: viewers slow down a faster one.

    Raises:
        ImportError: there is no Pillow, or for an MP4 no imageio-ffmpeg
        OSError: ffmpeg failed
    """
    kind = Path(path).suffix[1:]
    if kind == "mp4":
        return _film(pictures, path, fps)
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError(NEEDS[kind][1]) from error
    images = [Image.open(picture).convert("RGB") for picture in pictures]
    options: dict = {"quality": 80, "method": 4} if kind == "webp" else {}
    images[0].save(
        path,
        save_all=True,
        append_images=images[1:],
        duration=max(round(1000.0 / fps), 1 if kind == "webp" else 20),
        loop=0,
        **options,
    )


def _film(pictures: Iterable, path, fps: float) -> None:
    """Join PNG files into an MP4 that any player takes: H.264, even width and height."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError as error:
        raise ImportError(NEEDS["mp4"][1]) from error
    command = f"-y -loglevel error -f image2pipe -c:v png -framerate {fps:.6g} -i -"
    command += " -vf pad=ceil(iw/2)*2:ceil(ih/2)*2 -c:v libx264 -pix_fmt yuv420p -crf 18"
    command += " -movflags +faststart"
    program = [get_ffmpeg_exe(), *command.split(), str(path)]
    with subprocess.Popen(program, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as ffmpeg:
        with contextlib.suppress(BrokenPipeError):  # it says itself why it ended
            for picture in pictures:
                ffmpeg.stdin.write(Path(picture).read_bytes())
        _, said = ffmpeg.communicate()
    if ffmpeg.returncode:
        raise OSError(f"cannot write {path}: ffmpeg says {said.decode(errors='replace').strip()}")
