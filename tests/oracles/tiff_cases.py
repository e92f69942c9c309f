"""TIFF, BigTIFF and OME-TIFF by tifffile and imagecodecs: strips and tiles, with smaller pictures as levels."""
import os

import numpy as np
import tifffile

from case import TYPES, Case, pick, sides, values, volume, with_options

COMPRESSIONS = [None, "deflate", "lzw", "packbits", "zstd", "lzma"]


def stack(folder, random, number, dtype=None, compression="any", subifds=None):
    dtype = np.dtype(dtype or pick(random, TYPES))
    compression = pick(random, COMPRESSIONS) if compression == "any" else compression
    shape = [side + 1 for side in sides(random, "zyx")]
    tiled, big, order = random.random() < 0.6, random.random() < 0.5, pick(random, "<>")
    predicts = dtype.kind == "f" or dtype.itemsize < 8  # tifffile
    predictor = predicts and compression in ("deflate", "lzw", "zstd", "lzma") and random.random() < 0.5
    layout = {"rowsperstrip": int(random.integers(1, shape[1] + 1))}
    if tiled:
        layout = {"tile": tuple(int(16 * random.integers(1, 3)) for _ in range(2))}
    subifds = int(random.integers(0, 3)) if subifds is None else subifds
    levels = [values(random, shape, dtype)]
    for _ in range(subifds):
        levels.append(levels[-1][:, ::2, ::2])
    subifds = len([level for level in levels[1:] if min(level.shape) > 0 and level.shape != levels[0].shape])
    path = os.path.join(folder, f"{number}.tif")
    common = dict(photometric="minisblack", compression=compression, predictor=predictor, **layout)
    with tifffile.TiffWriter(path, bigtiff=big, byteorder=order) as tiff:
        for z in range(shape[0]):
            tiff.write(levels[0][z], subifds=subifds, metadata=None, **common)
            for level in levels[1:1 + subifds]:
                tiff.write(level[z], subfiletype=1, metadata=None, **common)
    packing = f"{compression}{'+predictor' if predictor else ''}"
    name = f"{packing} {dtype} '{order}' {'tiles' if tiled else 'strips'} {'Big' if big else ''}TIFF, {subifds} smaller"
    return Case(name, path, levels[:1 + subifds])


def ome(folder, random, number):
    axes = pick(random, ["TCZYX", "TZCYX", "CTZYX", "ZTCYX"])
    shape = [int(random.integers(2, 5)) if axis in "TCZ" else int(random.integers(17, 60)) for axis in axes]
    data = values(random, shape, pick(random, ["uint8", "uint16", "float32"]))
    path = os.path.join(folder, f"{number}.ome.tif")
    tifffile.imwrite(path, data, ome=True, bigtiff=random.random() < 0.5, tile=(16, 32), photometric="minisblack", compression="deflate",
                     metadata={"axes": axes, "PhysicalSizeX": 0.25, "PhysicalSizeY": 0.5, "PhysicalSizeZ": 2.0,
                               "Channel": {"Name": [f"dye {c}" for c in range(shape[axes.index("C")])]}})
    time, channel = (int(random.integers(shape[axes.index(axis)])) for axis in "TC")
    options = {"time": time, "channel": channel if channel > 0 else None}
    expected = volume(data, axes.lower(), time, channel)
    return Case(f"OME-TIFF {axes} {data.dtype}", with_options(path, **options), [expected], [[0.25, 0.5, 2.0]])


def cases(folder, random, count):
    number = iter(range(1 << 30))
    for compression in COMPRESSIONS:
        for subifds in (0, 2):
            yield stack(folder, random, next(number), compression=compression, subifds=subifds)
    for dtype in TYPES:
        yield stack(folder, random, next(number), dtype=dtype)
    for _ in range(count // 2):
        yield stack(folder, random, next(number))
    for _ in range(8):
        yield ome(folder, random, next(number))
