"""HDF5 and netCDF files that state their geometry: MINC of nibabel's tests, netCDF by h5py's dimension scales and by Unidata's library,
ilastik's axes."""
import glob
import json
import os

import h5py
import netCDF4
import nibabel
import numpy as np

from case import Case, samples, scaled


def minc():
    data = os.path.join(os.path.dirname(nibabel.__file__), "tests", "data")
    for path in sorted(glob.glob(data + "/*.mnc")):
        try:
            image = nibabel.load(path)
        except Exception:
            continue
        if isinstance(image, nibabel.minc1.Minc1Image) and len(image.shape) == 3:  # so are those of MINC 2
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


def unidata(random, folder, number):
    """As the netCDF library writes and reads it: packed, with missing values, records beside those of other variables, axes either way,
    and cells that bounds tell, with coordinates anywhere."""
    kind = ["NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4"][number % 4]
    types = ["i1", "i2", "f4", "f8"] + ["u1", "u2"] * (number % 4 > 1)
    dtype = np.dtype(types[random.integers(len(types))])
    path = os.path.join(folder, f"u{number}.nc")
    sizes = {"time": int(random.integers(1, 4)), "depth": int(random.integers(1, 5)), "lat": 5, "lon": int(random.integers(2, 8))}
    step, first = random.uniform(0.5, 3, 3) * random.choice([-1, 1], 3), random.normal(scale=10, size=3)
    step[2] = abs(step[2]) if sizes["depth"] == 1 else step[2]
    at = int(random.integers(sizes["time"]))
    with netCDF4.Dataset(path, "w", format=kind) as file:
        for name, size in sizes.items():
            file.createDimension(name, None if name == "time" and random.random() < 0.7 else size)
        time = file.createVariable("time", "f8", ("time",))
        time.units = "hours since 1900-01-01"
        time[:] = 6.0 * np.arange(sizes["time"])
        file.createDimension("nv", 2)
        for axis, name in enumerate(["lon", "lat", "depth"]):
            centres = first[axis] + step[axis] * np.arange(sizes[name])
            coordinates = file.createVariable(name, "f8", (name,))
            coordinates[:] = centres
            if sizes[name] == 1 or random.random() < 0.5:
                coordinates.bounds = name + "_bnds"
                coordinates[:] = centres + step[axis] * (random.uniform(-3, 3) + random.uniform(-0.4, 0.4, sizes[name]))
                file.createVariable(coordinates.bounds, "f8", (name, "nv"))[:] = np.stack([centres - step[axis] / 2, centres + step[axis] / 2], 1)
        file["lat"].units, file["lon"].units, file["depth"].axis = "degrees_north", "degrees_east", "Z"
        data = file.createVariable("v", dtype, tuple(sizes), fill_value=dtype.type(7))
        if random.random() < 0.5:
            data.scale_factor, data.add_offset = 0.25, -3.0
        if random.random() < 0.7:
            file.createVariable("mask", "i1", ("time", "lon"))[:] = np.zeros((sizes["time"], sizes["lon"]))
        stored = samples(random, tuple(sizes.values()), dtype)
        stored[random.random(stored.shape) < 0.1] = 7
        data.set_auto_maskandscale(False)
        data[:] = stored
    with netCDF4.Dataset(path) as file:
        voxels = np.ma.filled(file["v"][at].astype(np.float64), np.nan)
    affine = scaled(step, first)
    return Case(f"{kind} {number} {dtype}", path, voxels.transpose(2, 1, 0), affine, f"dataset=v,time={at}")


def cases(random, folder, count, skipped):
    yield from minc()
    for number in range(count):
        yield ilastik(random, folder, number)
        yield netcdf(random, folder, number)
        yield unidata(random, folder, number)
