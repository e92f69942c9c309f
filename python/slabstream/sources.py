"""Volumes in files, read in parts by the program `slabstream`: open()."""
from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import tempfile
from typing import Any

import numpy
import numpy.typing

from .errors import InvalidArgument
from .loading import path_text
from .programs import find_program, run_program
from .volumes import Vector

Array = numpy.typing.NDArray[Any]


def _zyx(values: list[Any]) -> tuple[Any, Any, Any]:
    x, y, z = values
    return z, y, x


@dataclasses.dataclass(frozen=True)
class Level:
    """A level of a source: an array of z, y, x, of which parts are read when they are asked for, as level[10:20, :, 5]. It may be given to
    render(), and to whatever takes an array with shape, dtype and slices."""

    number: int                   # 0 is the finest
    shape: tuple[int, int, int]   # voxels along z, y, x
    spacing: Vector               # along z, y, x
    dtype: numpy.dtype[Any]       # of the file
    source: Source = dataclasses.field(repr=False, compare=False)

    ndim = 3

    @property
    def size(self) -> int:
        return self.shape[0] * self.shape[1] * self.shape[2]

    def __getitem__(self, index: Any) -> Any:
        parts = list(index) if isinstance(index, tuple) else [index]
        if parts.count(Ellipsis) > 1 or len(parts) - parts.count(Ellipsis) > 3:
            raise IndexError(f"{index!r} is not an index of three axes")
        if Ellipsis in parts:
            at = parts.index(Ellipsis)
            parts[at:at + 1] = [slice(None)] * (4 - len(parts))
        parts += [slice(None)] * (3 - len(parts))
        ranges: list[range] = []
        for part, length in zip(parts, self.shape):
            if isinstance(part, slice):
                ranges.append(range(length)[part])
            elif not -length <= int(part) < length:
                raise IndexError(f"index {part} is out of range for {length} voxels")
            else:
                ranges.append(range(int(part) % length, int(part) % length + 1))
        keeps: Any = tuple(slice(None, None, r.step) if isinstance(part, slice) else 0 for part, r in zip(parts, ranges))
        if not all(map(len, ranges)):
            return numpy.empty(tuple(map(len, ranges)), self.dtype)[keeps]
        box = tuple((min(r[0], r[-1]), max(r[0], r[-1]) + 1) for r in ranges)
        return self.source.read(self.number, box)[keeps]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return self.source.read(self.number).astype(dtype or self.dtype, copy=False)


class Source:
    """A volume in a file, of which nothing is in memory. Made by open()."""

    def __init__(self, path: str | os.PathLike[str]):
        self.path = path_text(path, "source")
        about = json.loads(run_program(find_program(), "info", self.path, "--json"))
        # A file of one level says of itself what others say of each.
        described = about.get("levels", [about])
        dtype = numpy.dtype(about["file_type"])
        self.format: str = about["format"]  # "OME-Zarr 0.5"
        self.unit: str = about["unit"]      # of spacings: "mm", "µm", ...; "voxel" or "unknown": the file states none
        self.levels: tuple[Level, ...] = tuple(
            Level(number, _zyx(level["size"]), _zyx(level["spacing"]), dtype, self) for number, level in enumerate(described)
        )
        channels: list[dict[str, Any]] = about.get("channels", [])
        self.channels: tuple[str, ...] = tuple(channel["name"] for channel in channels)  # none: there is one without a name
        self.times: int = about.get("times", 1)
        self.time_step: float | None = about.get("time_step")  # from a time to the next one, in `time_unit`; None: not known
        self.time_unit: str = about.get("time_unit", "")       # "s", "ms", ...; "": not known
        self.value_range: tuple[float, float] = (about["range"]["min"], about["range"]["max"])
        window = channels[about["channel"]]["window"] if channels else None  # that the file's author shows
        self.window: tuple[float, float] | None = (window["min"], window["max"]) if window else None

    def read(self, level: int = 0, box: Any = None) -> Array:
        """The values of a box of a level: z, y, x. `box` has (begin, end) along z, y and x, with None for the ends of the level; None: all."""
        bounds: list[Any] = [(None, None)] * 3 if box is None else list(box)
        if len(bounds) != 3 or any(len(ends) != 2 for ends in bounds):
            raise InvalidArgument(f"box {box!r} is not (begin, end) along z, y and x")
        text = ",".join(":".join("" if end is None else str(int(end)) for end in ends) for ends in reversed(bounds))
        with tempfile.TemporaryDirectory(prefix="slabstream-") as folder:
            file = pathlib.Path(folder) / "box.npy"
            run_program(find_program(), "convert", self.path, str(file), "--level", str(int(level)), "--box", text)
            values: Array = numpy.load(file)
            return values

    def __repr__(self) -> str:
        return f"<slabstream.Source {self.path}: {self.format}, {len(self.levels)} level{'s' if len(self.levels) > 1 else ''}>"


def open(path: str | os.PathLike[str]) -> Source:
    """A volume in a file, with its levels, channels and times. Options for reading stand behind a question mark: "scan.ome.zarr?channel=1".
    It says of large volumes what a coarse level or a sample tells of their values; voxels are read by Source.read and level[z, y, x]."""
    return Source(path)
