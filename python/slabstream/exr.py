"""Writes OpenEXR files: float samples in scanlines, compressed by ZIP."""
from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy
import numpy.typing

_MAGIC, _VERSION = 20000630, 2
_FLOAT = 2         # type of samples
_ZIP, _ROWS = 3, 16  # compression: so many rows at a time
_LEVEL = 4         # of zlib


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def _packed(block: numpy.typing.NDArray[Any]) -> bytes:
    """First the bytes at even places, then those at odd ones; each as its difference from the one before, plus 128."""
    plain = block.tobytes()
    raw = numpy.frombuffer(plain, numpy.uint8)
    split = numpy.concatenate([raw[0::2], raw[1::2]])
    split[1:] = split[1:] - split[:-1] + numpy.uint8(128)
    packed = zlib.compress(split.tobytes(), _LEVEL)
    return packed if len(packed) < len(plain) else plain


def encode(channels: dict[str, numpy.typing.NDArray[Any]], text: dict[str, str] | None = None, dots_per_inch: int | None = None) -> bytes:
    """`channels`: height, width of float32 each, by name. `text`: attributes of the file."""
    names = sorted(channels)
    height, width = channels[names[0]].shape
    rows = numpy.stack([channels[name] for name in names], axis=1).astype("<f4")  # height, channel, width: as the file has them
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iiii", _FLOAT, 0, 1, 1) for name in names) + b"\0"
    header = struct.pack("<ii", _MAGIC, _VERSION) + b"".join([
        _attribute("channels", "chlist", listed),
        _attribute("compression", "compression", bytes([_ZIP])),
        _attribute("dataWindow", "box2i", window),
        _attribute("displayWindow", "box2i", window),
        _attribute("lineOrder", "lineOrder", b"\0"),
        _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
        _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
        *(_attribute(name, "string", value.encode()) for name, value in (text or {}).items()),
        *([] if dots_per_inch is None else [_attribute("xDensity", "float", struct.pack("<f", dots_per_inch))]),
    ]) + b"\0"
    parts = []
    for y in range(0, height, _ROWS):
        data = _packed(rows[y:y + _ROWS])
        parts.append(struct.pack("<ii", y, len(data)) + data)
    places, at = [], len(header) + 8 * len(parts)
    for part in parts:
        places.append(at)
        at += len(part)
    return header + struct.pack(f"<{len(places)}Q", *places) + b"".join(parts)
