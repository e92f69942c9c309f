"""TIFF: hyperstacks of ImageJ and OME-TIFF that tifffile writes, and types, predictors and compressions at random."""
import os

import numpy as np
import tifffile

from case import Case, samples, scaled


def hyperstack(random, folder, number):
    times, slices, channels = (int(n) for n in random.integers(1, 4, 3))
    slices += 1
    voxels = samples(random, (times, slices, channels, 6, 5), random.choice([np.uint8, np.uint16, np.float32]))
    path = os.path.join(folder, f"ij{number}.tif")
    spacing = random.uniform(0.1, 3, 2)
    tifffile.imwrite(path, voxels, imagej=True, resolution=(1 / spacing[0], 1 / spacing[0]), byteorder=random.choice(["<", ">"]),
                     metadata={"axes": "TZCYX", "spacing": spacing[1], "unit": "um"})
    time, channel = int(random.integers(times)), int(random.integers(channels))
    named = [f"time={time}"] * (times > 1) + [f"channel={channel}"] * (channels > 1)
    return Case(f"ImageJ {number} TZCYX {voxels.shape}", path, voxels[time, :, channel].transpose(2, 1, 0), scaled([spacing[0], spacing[0], spacing[1]]),
                ",".join(named))


def ome(random, folder, number):
    letters = "".join(random.permutation(list("TZC"))) + "YX"
    sizes = {"T": int(random.integers(1, 3)), "Z": int(random.integers(2, 5)), "C": int(random.integers(1, 4)), "Y": 6, "X": 5}
    voxels = samples(random, tuple(sizes[letter] for letter in letters), random.choice([np.uint8, np.uint16, np.int16, np.float32, np.uint32]))
    path = os.path.join(folder, f"o{number}.ome.tif")
    tifffile.imwrite(path, voxels, ome=True, photometric="minisblack", compression=random.choice(["zlib", "lzw", None]),
                     metadata={"axes": letters, "PhysicalSizeX": 0.5, "PhysicalSizeXUnit": "µm", "PhysicalSizeY": 500.0,
                               "PhysicalSizeYUnit": "nm", "PhysicalSizeZ": 2.0, "PhysicalSizeZUnit": "µm"})
    at = {letter: int(random.integers(sizes[letter])) for letter in "TC"}
    part = voxels.transpose([letters.index(letter) for letter in "TCZYX"])[at["T"], at["C"]]
    named = [f"time={at['T']}"] * (sizes["T"] > 1) + [f"channel={at['C']}"] * (sizes["C"] > 1)
    return Case(f"OME {number} {letters} {voxels.shape}", path, part.transpose(2, 1, 0), scaled([0.5, 0.5, 2]), ",".join(named))


def plain(random, folder, number):
    dtype = random.choice([np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.float16, np.float32, np.float64])
    voxels = samples(random, tuple(random.integers(2, 40, 3)), dtype)
    compression = random.choice([None, "zlib", "lzw", "zstd", "packbits"])
    packed = compression in ("zlib", "lzw", "zstd")
    options = {"compression": compression, "bigtiff": bool(random.integers(2)), "byteorder": random.choice(["<", ">"]),
               "predictor": packed and dtype is not np.float16 and bool(random.integers(2))}
    if random.integers(2):
        options["tile"] = (16, 16)
    path = os.path.join(folder, f"p{number}.tif")
    tifffile.imwrite(path, voxels, photometric="minisblack", **options)
    return Case(f"plain {number} {voxels.dtype} {options}", path, voxels.transpose(2, 1, 0), np.eye(4))


def cases(random, folder, count, skipped):
    for number in range(count):
        yield hyperstack(random, folder, number)
        yield ome(random, folder, number)
        yield plain(random, folder, number)
