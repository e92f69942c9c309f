"""Arrays and groups of Zarr 2 and 3, which zarr-python and TensorStore write."""
import json
import os

import numcodecs
import numpy as np
import tensorstore
import zarr
from zarr.codecs import BloscCodec, BytesCodec, Crc32cCodec, GzipCodec, ShardingCodec, TransposeCodec, ZstdCodec

from case import TYPES, Case, chosen, chunks, fill_value, order, pick, sides, sparse, with_options

AXIS_NAMES = {"t": "time", "c": "channel", "z": "z", "y": "y", "x": "x"}
INNER = ["blosclz", "lz4", "lz4hc", "zlib", "zstd"]
V2_CODECS = ["none", "zlib", "gzip", "zstd", "lz4"] + [f"blosc-{inner}-{shuffle}" for inner in INNER for shuffle in (0, 1, 2)]
V3_CODECS = ["none", "gzip", "zstd", "zstd-checksum", "crc32c"] + [
    f"blosc-{inner}-{shuffle}" for inner in INNER for shuffle in ("noshuffle", "shuffle", "bitshuffle")]
LAYOUTS = ["zyx", "yx", "tzyx", "czyx", "tczyx"]


def dtype_text(dtype, big):
    dtype = np.dtype(dtype)
    return ("|" if dtype.itemsize == 1 else ">" if big else "<") + dtype.str[1:]


def numcodec(name):
    if name.startswith("blosc"):
        _, inner, shuffle = name.split("-")
        return numcodecs.Blosc(cname=inner, shuffle=int(shuffle))
    made = {"none": None, "zlib": numcodecs.Zlib(), "gzip": numcodecs.GZip(), "zstd": numcodecs.Zstd(checksum=True),
            "lz4": numcodecs.LZ4()}
    return made[name]


def write_python_2(path, data, text, codec, f_order, separator, chunk, fill, shuffled, names):
    array = zarr.create_array(path, shape=data.shape, chunks=chunk, dtype=np.dtype(text), zarr_format=2, fill_value=fill,
                              compressors=numcodec(codec), order="F" if f_order else "C",
                              filters=[numcodecs.Shuffle(data.dtype.itemsize)] if shuffled else None,
                              chunk_key_encoding={"name": "v2", "separator": separator},
                              attributes={"_ARRAY_DIMENSIONS": names})
    array[...] = data


def write_tensorstore_2(path, data, text, codec, f_order, separator, chunk, fill, names):
    compressor = numcodec(codec)
    config = compressor.get_config() if compressor else None
    if codec == "zstd":
        config = {"id": "zstd", "level": 3}
    if codec in ("zlib", "gzip"):
        config = {"id": codec, "level": 5}
    if codec.startswith("blosc"):
        config.pop("typesize", None)
    stored = fill if not isinstance(fill, float) or np.isfinite(fill) else ("NaN" if np.isnan(fill) else "Infinity")
    spec = {"driver": "zarr", "kvstore": {"driver": "file", "path": path},
            "metadata": {"shape": data.shape, "chunks": chunk, "dtype": text, "compressor": config, "fill_value": stored,
                         "order": "F" if f_order else "C", "filters": None, "dimension_separator": separator}}
    tensorstore.open(spec, create=True).result().write(data).result()
    with open(os.path.join(path, ".zattrs"), "w", encoding="utf-8") as file:
        json.dump({"_ARRAY_DIMENSIONS": names}, file)


def version_2(folder, random, number, writer=None, dtype=None, codec=None):
    writer = writer or pick(random, ["python", "tensorstore"])
    dtype = dtype or pick(random, TYPES + ["bool"])
    codec = codec or pick(random, V2_CODECS)
    if writer == "tensorstore" and codec == "lz4":
        writer = "python"  # TensorStore has none
    axes = order(random, pick(random, LAYOUTS))
    shape = sides(random, axes)
    big, f_order, separator, fill = random.random() < 0.5, random.random() < 0.3, pick(random, "./"), fill_value(random, dtype)
    text = dtype_text(dtype, big)
    data = sparse(random, shape, dtype, fill)
    names = [AXIS_NAMES[axis] for axis in axes]
    shuffled = writer == "python" and random.random() < 0.2
    name = f"v2 {writer} {codec}{'+shuffle' if shuffled else ''} {text} {axes} {'F' if f_order else 'C'} '{separator}'"
    path = os.path.join(folder, f"v2-{number}")
    if writer == "python":
        write_python_2(path, data, text, codec, f_order, separator, chunks(random, shape), fill, shuffled, names)
    else:
        write_tensorstore_2(path, data, text, codec, f_order, separator, chunks(random, shape), fill, names)
    expected, options = chosen(random, data, axes)
    return Case(name, with_options(path, **options), [expected])


