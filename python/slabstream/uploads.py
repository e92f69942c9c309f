"""Volumes on their way to a service by its connection: an AddVolume, and the bytes that follow it.

Arrays are sent slab by slab, so that one which is computed or read by chunks is never in memory as a whole. The service wants voxels whose
axes run along those of the world: axes that run backwards are turned as they go; an array whose axes have another order is taken as a whole.
"""
from __future__ import annotations

import dataclasses
import itertools
from typing import Any, Iterator

import numpy

from . import schema
from .errors import InvalidArgument
from .requests import MOST_PART_BYTES
from .volumes import Volume, file_type_of, slabs_of

# How samples are stored, by the type that they have in files: the type on the wire, and what is added to get their values.
_STORED = {"uint8": ("UINT8", 0), "int8": ("UINT8", -128), "uint16": ("UINT16", 0), "int16": ("UINT16", -32768), "float32": ("FLOAT32", 0)}
_WORLDS = {"voxels": schema.WORLD_VOXELS, "scene": schema.WORLD_SCENE, "patient": schema.WORLD_PATIENT}
_MOST_LABELS = 4096
_RIGHT_ANGLES = 1e-3  # of unit vectors


@dataclasses.dataclass(frozen=True)
class _Placed:
    """A volume whose axes are to be turned so that they run along those of the world."""

    volume: Volume
    backwards: tuple[bool, bool, bool]  # the array's axes
    description: Any                    # VolumeDescription, but for type and values


def _place(volume: Volume) -> _Placed:
    grid = volume.grid
    steps, origin = numpy.array(grid.steps), numpy.array(grid.origin)  # steps[i]: of the voxels' axis i in x, y, z
    lengths = numpy.linalg.norm(steps, axis=1)
    if not lengths.all():
        raise InvalidArgument("the volume has an axis without length")
    units = steps / lengths[:, None]
    order = max(itertools.permutations(range(3)), key=lambda p: float(numpy.prod([abs(units[p[axis], axis]) for axis in range(3)])))
    samples = volume.samples
    if order != (0, 1, 2):
        samples = numpy.asanyarray(samples).transpose([2 - order[axis] for axis in (2, 1, 0)])
        volume = dataclasses.replace(volume, samples=samples)
    units, lengths = units[list(order)], lengths[list(order)]
    sizes = samples.shape[::-1]
    backwards = []
    for axis in range(3):
        backwards.append(bool(units[axis, axis] < 0))
        if backwards[axis]:
            origin = origin + (sizes[axis] - 1) * lengths[axis] * units[axis]
            units[axis] = -units[axis]
    if numpy.abs(units @ units.T - numpy.eye(3)).max() > _RIGHT_ANGLES or numpy.linalg.det(units) < 0:
        raise InvalidArgument("the axes of the volume are not at right angles: a file that slabstream reads is straightened, as add_data takes it")
    u, _, v = numpy.linalg.svd(units)
    axes = u @ v  # the nearest that are exactly at right angles
    vectors = [schema.Vec3(x=vector[0], y=vector[1], z=vector[2]) for vector in (lengths, origin, *axes)]
    about = schema.VolumeDescription(size=schema.Index3(x=sizes[0], y=sizes[1], z=sizes[2]), spacing=vectors[0])
    about.orientation.CopyFrom(
        schema.Orientation(world=_WORLDS[grid.world], origin=vectors[1], x_axis=vectors[2], y_axis=vectors[3], z_axis=vectors[4])
    )
    return _Placed(volume, (backwards[2], backwards[1], backwards[0]), about)


def _sent_type(volume: Volume) -> str:
    file_type = file_type_of(volume)
    return file_type if file_type in _STORED else "float32"


def _narrowed(volume: Volume) -> tuple[Volume, int]:
    """Whole numbers of 32 and 64 bits in memory that lie near each other, as the service keeps those of files: uint16, and what is added to
    them. It cannot be known of arrays that are computed as they are sent."""
    samples = volume.samples
    if file_type_of(volume) in _STORED or type(samples) is not numpy.ndarray:
        return volume, 0
    low, high = int(samples.min()), int(samples.max())
    if high - low > 65535 or max(abs(low), abs(high)) >= 2**53:
        return volume, 0
    shift = 0 if low >= 0 and high <= 65535 else low
    return dataclasses.replace(volume, samples=(samples - samples.dtype.type(shift)).astype(numpy.uint16)), shift


