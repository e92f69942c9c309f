"""What `slabstream convert` writes, zarr-python and TensorStore read: voxels of all levels; and its metadata fit the specification."""
import os
import subprocess

import numpy as np
import ome_zarr_models
import tensorstore
import zarr

from case import pick, values
from precomputed_cases import write_scale

TYPES = ["uint8", "int8", "uint16", "int16", "float32"]


def reduced(level, shape, labels):
    """The next level of this shape: means, halves away from zero; of labels the most frequent one, and the smallest of several."""
    steps = [2 if coarse < fine else 1 for fine, coarse in zip(level.shape, shape)]
    padding = [(0, coarse * step - fine) for fine, coarse, step in zip(level.shape, shape, steps)]
    split = [n for coarse, step in zip(shape, steps) for n in (coarse, step)]
    def parts(array, fill):
        return np.pad(array, padding, constant_values=fill).reshape(split).transpose(0, 2, 4, 1, 3, 5).reshape(*shape, -1)
    there = parts(np.ones(level.shape, bool), False)
    voxels = parts(level, 0)
    if labels:
        times = ((voxels[..., :, None] == voxels[..., None, :]) & there[..., None, :]).sum(-1)
        best = np.where(there, times, -1) == np.where(there, times, -1).max(-1, keepdims=True)
        return np.where(best, voxels, np.iinfo(level.dtype).max).min(-1).astype(level.dtype)
    if level.dtype.kind == "f":
        return (np.where(there, voxels, 0).astype("float64").sum(-1) / there.sum(-1)).astype(level.dtype)
    total, count = np.where(there, voxels.astype("int64"), 0).sum(-1), there.sum(-1)
    return (np.sign(total) * ((np.abs(total) + count // 2) // count)).astype(level.dtype)


def read_tensorstore(path, driver):
    return np.asarray(tensorstore.open({"driver": driver, "kvstore": {"driver": "file", "path": path}}).result().read().result())


def check(path, version, data, labels=False):
    """What is wrong; none: nothing."""
    model = ome_zarr_models.open_ome_zarr(zarr.open_group(path, mode="r"))
    image = model.attributes.ome.multiscales[0] if version == "0.5" else model.attributes.multiscales[0]
    expected = data
    for number, dataset in enumerate(image.datasets):
        array = os.path.join(path, dataset.path)
        stored = zarr.open_array(array, mode="r")
        if number > 0:
            expected = reduced(expected, stored.shape, labels)
        if stored.shape != expected.shape or stored.dtype != expected.dtype:
            return f"level {number} is {stored.shape} {stored.dtype}, must be {expected.shape} {expected.dtype}"
        for reader, voxels in (("zarr", stored[...]), ("tensorstore", read_tensorstore(array, "zarr3" if version == "0.5" else "zarr"))):
            if not np.array_equal(voxels, expected):
                return f"level {number} as {reader} reads it differs in {np.count_nonzero(voxels != expected)} voxels"
    if max(expected.shape) > 64:
        return f"the last level is {expected.shape}, which is more than a chunk"
    return None


def convert(program, source, path, version, *options):
    command = [program, "convert", source, path, "--zarr-version", version, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return None if done.returncode == 0 else done.stderr.strip()


def cases(program, folder, random):
    """Pairs of a name and what is wrong with it."""
    shapes = [(70, 90, 300), (1, 130, 65), (64, 64, 64), (129, 257, 66), (5, 6, 7)]
    for version in ("0.4", "0.5"):
        for number, dtype in enumerate(TYPES):
            data = values(random, shapes[number], dtype)
            source, path = os.path.join(folder, f"{dtype}-{version}.npy"), os.path.join(folder, f"{dtype}-{version}.ome.zarr")
            np.save(source, data)
            spacing = pick(random, [["--spacing", "1,1,1"], ["--spacing", "0.5,0.5,2"], ["--spacing", "3,1,1"]])
            name = f"convert {dtype} {data.shape} to {version} {' '.join(spacing)}"
            memory = ["--memory", pick(random, ["256M", "1G"])]
            yield name, convert(program, source, path, version, *memory, *spacing) or check(path, version, data)
        labels = random.integers(0, 6, (40, 80, 150)).astype("uint32")
        source, path = os.path.join(folder, f"labels-{version}"), os.path.join(folder, f"labels-{version}.ome.zarr")
        write_scale(source, labels.transpose(2, 1, 0)[..., None], [32, 32, 32], [4, 4, 4], [0, 0, 0], "raw", False, "segmentation", random)
        yield f"convert labels to {version}", convert(program, source, path, version) or check(path, version, labels, labels=True)
