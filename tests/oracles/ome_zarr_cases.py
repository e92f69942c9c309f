"""Images of OME-Zarr 0.4 and 0.5: by ome-zarr, and with axes in any order by zarr-python and metadata of our own."""
import os

import numpy as np
import zarr
from ome_zarr.format import FormatV04, FormatV05
from ome_zarr.writer import write_labels, write_multiscale

from case import Case, chosen, chunks, halved, order, pick, sides, values, volume, with_options

SPACE = {"type": "space", "unit": "micrometer"}


def axis_metadata(axes):
    kinds = {"t": {"type": "time", "unit": "second"}, "c": {"type": "channel"}}
    return [{"name": axis, **kinds.get(axis, SPACE)} for axis in axes]


def pyramid(random, axes, dtype):
    finest = values(random, [side + (8 if axis in "xyz" else 0) for axis, side in zip(axes, sides(random, axes))], dtype)
    levels = [finest]
    for _ in range(2):
        step = tuple(slice(None, None, 2) if axis in "zyx" else slice(None) for axis in axes)
        levels.append(levels[-1][step])
    return levels


def placed(random, axes, count):
    """A scale and a translation of each level, as lists along the axes and as x, y, z."""
    base = {axis: float(random.choice([0.25, 0.5, 1.5])) if axis in "zyx" else 1.0 for axis in axes}
    scales, shifts = [], []
    for level in range(count):
        scales.append({axis: base[axis] * (2 ** level if axis in "zyx" else 1) for axis in axes})
        shifts.append({axis: base[axis] * (2 ** level - 1) / 2 if axis in "zyx" else 0.0 for axis in axes})
    def along(table, missing):
        return [[row.get(axis, missing) for axis in "xyz"] for row in table]
    transforms = [[{"type": "scale", "scale": [scale[axis] for axis in axes]},
                   {"type": "translation", "translation": [shift[axis] for axis in axes]}] for scale, shift in zip(scales, shifts)]
    # Without an axis z a voxel is as thick as it is wide.
    spacing = [[s.get("x"), s.get("y"), s.get("z", base["x"])] for s in scales]
    return transforms, spacing, along(shifts, 0.0)


def by_ome_zarr(folder, random, number, version, axes):
    levels = pyramid(random, axes, pick(random, ["uint8", "uint16", "int16", "float32"]))
    transforms, spacing, origin = placed(random, axes, len(levels))
    path = os.path.join(folder, f"ome-{number}.ome.zarr")
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    options = {"chunks": tuple(chunks(random, levels[0].shape))}
    write_multiscale(levels, group=group, fmt=FormatV04() if version == "0.4" else FormatV05(), axes=axis_metadata(axes),
                     coordinate_transformations=transforms, storage_options=options)
    _, taken = chosen(random, levels[0], axes)
    expected = [volume(level, axes, taken["time"] or 0, taken["channel"] or 0) for level in levels]
    return Case(f"ome-zarr {version} {axes} {levels[0].dtype}", with_options(path, **taken), expected, spacing, origin)


def by_hand(folder, random, number, version, layout):
    axes = order(random, layout)
    levels = pyramid(random, axes, pick(random, ["uint8", "uint16", "int32", "float32"]))
    transforms, spacing, origin = placed(random, axes, len(levels))
    path = os.path.join(folder, f"hand-{number}.ome.zarr")
    zarr_format = 2 if version == "0.4" else 3
    group = zarr.open_group(path, mode="w", zarr_format=zarr_format)
    for i, level in enumerate(levels):
        chunk = chunks(random, level.shape)
        shard = [side * int(random.integers(1, 3)) for side in chunk] if zarr_format == 3 and random.random() < 0.7 else None
        group.create_array(f"s{i}", shape=level.shape, chunks=tuple(chunk), shards=shard and tuple(shard), dtype=level.dtype)[...] = level
    image = {"axes": axis_metadata(axes), "datasets": [{"path": f"s{i}", "coordinateTransformations": t} for i, t in enumerate(transforms)]}
    if version == "0.4":
        group.attrs["multiscales"] = [{"version": version, **image}]
    else:
        group.attrs["ome"] = {"version": version, "multiscales": [image]}
    _, taken = chosen(random, levels[0], axes)
    expected = [volume(level, axes, taken["time"] or 0, taken["channel"] or 0) for level in levels]
    return Case(f"OME-Zarr {version} by hand, {axes} {levels[0].dtype}", with_options(path, **taken), expected, spacing, origin)


def labels(folder, random, number, version):
    path = os.path.join(folder, f"labels-{number}.ome.zarr")
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    fmt = FormatV04() if version == "0.4" else FormatV05()
    image = values(random, (12, 20, 24), "uint16")
    write_multiscale([image, halved(image)], group=group, fmt=fmt, axes="zyx")
    cells = random.integers(0, 5, (12, 20, 24)).astype("uint8")
    write_labels(cells, group=group, name="cells", axes="zyx", fmt=fmt)
    path = os.path.join(path, "labels", "cells")
    written = zarr.open_group(path, mode="r")
    told = (written.attrs if version == "0.4" else written.attrs["ome"])["multiscales"][0]["datasets"]  # whose voxels are ome-zarr's affair
    return Case(f"labels of ome-zarr {version}", path, [written[level["path"]][...] for level in told])


def cases(folder, random, count):
    number = iter(range(1 << 30))
    for version in ("0.4", "0.5"):
        for axes in ("yx", "zyx", "cyx", "tyx", "czyx", "tzyx", "tczyx"):
            yield by_ome_zarr(folder, random, next(number), version, axes)
            yield by_hand(folder, random, next(number), version, axes)
        for _ in range(count // 4):
            yield by_hand(folder, random, next(number), version, pick(random, ["zyx", "czyx", "tzyx", "tczyx"]))
        yield labels(folder, random, next(number), version)
