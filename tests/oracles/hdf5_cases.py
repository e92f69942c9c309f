"""HDF5 by h5py and hdf5plugin: any dataset, and the layouts of Imaris and BigDataViewer."""
import os

import h5py
import hdf5plugin
import numpy as np

from case import TYPES, Case, chunks, fill_value, halved, one_of_each, pick, sides, sparse, values, with_options

FILTERS = {
    "none": {}, "gzip": {"compression": "gzip"}, "gzip9+shuffle": {"compression": "gzip", "compression_opts": 9, "shuffle": True},
    "shuffle": {"shuffle": True}, "fletcher32": {"fletcher32": True}, "lzf": {"compression": "lzf"},
    "lzf+shuffle+fletcher32": {"compression": "lzf", "shuffle": True, "fletcher32": True},
    "zstd": dict(hdf5plugin.Zstd()), "lz4": dict(hdf5plugin.LZ4()), "bzip2": dict(hdf5plugin.BZip2()),
    **{f"bitshuffle-{inner}": dict(hdf5plugin.Bitshuffle(cname=inner)) for inner in ("none", "lz4", "zstd")},
    **{f"blosc-{inner}-{shuffle}": dict(hdf5plugin.Blosc(cname=inner, shuffle=shuffle))
       for inner in ("blosclz", "lz4", "lz4hc", "zlib", "zstd") for shuffle in (0, 1, 2)},
}
REFUSED = {"blosc2": dict(hdf5plugin.Blosc2()), "szip": {"compression": "szip"}}


def plain(folder, random, number, filters=None, dtype=None):
    filters = filters or pick(random, list(FILTERS))
    dtype = np.dtype(dtype or pick(random, TYPES)).newbyteorder(pick(random, "<>"))
    axes = pick(random, ["zyx", "zyx", "tzyx"])
    shape, fill = sides(random, axes), fill_value(random, dtype)
    data = sparse(random, shape, dtype, fill)
    version = pick(random, ["earliest", "v110"])
    path = os.path.join(folder, f"plain-{number}.h5")
    chunk = tuple(min(c, s) for c, s in zip(chunks(random, shape), shape)) if filters != "none" or random.random() < 0.7 else None
    layout = "chunks" if chunk else "one piece"
    with h5py.File(path, "w", libver=(version, "v110")) as file:
        growing = {"maxshape": (None,) * len(shape)} if chunk and random.random() < 0.3 else {}
        dataset = file.create_dataset("group/data", shape, dtype, chunks=chunk, fillvalue=fill, **growing, **FILTERS[filters])
        where = np.argwhere(~(data == fill))
        if len(where):  # nothing is written outside of it
            box = tuple(slice(int(a), int(b) + 1) for a, b in zip(where.min(0), where.max(0)))
            dataset[box] = data[box]
    time = int(random.integers(shape[0])) if axes[0] == "t" else None
    return Case(f"{filters} {dtype.str} {axes} {layout} libver {version}", with_options(path, dataset="/group/data", time=time),
                [data if time is None else data[time]])


def refused(folder):
    path = os.path.join(folder, "new.h5")
    with h5py.File(path, "w", libver="latest") as file:
        file.create_dataset("data", data=np.zeros((8, 8, 8), "uint16"), chunks=(4, 4, 4), compression="gzip")
    if h5py.version.hdf5_version_tuple[0] >= 2:
        yield Case("what only a newer libhdf5 reads is refused", with_options(path, dataset="data"), [], refused="came after HDF5")
    for name, filters in REFUSED.items():
        path = os.path.join(folder, f"refused-{name}.h5")
        try:
            with h5py.File(path, "w") as file:
                file.create_dataset("data", data=np.zeros((8, 8, 8), "uint16"), chunks=(8, 8, 8), **filters)
        except ValueError:
            continue  # this h5py has no such filter
        yield Case(f"{name} is refused", path, [], refused="is not supported")


def text_attributes(target, **attributes):
    for name, value in attributes.items():
        target.attrs[name] = np.frombuffer(str(value).encode(), dtype="S1")