def python_codecs(codec, itemsize):
    if codec.startswith("blosc"):
        _, inner, shuffle = codec.split("-")
        return [BloscCodec(cname=inner, shuffle=shuffle, typesize=itemsize)]
    return {"none": [], "gzip": [GzipCodec()], "zstd": [ZstdCodec()], "zstd-checksum": [ZstdCodec(checksum=True)],
            "crc32c": [Crc32cCodec()]}[codec]


def tensorstore_codecs(codec, itemsize):
    if codec.startswith("blosc"):
        _, inner, shuffle = codec.split("-")
        return [{"name": "blosc", "configuration": {"cname": inner, "shuffle": shuffle, "typesize": itemsize, "clevel": 5}}]
    return {"none": [], "gzip": [{"name": "gzip", "configuration": {"level": 5}}],
            "zstd": [{"name": "zstd", "configuration": {"level": 3}}],
            "zstd-checksum": [{"name": "zstd", "configuration": {"level": 3}}], "crc32c": [{"name": "crc32c"}]}[codec]


def shards(random, chunk):
    return [side * int(random.integers(1, 4)) for side in chunk]


def write_python_3(path, data, codec, big, turn, shard, chunk, start, summed, keys, fill, names):
    filters = [TransposeCodec(order=turn)] if turn else []
    to_bytes = BytesCodec(endian="big" if big else "little")
    packers = python_codecs(codec, data.dtype.itemsize)
    key = {"chunk_key_encoding": {"name": keys[0], "separator": keys[1]}}
    common = dict(shape=data.shape, dtype=data.dtype, zarr_format=3, fill_value=fill, dimension_names=names, **key)
    if shard:
        # The chunks in a shard are turned, not the shard.
        sharding = ShardingCodec(chunk_shape=chunk, codecs=[*filters, to_bytes, *packers], index_location="start" if start else "end",
                                 index_codecs=[BytesCodec()] + ([Crc32cCodec()] if summed else []))
        array = zarr.create_array(path, chunks=shard, serializer=sharding, compressors=None, filters=None, **common)
    else:
        array = zarr.create_array(path, chunks=chunk, serializer=to_bytes, compressors=packers or None, filters=filters or None, **common)
    array[...] = data


def write_tensorstore_3(path, data, codec, big, turn, shard, chunk, start, summed, keys, fill, names):
    codecs = [{"name": "transpose", "configuration": {"order": turn}}] if turn else []
    codecs += [{"name": "bytes", "configuration": {"endian": "big" if big else "little"}}] + tensorstore_codecs(codec, data.dtype.itemsize)
    if shard:
        index = [{"name": "bytes", "configuration": {"endian": "little"}}] + ([{"name": "crc32c"}] if summed else [])
        codecs = [{"name": "sharding_indexed", "configuration": {"chunk_shape": chunk, "codecs": codecs, "index_codecs": index,
                                                                 "index_location": "start" if start else "end"}}]
    if isinstance(fill, float) and not np.isfinite(fill):
        fill = "NaN" if np.isnan(fill) else "Infinity"
    spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": path},
            "metadata": {"shape": data.shape, "data_type": str(data.dtype), "fill_value": fill, "dimension_names": names, "codecs": codecs,
                         "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shard or chunk}},
                         "chunk_key_encoding": {"name": keys[0], "configuration": {"separator": keys[1]}}}}
    tensorstore.open(spec, create=True).result().write(data).result()


