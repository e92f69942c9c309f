"""Runs: how pictures travel (docs/wire.md, section 4)."""
from __future__ import annotations

import dataclasses
from typing import Any

import numpy
import numpy.typing

from . import schema
from .errors import DataLoss, Unavailable

Floats = numpy.typing.NDArray[numpy.float32]

_RUN_BYTES = 12
_PIXEL_BYTES = {schema.PIXEL_FORMAT_RGBA: 16, schema.PIXEL_FORMAT_RGBA_DEPTH: 20}


@dataclasses.dataclass(frozen=True)
class Rectangle:
    """What a picture shows, on its bounds within the frame: pixel (0, 0) of `rgba` is pixel (x, y) of the frame."""

    x: int
    y: int
    rgba: Floats           # height, width, 4: premultiplied, linear
    depth: Floats | None   # height, width; +infinity where nothing is seen; None: the picture has no depths


def _unpack(runs: Any, payload: memoryview) -> memoryview:
    """The bytes as they were before packing."""
    try:
        import xxhash  # of the digests; not needed to see the picture
    except ImportError:
        pass
    else:
        if xxhash.xxh3_64_intdigest(payload) != runs.digest:
            raise DataLoss("FrameReply.shares.runs.digest is not that of the payload")
    if runs.codec == schema.CODEC_RAW:
        return payload
    if runs.codec != schema.CODEC_ZSTD:
        raise DataLoss(f"FrameReply.shares.runs.codec is {runs.codec}, must be 1 or 2")
    try:
        import zstandard
    except ImportError:
        raise Unavailable("the service packs its pictures (--compress): install the Python package zstandard") from None
    raw_bytes = _RUN_BYTES * runs.image.run_count + _PIXEL_BYTES[runs.image.format] * runs.image.pixel_count
    try:
        raw = zstandard.decompress(payload) if zstandard.frame_content_size(payload) == raw_bytes else b""
    except zstandard.ZstdError:
        raw = b""
    if len(raw) != raw_bytes:
        raise DataLoss(f"FrameReply has a payload that does not unpack to {raw_bytes} bytes")
    # The bytes of each word were grouped by significance.
    planes = numpy.frombuffer(raw, numpy.uint8)
    return memoryview(planes.reshape(4, -1).T.tobytes())


def read_runs(runs: Any, payload: memoryview | bytes, width: int, height: int) -> Rectangle:
    """`runs` is an EncodedRuns of a frame of this size. DataLoss names what is wrong with it."""
    image, bounds = runs.image, runs.image.bounds
    n = image.pixel_count
    if image.format not in _PIXEL_BYTES or image.color != schema.COLOR_CODING_FLOAT32:
        raise DataLoss(f"FrameReply.shares.runs has pixels of format {image.format} and colours {image.color}, which are no picture's")
    w, h = bounds.x_end - bounds.x_begin, bounds.y_end - bounds.y_begin
    if not (0 <= w and bounds.x_end <= width and 0 <= h and bounds.y_end <= height and n <= w * h and image.run_count <= n):
        raise DataLoss(f"FrameReply.shares.runs has {n} pixels in a rectangle of {w}x{h}, in a picture of {width}x{height}")
    payload = _unpack(runs, memoryview(payload))
    if len(payload) != _RUN_BYTES * image.run_count + _PIXEL_BYTES[image.format] * n:
        raise DataLoss(f"FrameReply has a payload of {len(payload)} bytes for {image.run_count} runs of {n} pixels")

    table = numpy.frombuffer(payload, "<u4", 3 * image.run_count).reshape(-1, 3).astype(numpy.int64)
    row, column, count = table.T
    begin = row * w + column
    end = begin + count
    if count.sum() != n or (count < 1).any() or (column + count > w).any() or (row >= h).any() or (begin[1:] < end[:-1]).any():
        raise DataLoss(f"FrameReply.shares.runs does not cover {n} pixels of {w}x{h} in order")
    # Pixel i of the payload is in run r, and (i - pixels before r) behind its begin.
    target = numpy.arange(n) + numpy.repeat(begin - (numpy.cumsum(count) - count), count)

    rgba = numpy.zeros((h * w, 4), numpy.float32)
    rgba[target] = numpy.frombuffer(payload, "<f4", 4 * n, offset=_RUN_BYTES * image.run_count).reshape(-1, 4)
    depth: Floats | None = None
    if image.format == schema.PIXEL_FORMAT_RGBA_DEPTH:
        depth = numpy.full(h * w, numpy.inf, numpy.float32)
        depth[target] = numpy.frombuffer(payload, "<f4", n, offset=_RUN_BYTES * image.run_count + 16 * n)
        depth = depth.reshape(h, w)
    return Rectangle(bounds.x_begin, bounds.y_begin, rgba.reshape(h, w, 4), depth)