def imaris(folder, random, number):
    """Datasets are padded to whole chunks; attributes tell the image."""
    path = os.path.join(folder, f"imaris-{number}.ims")
    channels, times, dtype = int(random.integers(1, 4)), int(random.integers(1, 3)), pick(random, ["uint8", "uint16", "uint32", "float32"])
    finest = sides(random, "zyx")
    channel, time = int(random.integers(channels)), int(random.integers(times))
    extent = [float(random.integers(1, 50)) for _ in range(3)]  # of x, y, z
    expected = []
    with h5py.File(path, "w") as file:
        for level in range(3):
            shape = [-(-side // 2 ** level) for side in finest]
            for t in range(times):
                for c in range(channels):
                    chunk = [min(side, 8) for side in shape]
                    padded = [-(-side // piece) * piece for side, piece in zip(shape, chunk)]
                    data = values(random, padded, dtype)
                    group = file.create_group(f"DataSet/ResolutionLevel {level}/TimePoint {t}/Channel {c}")
                    group.create_dataset("Data", data=data, chunks=tuple(chunk), compression="gzip")
                    text_attributes(group, **{f"ImageSize{axis}": side for axis, side in zip("ZYX", shape)})
                    if (c, t) == (channel, time):
                        expected.append(data[tuple(slice(side) for side in shape)])
        image = file.create_group("DataSetInfo/Image")
        text_attributes(image, Unit="um", **{axis: side for axis, side in zip("ZYX", finest)},
                        **{f"ExtMin{i}": -5 for i in range(3)}, **{f"ExtMax{i}": extent[i] - 5 for i in range(3)})
        for c in range(channels):
            text_attributes(file.create_group(f"DataSetInfo/Channel {c}"), Name=f"dye {c}")
    spacing = [[extent[i] / level.shape[2 - i] for i in range(3)] for level in expected]
    origin = [[-5 + step / 2 for step in level] for level in spacing]
    options = {"channel": channel if channel > 0 else None, "time": time if times > 1 else None}
    return Case(f"Imaris {dtype}, {channels} channels, {times} times", with_options(path, **options), expected, spacing, origin)


def big_data_viewer(folder, random, number):
    path = os.path.join(folder, f"bdv-{number}.h5")
    setups, times = int(random.integers(1, 3)), int(random.integers(1, 3))
    setup, time = int(random.integers(setups)), int(random.integers(times))
    voxel = [float(random.choice([0.5, 1.25])) for _ in range(3)]  # x, y, z
    expected = []
    with h5py.File(path, "w") as file:
        for s in range(setups):
            file[f"s{s:02}/resolutions"] = np.array([[1, 1, 1], [2, 2, 2]], "float64")
            file[f"s{s:02}/subdivisions"] = np.array([[8, 8, 8], [8, 8, 8]], "int32")
            for t in range(times):
                level = values(random, sides(random, "zyx"), "uint16")
                for number_of_level in range(2):
                    if number_of_level:
                        level = halved(level)
                    file.create_dataset(f"t{t:05}/s{s:02}/{number_of_level}/cells", data=np.ascontiguousarray(level).view("int16"),
                                        compression="gzip", chunks=tuple(min(8, side) for side in level.shape))
                    if (s, t) == (setup, time):
                        expected.append(level)
    with open(path[:-2] + "xml", "w", encoding="utf-8") as xml:
        one = "".join(f"<ViewSetup><id>{s}</id><name>view {s}</name><voxelSize><unit>um</unit><size>{voxel[0]} {voxel[1]} {voxel[2]}</size>"
                      "</voxelSize></ViewSetup>" for s in range(setups))
        xml.write(f"<SpimData><SequenceDescription><ViewSetups>{one}</ViewSetups></SequenceDescription></SpimData>")
    options = {"channel": setup if setup > 0 else None, "time": time if times > 1 else None}
    spacing = [voxel, [2 * side for side in voxel]]
    origin = [[0.0] * 3, [side / 2 for side in voxel]]
    return Case(f"BigDataViewer HDF5, {setups} setups, {times} times", with_options(path, **options), expected, spacing, origin)


def cases(folder, random, count):
    yield from one_of_each(plain, folder, random, count, filters=FILTERS, dtype=TYPES)
    for number in range(8):
        yield imaris(folder, random, number)
        yield big_data_viewer(folder, random, number)
    yield from refused(folder)
