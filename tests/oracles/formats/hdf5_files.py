"""HDF5 files that state their geometry: MINC 2 of nibabel's tests, netCDF-4 by h5py's dimension scales, ilastik's axes."""
import glob
import json
import os

import h5py
import nibabel
import numpy as np

from case import Case, samples, scaled


def minc():
    data = os.path.join(os.path.dirname(nibabel.__file__), "tests", "data")
    for path in sorted(glob.glob(data + "/*.mnc")):
        try:
            image = nibabel.load(path)
        except Exception:  # MINC 1 that is no HDF5
            continue
        if isinstance(image, nibabel.minc2.Minc2Image) and len(image.shape) == 3:
            yield Case(os.path.basename(path), path, np.asarray(image.dataobj), image.affine)


def ilastik(random, folder, number):
    letters = "".join(random.permutation(list("tzyxc")))
    sizes = {"t": int(random.integers(1, 3)), "z": 5, "y": 4, "x": 3, "c": int(random.integers(1, 3))}
    voxels = samples(random, tuple(sizes[letter] for letter in letters), np.uint8)
    path = os.path.join(folder, f"i{number}.h5")
    with h5py.File(path, "w") as file:
        file["exported_data"] = voxels
        tags = [{"key": letter, "typeFlags": 1 if letter == "c" else 2, "resolution": 0, "description": ""} for letter in letters]
        file["exported_data"].attrs["axistags"] = json.dumps({"axes": tags})
    at = {letter: int(random.integers(sizes[letter])) for letter in "tc"}
    part = voxels.transpose([letters.index(letter) for letter in "tcxyz"])[at["t"], at["c"]]
    named = [f"time={at['t']}"] * (sizes["t"] > 1) + [f"channel={at['c']}"] * (sizes["c"] > 1)
    return Case(f"ilastik {number} {letters}", path, part, np.eye(4), ",".join(named))


def netcdf(random, folder, number):
    spacing, origin = random.uniform(0.5, 3, 3), random.normal(scale=10, size=3)
    stored = samples(random, (4, 5, 6), np.int16)
    path = os.path.join(folder, f"n{number}.nc")
    with h5py.File(path, "w") as file:
        data = file.create_dataset("density", data=stored)
        data.attrs["scale_factor"], data.attrs["add_offset"] = 0.25, 3.0
        for axis, letter in enumerate("zyx"):
            file[letter] = origin[2 - axis] + spacing[2 - axis] * np.arange(stored.shape[axis])
            file[letter].make_scale(letter)
            data.dims[axis].attach_scale(file[letter])
    return Case(f"netCDF {number}", path, stored.transpose(2, 1, 0) * 0.25 + 3.0, scaled(spacing, origin), "dataset=/density")


def cases(random, folder, count, skipped):
    yield from minc()
    for number in range(count):
        yield ilastik(random, folder, number)
        yield netcdf(random, folder, number)
