"""What a dataset holds: its histogram, and the voxels at points."""
from __future__ import annotations

import dataclasses
from typing import Any

import numpy
import numpy.typing

from . import schema

Vector = tuple[float, float, float]
_JOINT_VALUES, _JOINT_SLOPES = 128, 64
_MILLILITRES = {"millimetre": 1e-3, "centimetre": 1.0, "metre": 1e6}  # of a cube with this side
_CUBES = {"micrometre": "\u00b5m^3", "nanometre": "nm^3", "angstrom": "\u00c5^3"}


@dataclasses.dataclass(frozen=True)
class Histogram:
    """Of the finite voxels of a dataset, in equal bins."""

    value_range: tuple[float, float]
    counts: numpy.typing.NDArray[numpy.int64]   # voxels by bin
    edges: numpy.typing.NDArray[numpy.float64]  # one more than bins, as numpy.histogram gives them
    percentiles: dict[float, float]             # values that so many percent of the voxels do not exceed, to within a bin
    non_finite: int                             # voxels that count nowhere


@dataclasses.dataclass(frozen=True)
class JointHistogram:
    """How many voxels of a dataset have which value together with which slope: the gradient's magnitude, in data values per unit of the
    world."""

    counts: numpy.typing.NDArray[numpy.int64]          # [value, slope]; at most some 2 million voxels, evenly spread
    value_edges: numpy.typing.NDArray[numpy.float64]   # one more than counts has rows
    slope_edges: numpy.typing.NDArray[numpy.float64]   # one more than counts has columns; their square roots lie at equal distances


@dataclasses.dataclass(frozen=True)
class Label:
    """A label that a dataset holds."""

    value: int                         # as in the file, from 1
    name: str                          # "": none is known
    color: tuple[float, float, float]  # straight red, green, blue, from 0 to 1


@dataclasses.dataclass(frozen=True)
class LabelStatistics:
    """The voxels of a label. What follows `voxels` is None if no voxel is finite."""

    label: Label
    volume: float            # in `unit`
    unit: str                # "ml" if the world's unit is mm, cm or m; else the unit cubed, such as "\u00b5m^3"
    voxels: int              # finite ones
    non_finite: int          # the others
    mean: float | None
    deviation: float | None  # standard deviation: the root of the mean squared difference from the mean
    least: float | None
    largest: float | None


@dataclasses.dataclass(frozen=True)
class Sample:
    """The voxel that holds a point."""

    at: Vector                          # the point: x, y, z of the world
    index: tuple[int, int, int] | None  # of the voxel, as arrays have it: z, y, x; None: the point is on a shape outside the volume
    value: float | int | None           # None: it is not finite, or there is no voxel; int: a whole number that float rounds
    label: int | None = None            # as in the file; 0: none; None: the dataset has no labels
    label_name: str = ""
    # The name and the value of each field that was asked for, or that the picture shows. None: there is no value here.
    fields: tuple[tuple[str, float | None], ...] = ()
    depth: float | None = None          # of a point that was picked: as depths of the picture's pixels
    # Of a point that was picked on a shape; None: the picture shows the volume there.
    shape: str | None = None            # its name; of a plane "plane"
    shape_number: int | None = None     # among the picture's shapes, with planes behind them
    shape_value: float | None = None    # that it shows there, interpolated; None: it has no values


def histogram_of(message: Any) -> Histogram:
    low, high = message.range.min, message.range.max
    counts = numpy.array(message.histogram, dtype=numpy.int64)
    return Histogram(
        value_range=(low, high),
        counts=counts,
        edges=numpy.linspace(low, high, counts.size + 1),
        percentiles={each.percent: each.value for each in message.percentiles},
        non_finite=message.non_finite,
    )


def joint_histogram_of(message: Any) -> JointHistogram:
    counts = numpy.array(message.counts, dtype=numpy.int64).reshape(_JOINT_VALUES, _JOINT_SLOPES)
    return JointHistogram(
        counts=counts,
        value_edges=numpy.linspace(message.range.min, message.range.max, _JOINT_VALUES + 1),
        slope_edges=message.steepest * numpy.linspace(0, 1, _JOINT_SLOPES + 1) ** 2,
    )


def _label_of(message: Any) -> Label:
    return Label(message.value, message.name, (message.red, message.green, message.blue))


def labels_of(message: Any) -> list[Label]:
    return list(map(_label_of, message.labels))


def label_statistics_of(message: Any) -> list[LabelStatistics]:
    spacing, orientation = schema.xyz(message.description.spacing), message.description.orientation
    length = schema.word(orientation, "unit", "millimetre" if orientation.world == schema.WORLD_PATIENT else "")
    cubed = spacing[0] * spacing[1] * spacing[2]
    if length in _MILLILITRES:
        unit, voxel = "ml", cubed * _MILLILITRES[length]
    else:
        bare = orientation.world in (0, schema.WORLD_VOXELS) and spacing == (1, 1, 1)
        unit, voxel = _CUBES.get(length, "voxels^3" if bare else "units^3"), cubed
    found = []
    for each in message.labels:
        numbers = (each.mean, each.deviation, each.least, each.largest) if each.voxels else (None,) * 4
        volume = (each.voxels + each.non_finite) * voxel
        found.append(LabelStatistics(_label_of(each.label), volume, unit, each.voxels, each.non_finite, *numbers))
    return found


def sample_of(message: Any, depth: float | None = None) -> Sample | None:
    """None: the point lies outside the volume."""
    if not message.inside:
        return None
    labelled = message.HasField("label")
    return Sample(
        at=schema.xyz(message.at),
        index=schema.zyx(message.voxel),
        value=None if not message.HasField("value") else int(message.value) + message.rest if message.rest else message.value,
        label=message.label.value if labelled else None,
        label_name=message.label.name if labelled else "",
        fields=tuple((each.name, each.value if each.HasField("value") else None) for each in message.fields),
        depth=depth,
    )


def picked_of(reply: Any, frame: Any) -> Sample | None:
    """The answer to a PickQuery about this frame. None: the pixel shows nothing."""
    if not reply.HasField("sample"):
        return None
    sample = sample_of(reply.sample, reply.depth)
    if not reply.HasField("shape"):
        return sample
    number = reply.shape
    return dataclasses.replace(
        sample or Sample(at=schema.xyz(reply.sample.at), index=None, value=None, depth=reply.depth),
        shape=frame.shapes[number].shape if number < len(frame.shapes) else "plane",
        shape_number=number,
        shape_value=reply.value if reply.HasField("value") else None,
    )
