"""Neuroglancer's precomputed volumes by TensorStore."""
import os

import numpy as np
import tensorstore

from case import Case, pick, sides, values, with_options

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "float32"]


def sharding(random):
    return {"@type": "neuroglancer_uint64_sharded_v1", "hash": pick(random, ["identity", "murmurhash3_x86_128"]),
            **{f"{bits}_bits": int(random.integers(0, 4)) for bits in ("preshift", "minishard", "shard")},
            "minishard_index_encoding": pick(random, ["raw", "gzip"]), "data_encoding": pick(random, ["raw", "gzip"])}


def write_scale(path, data, chunk, resolution, offset, encoding, sharded, kind, random):
    """`data`: x, y, z and channel. Returns what TensorStore reads back: jpeg loses."""
    scale = {"size": data.shape[:3], "chunk_size": chunk, "resolution": resolution, "voxel_offset": offset, "encoding": encoding}
    if encoding == "compressed_segmentation":
        scale["compressed_segmentation_block_size"] = [int(random.choice([4, 8, 16])) for _ in range(3)]
    if encoding == "jpeg":
        scale["jpeg_quality"] = 90
    if sharded:
        scale["sharding"] = sharding(random)
    spec = {"driver": "neuroglancer_precomputed", "kvstore": {"driver": "file", "path": path},
            "multiscale_metadata": {"type": kind, "data_type": str(data.dtype), "num_channels": data.shape[3]}, "scale_metadata": scale}
    store = tensorstore.open(spec, create=True).result()
    store.write(data).result()
    return store.read().result()


def levels(folder, random, number, dtype=None, encoding=None, sharded=None):
    encoding = encoding or pick(random, ["raw", "raw", "jpeg", "compressed_segmentation"])
    dtype = dtype or pick(random, TYPES)
    sharded = random.random() < 0.5 if sharded is None else sharded
    channels = int(random.integers(1, 4))
    kind = "image"
    if encoding == "jpeg":
        dtype, channels = "uint8", pick(random, [1, 3])
    if encoding == "compressed_segmentation":
        dtype, channels, kind = pick(random, ["uint32", "uint64"]), pick(random, [1, 1, 2]), pick(random, ["image", "segmentation"])
        channels = 1 if kind == "segmentation" else channels
    data = values(random, sides(random, "zyx") + [channels], dtype)
    if encoding == "compressed_segmentation":
        data = random.integers(0, int(random.choice([2, 30, 3000])), data.shape).astype(dtype)
        if dtype == "uint64":
            data[data == 1] = (1 << 63) + 5
    data = data.transpose(2, 1, 0, 3)
    path = os.path.join(folder, f"{number}")
    channel = int(random.integers(channels))
    chunk = [int(random.integers(4, 24)) for _ in range(3)]
    resolution, offset = [4.0, 4.0, 40.0], [int(random.integers(-9, 9)) for _ in range(3)]
    expected, spacing, origin = [], [], []
    for level in range(2):
        step = [r * 2 ** level for r in resolution]
        read = write_scale(path, data, chunk, step, offset, encoding, sharded, kind, random)
        expected.append(np.asarray(read)[..., channel].transpose(2, 1, 0))
        spacing.append(step)
        origin.append([(o + 0.5) * s for o, s in zip(offset, step)])
        data = data[::2, ::2, ::2]
    name = f"{encoding} {dtype} {channels} channels {kind} {'sharded' if sharded else 'chunks'}"
    return Case(name, with_options(path, channel=channel if channel > 0 else None), expected, spacing, origin)


def refused(folder, random):
    path = os.path.join(folder, "png")
    write_scale(path, values(random, (8, 8, 8, 1), "uint8"), [8, 8, 8], [1, 1, 1], [0, 0, 0], "png", False, "image", random)
    yield Case("png is refused", path, [], refused="png")


def cases(folder, random, count):
    number = iter(range(1 << 30))
    for sharded in (False, True):
        for encoding in ("raw", "jpeg", "compressed_segmentation"):
            for _ in range(3):
                yield levels(folder, random, next(number), encoding=encoding, sharded=sharded)
        for dtype in TYPES:
            yield levels(folder, random, next(number), dtype=dtype, encoding="raw", sharded=sharded)
    for _ in range(count // 2):
        yield levels(folder, random, next(number))
    yield from refused(folder, random)
