"""What the families of cases share: the case itself, and voxels to fill it with."""
import dataclasses

import numpy as np

INTEGERS = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64"]
TYPES = INTEGERS + ["float32", "float64"]


@dataclasses.dataclass
class Case:
    """A volume that an oracle wrote."""
    name: str
    source: str  # as users name it, with options
    levels: list  # arrays of z, y, x, the finest first
    spacing: list = None  # x, y, z of each level; None: not compared
    origin: list = None  # of the centre of the first voxel
    refused: str = ""  # what the error says instead; "": it is read


def one_of_each(write, folder, random, count, **choices):
    """A case by `write` for each choice of each argument, the others at random, and `count` cases that are random in all of them."""
    chosen = [{argument: choice} for argument, of_argument in choices.items() for choice in of_argument]
    for number, arguments in enumerate(chosen + count * [{}]):
        yield write(folder, random, number, **arguments)


def values(random, shape, dtype):
    """Half of them smooth, half noise, over the whole range of the type."""
    dtype = np.dtype(dtype)
    if dtype == bool:
        return random.integers(0, 2, shape).astype(bool)
    smooth = np.add.outer(np.arange(int(np.prod(shape[:-1], dtype=int))) % 50, np.arange(shape[-1])).reshape(shape)
    if dtype.kind == "f":
        return ((smooth if random.random() < 0.5 else random.normal(0, 1e6, shape)) * random.normal()).astype(dtype)
    least, most = np.iinfo(dtype).min, np.iinfo(dtype).max
    if random.random() < 0.5:
        return (smooth % min(most, 1000)).astype(dtype)
    return random.integers(least, most, shape, dtype=dtype.newbyteorder("="), endpoint=True).astype(dtype)


def fill_value(random, dtype):
    dtype = np.dtype(dtype)
    if dtype == bool:
        return bool(random.integers(2))
    if dtype.kind == "f":
        return float(random.choice([0, -1.5, np.nan, np.inf, 1e30]).astype(dtype))
    info = np.iinfo(dtype)
    return int(random.choice(np.array([0, 1, 77, info.min, info.max], dtype.newbyteorder("="))))


def sparse(random, shape, dtype, fill):
    """Values in some box, the fill value elsewhere, so that writers leave chunks out."""
    array = np.full(shape, fill, dtype)
    box = []
    for side in shape:
        begin = int(random.integers(0, side))
        box.append(slice(begin, int(random.integers(begin + 1, side + 1))))
    if random.random() < 0.6:
        box = [slice(None)] * len(shape)  # all of them
    array[tuple(box)] = values(random, array[tuple(box)].shape, dtype)
    return array


def sides(random, axes, most=40):
    """Of each axis of a text such as "tczyx": few times and channels."""
    return [int(random.integers(1, 4 if axis in "tc" else most)) for axis in axes]


def chunks(random, shape):
    """Up to six along an axis; sometimes longer than the array."""
    return [int(random.integers(max(1, side // 6), side // 2 + 4)) for side in shape]


def pick(random, choices):
    return choices[int(random.integers(len(choices)))]


def order(random, axes):
    return "".join(axes[i] for i in random.permutation(len(axes)))


def volume(array, axes, time=0, channel=0):
    """z, y, x of an array whose axes a text names."""
    at = {"t": time, "c": channel}
    array = array[tuple(at.get(axis, slice(None)) for axis in axes)]
    rest = [axis for axis in axes if axis not in "tc"]
    if "z" not in rest:
        array, rest = array[np.newaxis], ["z"] + rest
    return array.transpose([rest.index(axis) for axis in "zyx"])


def with_options(path, **options):
    told = ",".join(f"{name}={value}" for name, value in options.items() if value is not None)
    return f"{path}?{told}" if told else str(path)


def chosen(random, array, axes):
    """A time and a channel, and the options that take them; the first channel needs none."""
    time = int(random.integers(array.shape[axes.index("t")])) if "t" in axes else 0
    channel = int(random.integers(array.shape[axes.index("c")])) if "c" in axes else 0
    options = {"time": time if "t" in axes else None, "channel": channel if channel > 0 else None}
    return volume(array, axes, time, channel), options


def halved(array):
    """A coarser level, as writers of tests make it."""
    return array[tuple(slice(None, None, 2) for _ in array.shape)]
