"""N5 by TensorStore: datasets, groups of levels, and views as BigStitcher writes them."""
import json
import os

import tensorstore

from case import TYPES, Case, chunks, halved, one_of_each, pick, sides, sparse, values, with_options

CODECS = {"raw": {"type": "raw"}, "gzip": {"type": "gzip"}, "zlib": {"type": "gzip", "useZlib": True}, "zstd": {"type": "zstd"},
          "bzip2": {"type": "bzip2"}, "xz": {"type": "xz"},
          **{f"blosc-{inner}-{shuffle}": {"type": "blosc", "cname": inner, "shuffle": shuffle, "clevel": 5}
             for inner in ("blosclz", "lz4", "lz4hc", "zlib", "zstd") for shuffle in (0, 1, 2)}}


def write(path, data, block, codec):
    """`data`: the last axis runs fastest, which N5 names first."""
    turned = data.transpose()
    spec = {"driver": "n5", "kvstore": {"driver": "file", "path": path},
            "metadata": {"dataType": str(data.dtype), "dimensions": turned.shape, "blockSize": block[::-1], "compression": codec}}
    tensorstore.open(spec, create=True).result().write(turned).result()


def attributes(path, **values_of):
    os.makedirs(path, exist_ok=True)
    name = os.path.join(path, "attributes.json")
    known = {}
    if os.path.exists(name):
        with open(name, encoding="utf-8") as file:
            known = json.load(file)
    with open(name, "w", encoding="utf-8") as file:
        json.dump({**known, **values_of}, file)


def single(folder, random, number, codec=None, dtype=None):
    codec, dtype = codec or pick(random, list(CODECS)), dtype or pick(random, TYPES)
    axes = pick(random, ["zyx", "zyx", "yx", "tzyx"])
    data = sparse(random, sides(random, axes), dtype, 0)
    path = os.path.join(folder, f"single-{number}.n5")
    attributes(path, n5="2.5.1")
    write(os.path.join(path, "volumes", "raw"), data, chunks(random, data.shape), CODECS[codec])
    time = int(random.integers(data.shape[0])) if axes[0] == "t" else None
    expected = data if time is None else data[time]
    expected = expected.reshape((1,) * (3 - expected.ndim) + expected.shape)
    return Case(f"{codec} {dtype} {axes}", with_options(path, array="volumes/raw", time=time), [expected])


def levels(folder, random, number):
    path = os.path.join(folder, f"levels-{number}.n5")
    attributes(path, n5="2.5.1")
    voxel = [0.5, 0.75, 2.0]
    factors = [[1, 1, 1], [2, 2, 2], [4, 4, 4]]
    how = pick(random, ["group", "own", "scales"])
    of_group = {"group": {"downsamplingFactors": factors}, "scales": {"scales": factors}, "own": {}}[how]
    attributes(os.path.join(path, "em"), **of_group, pixelResolution={"unit": "um", "dimensions": voxel})
    level = values(random, [side + 4 for side in sides(random, "zyx")], pick(random, TYPES))
    expected = []
    for i, factor in enumerate(factors):
        expected.append(level)
        name = os.path.join(path, "em", f"s{i}")
        write(name, level, chunks(random, level.shape), CODECS[pick(random, list(CODECS))])
        if how == "own":
            attributes(name, downsamplingFactors=factor)
        level = halved(level)
    spacing = [[v * f for v, f in zip(voxel, factor)] for factor in factors]
    origin = [[v * (f - 1) / 2 for v, f in zip(voxel, factor)] for factor in factors]
    return Case(f"levels, factors by {how}", with_options(path, array="em"), expected, spacing, origin)


def views(folder, random, number):
    path = os.path.join(folder, f"views-{number}.n5")
    attributes(path, n5="2.5.1")
    setups, times = int(random.integers(1, 3)), int(random.integers(1, 3))
    setup, time = int(random.integers(setups)), int(random.integers(times))
    expected = []
    for s in range(setups):
        attributes(os.path.join(path, f"setup{s}"), downsamplingFactors=[[1, 1, 1], [2, 2, 2]], dataType="uint16")
        for t in range(times):
            group = os.path.join(path, f"setup{s}", f"timepoint{t}")
            attributes(group, multiScale=True, resolution=[1, 1, 1])
            level = values(random, sides(random, "zyx"), "uint16")
            for i in range(2):
                write(os.path.join(group, f"s{i}"), level, chunks(random, level.shape), CODECS["gzip"])
                if (s, t) == (setup, time):
                    expected.append(level)
                level = halved(level)
    options = {"channel": setup if setup > 0 else None, "time": time if times > 1 else None}
    return Case(f"views: {setups} setups, {times} times", with_options(path, **options), expected)


def refused(folder, random):
    path = os.path.join(folder, "refused.n5")
    attributes(path, n5="2.5.1")
    write(os.path.join(path, "raw"), values(random, (8, 8, 8), "uint8"), (8, 8, 8), CODECS["raw"])
    described = os.path.join(path, "raw", "attributes.json")
    with open(described) as file:
        said = json.load(file)
    with open(described, "w") as file:
        json.dump({**said, "compression": {"type": "zfp"}}, file)
    yield Case("an unknown compression is refused", with_options(path, array="raw"), [], refused="zfp")


def cases(folder, random, count):
    yield from one_of_each(single, folder, random, count, codec=CODECS, dtype=TYPES)
    for number in range(6):
        yield levels(folder, random, number)
        yield views(folder, random, number)
    yield from refused(folder, random)