def _bytes_of(placed: _Placed) -> Iterator[memoryview]:
    turn = tuple(slice(None, None, -1 if backwards else 1) for backwards in placed.backwards)
    for slab in slabs_of(placed.volume, from_the_end=placed.backwards[0], file_type=_sent_type(placed.volume)):
        if slab.dtype.kind == "i":  # the least value is 0
            unsigned = f"<u{slab.dtype.itemsize}"
            slab = slab.view(unsigned) ^ numpy.array(1 << (8 * slab.dtype.itemsize - 1), unsigned)
        whole = numpy.ascontiguousarray(slab[turn]).data.cast("B")
        for begin in range(0, whole.nbytes, MOST_PART_BYTES):
            yield whole[begin : begin + MOST_PART_BYTES]


def _numbered(labels: Volume) -> tuple[Volume, list[int]]:
    """The number of each voxel's label, from 1, and the labels."""
    array = numpy.asarray(labels.samples)
    values = numpy.unique(array)
    if values.dtype.kind == "f" and not (values == numpy.floor(values)).all() or values.min() < 0:
        raise InvalidArgument(f"labels hold {values[-1]}, must be whole numbers of at least 0")
    known = values[values > 0]
    if len(known) > _MOST_LABELS:
        raise InvalidArgument(f"there are {len(known)} different labels, at most {_MOST_LABELS} are taken")
    numbers = numpy.where(array > 0, numpy.searchsorted(known, array) + 1, 0).astype(numpy.uint8 if len(known) < 256 else numpy.uint16)
    return dataclasses.replace(labels, samples=numbers), [int(value) for value in known]


def _check_grid(what: str, layer: Volume, volume: Volume) -> None:
    if tuple(layer.samples.shape) != tuple(volume.samples.shape) or layer.grid != volume.grid:
        raise InvalidArgument(f"{what} are not on the volume's grid: files on any grid are taken by add_data")


def upload_of(name: str, volume: Volume, labels: Volume | None, overlay: Volume | None) -> tuple[Any, Iterator[memoryview]]:
    """An AddVolume and its bytes. Nothing is computed before the bytes are asked for, but the labels."""
    narrowed, shift = _narrowed(volume)
    placed = _place(narrowed)
    order = schema.AddVolume(name=name, description=placed.description)
    kind, offset = _STORED[_sent_type(narrowed)]
    order.description.type = getattr(schema, f"SCALAR_TYPE_{kind}")
    order.description.scale, order.description.offset = 1, offset + shift
    layers = [placed]
    if labels is not None:
        _check_grid("labels", labels, volume)
        numbers, values = _numbered(labels)
        order.label_bytes = numbers.samples.dtype.itemsize
        order.labels.extend(schema.NewLabel(value=value) for value in values)
        layers.append(_place(numbers))
    if overlay is not None:
        _check_grid("overlay", overlay, volume)
        order.overlay = True
        layers.append(_place(Volume(_Floats(overlay.samples), overlay.grid, rounds=True)))
    return order, itertools.chain.from_iterable(map(_bytes_of, layers))


def _plain(samples: Any) -> Any:
    """Without a mask: what is masked is NaN."""
    array: Any = numpy.asanyarray(samples)
    if not isinstance(array, numpy.ma.MaskedArray):
        return array
    floats: Any = array.astype(numpy.float32)
    return floats.filled(numpy.nan)


class _Floats:
    """An array as float32, slab by slab."""

    dtype = numpy.dtype("<f4")

    def __init__(self, samples: Any):
        self._samples = samples
        self.shape = samples.shape
        self.chunks = getattr(samples, "chunks", None)

    def __getitem__(self, index: Any) -> Any:
        return _plain(self._samples[index]).astype(self.dtype)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return _plain(self._samples).astype(self.dtype)
