"""Writes PNG files: 8 or 16 bits a channel, RGBA, straight alpha."""
from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy
import numpy.typing

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_RGBA = 6   # colour type
_UP = 2     # filter: each byte minus the one above it
_LEVEL = 4  # of zlib: a third of the time of 6, and files 4 % longer


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def encode(codes: numpy.typing.NDArray[Any], text: dict[str, str] | None = None, dots_per_inch: int | None = None) -> bytes:
    """`codes`: height, width, 4 of uint8 or uint16. `text`: Latin-1, by keyword."""
    height, width, _ = codes.shape
    bits = 8 * codes.dtype.itemsize
    rows = numpy.ascontiguousarray(codes, codes.dtype.newbyteorder(">")).view(numpy.uint8).reshape(height, -1)
    filtered = numpy.empty((height, 1 + rows.shape[1]), numpy.uint8)
    filtered[:, 0] = _UP
    filtered[:1, 1:] = rows[:1]
    numpy.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    parts = [_SIGNATURE, _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, _RGBA, 0, 0, 0))]
    if dots_per_inch is not None:
        density = round(dots_per_inch / 0.0254)  # a metre
        parts.append(_chunk(b"pHYs", struct.pack(">IIB", density, density, 1)))
    for keyword, value in (text or {}).items():
        parts.append(_chunk(b"tEXt", keyword.encode("latin-1") + b"\0" + value.encode("latin-1", "replace")))
    parts += [_chunk(b"IDAT", zlib.compress(filtered.tobytes(), _LEVEL)), _chunk(b"IEND", b"")]
    return b"".join(parts)