def version_3(folder, random, number, writer=None, dtype=None, codec=None, sharded=None):
    writer = writer or pick(random, ["python", "tensorstore"])
    dtype = dtype or pick(random, TYPES + ["bool"])
    codec = codec or pick(random, V3_CODECS)
    sharded = random.random() < 0.5 if sharded is None else sharded
    axes = order(random, pick(random, LAYOUTS))
    shape, big, start, summed = sides(random, axes), random.random() < 0.3, random.random() < 0.5, random.random() < 0.7
    chunk, fill = chunks(random, shape), fill_value(random, dtype)
    turn = [int(i) for i in random.permutation(len(axes))] if random.random() < 0.4 else None
    shard = shards(random, chunk) if sharded else None
    keys = pick(random, [("default", "/"), ("default", "."), ("v2", "."), ("v2", "/")])
    data = sparse(random, shape, dtype, fill)
    write = write_python_3 if writer == "python" else write_tensorstore_3
    told = f"shards {'start' if start else 'end'}{' crc32c' if summed else ''}" if sharded else "chunks"
    name = f"v3 {writer} {codec} {dtype} {'big' if big else 'little'} {axes} {'turned ' if turn else ''}{told} {keys[0]}{keys[1]}"
    path = os.path.join(folder, f"v3-{number}")
    write(path, data, codec, big, turn, shard, chunk, start, summed, keys, fill, [AXIS_NAMES[axis] for axis in axes])
    expected, options = chosen(random, data, axes)
    return Case(name, with_options(path, **options), [expected])


def missing_chunks(folder, random, number):
    """Files of chunks that someone deleted."""
    path = os.path.join(folder, f"gone-{number}")
    data = np.ones((20, 20, 20), "uint16")
    array = zarr.create_array(path, shape=data.shape, chunks=(5, 5, 5), dtype="uint16", zarr_format=int(random.integers(2, 4)),
                              fill_value=9, chunk_key_encoding={"name": "v2", "separator": "."})
    array[...] = data
    for _ in range(10):
        index = random.integers(0, 4, 3)
        data[tuple(slice(5 * i, 5 * i + 5) for i in index)] = 9
        try:
            os.remove(os.path.join(path, ".".join(str(i) for i in index)))
        except FileNotFoundError:
            pass  # twice the same
    return Case(f"deleted chunks, version {array.metadata.zarr_format}", path, [data])


def others(folder, random):
    """Types and filters that few arrays have."""
    for name, dtype, options in (("half", "float16", {}), ("delta", "int32", {"filters": [numcodecs.Delta(dtype="<i4")]}),
                                 ("bz2", "int32", {"compressors": numcodecs.BZ2()})):
        path, data = os.path.join(folder, name), random.integers(-1000, 1000, (5, 6, 7)).astype(dtype)
        zarr.create_array(path, shape=data.shape, chunks=(4, 4, 4), dtype=dtype, zarr_format=2, **options)[...] = data
        yield Case(name, path, [data])


def refusals(folder):
    """What is not supported ends in an error that names it."""
    def write(name, **options):
        path = os.path.join(folder, name)
        zarr.create_array(path, shape=(4, 4, 4), chunks=(4, 4, 4), **options)[...] = 1
        return path
    yield Case("complex64 is refused", write("complex", dtype="complex64"), [], refused="complex64")
    nested = ShardingCodec(chunk_shape=(2, 2, 2), codecs=[ShardingCodec(chunk_shape=(1, 1, 1), codecs=[BytesCodec()])])
    path = write("nested", dtype="uint8", serializer=nested, compressors=None)
    yield Case("shards in shards are refused", path, [], refused="sharding_indexed")


def cases(folder, random, count):
    number = iter(range(1 << 30))
    for writer in ("python", "tensorstore"):
        for codec in V2_CODECS:
            yield version_2(folder, random, next(number), writer=writer, codec=codec)
        for codec in V3_CODECS:
            for sharded in (False, True):
                yield version_3(folder, random, next(number), writer=writer, codec=codec, sharded=sharded)
        for dtype in TYPES + ["bool"]:
            yield version_2(folder, random, next(number), writer=writer, dtype=dtype)
            yield version_3(folder, random, next(number), writer=writer, dtype=dtype)
    for _ in range(count):
        yield version_2(folder, random, next(number))
        yield version_3(folder, random, next(number))
    for _ in range(5):
        yield missing_chunks(folder, random, next(number))
    yield from others(folder, random)
    yield from refusals(folder)
