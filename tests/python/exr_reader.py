"""Reads the OpenEXR files of these tests: float samples in scanlines, compressed by ZIP. Written by the format's description, not by exr.py."""
import struct
import zlib

import numpy as np


def exr_channels(data: bytes) -> dict[str, np.ndarray]:
    """Height, width of each channel, in the file's order."""
    assert struct.unpack_from("<ii", data) == (20000630, 2)
    at, attributes = 8, {}
    while data[at]:
        name, kind = data[at:data.index(b"\0", at)], b""
        at += len(name) + 1
        kind = data[at:data.index(b"\0", at)]
        at += len(kind) + 1
        size, = struct.unpack_from("<i", data, at)
        attributes[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    assert attributes["compression"] == b"\3" and attributes["lineOrder"] == b"\0"
    names, listed = [], attributes["channels"]
    while listed[0]:
        name, rest = listed.split(b"\0", 1)
        assert struct.unpack_from("<i", rest)[0] == 2, "float"
        names.append(name.decode())
        listed = rest[16:]
    rows = np.empty((height, len(names), width), np.float32)
    for place in struct.unpack_from(f"<{(height + 15) // 16}Q", data, at + 1):
        y, size = struct.unpack_from("<ii", data, place)
        block = rows[y - y0:y - y0 + 16]
        raw = data[place + 8:place + 8 + size]
        if size < block.nbytes:
            coded = np.frombuffer(zlib.decompress(raw), np.uint8).astype(np.int64)
            coded[1:] -= 128
            split = (np.cumsum(coded) % 256).astype(np.uint8)
            half = (len(split) + 1) // 2
            raw = np.empty(len(split), np.uint8)
            raw[0::2], raw[1::2] = split[:half], split[half:]
            raw = raw.tobytes()
        block[:] = np.frombuffer(raw, "<f4").reshape(block.shape)
    return {name: rows[:, number] for number, name in enumerate(names)}
