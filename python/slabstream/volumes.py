"""Volumes as Python programs hold them, and how they get into a file that the service reads.

Arrays are z, y, x: array[z, y, x], as numpy has volumes in C order, and so are spacing, origin and directions. Taken are numpy arrays and
whatever has shape, dtype and slices like one (dask, zarr, h5py, memory maps), xarray.DataArray, images of nibabel, and datasets of pydicom.
None of these packages is needed: an object is known by its attributes. Arrays are written slab by slab, so that one which is computed or
read by chunks is never in memory as a whole.
"""
from __future__ import annotations

import dataclasses
import os
import pathlib
from typing import Any, Iterator, Sequence

import numpy

from .errors import InvalidArgument

Vector = tuple[float, float, float]

_MOST_SIDE = 65535
_SLAB_BYTES = 16 << 20
_EVEN = 1e-3  # part of a step by which steps may differ

# Types that are written as they are, and how NRRD calls them. The service makes uint8, uint16 or float32 of them, exactly.
_AS_THEY_ARE = {"uint8": "uint8", "int8": "int8", "uint16": "uint16", "int16": "int16", "float32": "float"}
_AS_FLOAT32 = ("int32", "uint32", "int64", "uint64", "float16", "float64")


@dataclasses.dataclass(frozen=True)
class Grid:
    """Where voxels lie, in x, y, z, as files have it. `world` is "voxels" (nothing is known), "scene" or "patient"."""

    steps: tuple[Vector, Vector, Vector]  # from a voxel to its neighbour along the array's last, middle and first axis
    origin: Vector = (0.0, 0.0, 0.0)      # of voxel (0, 0, 0)
    world: str = "voxels"


@dataclasses.dataclass(frozen=True)
class Volume:
    samples: Any         # with shape (z, y, x), dtype and slices
    grid: Grid
    rounds: bool = False  # samples were calculated from others: the nearest float32 will do


def _is_xarray(volume: Any) -> bool:
    return hasattr(volume, "dims") and hasattr(volume, "coords") and hasattr(volume, "data")


def _is_nibabel(volume: Any) -> bool:
    return hasattr(volume, "dataobj") and hasattr(volume, "affine")


def _is_dicom(volume: Any) -> bool:
    return hasattr(volume, "PixelData") and hasattr(volume, "Rows")


def _three(name: str, value: Any) -> Vector:
    try:
        z, y, x = (float(part) for part in value)
    except (TypeError, ValueError):
        raise InvalidArgument(f"{name} {value!r} is not three numbers, for z, y and x") from None
    if not numpy.isfinite((z, y, x)).all():
        raise InvalidArgument(f"{name} {value!r} must be finite")
    return z, y, x


def _reverse(vector: Vector) -> Vector:
    """Between z, y, x and x, y, z."""
    return vector[2], vector[1], vector[0]


def check_spacing(value: Any) -> Vector:
    """One number for all three axes, or z, y, x."""
    spacing = _three("spacing", (value,) * 3 if numpy.ndim(value) == 0 else value)
    if min(spacing) <= 0:
        raise InvalidArgument(f"spacing {value!r} must be above 0 along each axis")
    return spacing


def grid_of(spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None) -> Grid:
    """`spacing` and `origin` are z, y, x. Row i of `direction` is where the array's axis i points to, as z, y, x of the world."""
    dz, dy, dx = (1.0, 1.0, 1.0) if spacing is None else check_spacing(spacing)
    if world not in (None, "voxels", "scene", "patient"):
        raise InvalidArgument(f"world '{world}' is not one of voxels, scene, patient")
    if world == "voxels" and (origin is not None or direction is not None):
        raise InvalidArgument("world 'voxels' has neither origin nor direction")
    if origin is None and direction is None and world in (None, "voxels"):
        return Grid(((dx, 0.0, 0.0), (0.0, dy, 0.0), (0.0, 0.0, dz)))
    rows = ((1, 0, 0), (0, 1, 0), (0, 0, 1)) if direction is None else direction
    if len(rows) != 3:
        raise InvalidArgument(f"direction {direction!r} is not three vectors, of the axes z, y and x")
    steps = []
    for row, step in zip(rows, (dz, dy, dx)):
        z, y, x = _three("direction", row)
        length = (x * x + y * y + z * z) ** 0.5
        if length == 0:
            raise InvalidArgument(f"direction {direction!r} has a vector without direction")
        steps.append((step * x / length, step * y / length, step * z / length))
    at = (0.0, 0.0, 0.0) if origin is None else _reverse(_three("origin", origin))
    return Grid((steps[2], steps[1], steps[0]), at, world or "scene")


def _even_step(what: str, positions: Any) -> float:
    """The distance of positions that lie evenly, up or down; of a single one 1."""
    at = numpy.asarray(positions, numpy.float64)
    if at.ndim != 1 or not numpy.isfinite(at).all():
        raise InvalidArgument(f"{what} are not a list of finite numbers")
    if len(at) < 2:
        return 1.0
    step = float(at[-1] - at[0]) / (len(at) - 1)
    if step == 0 or numpy.abs(at - (at[0] + step * numpy.arange(len(at)))).max() > _EVEN * abs(step):
        raise InvalidArgument(f"{what} do not lie evenly")
    return step


def _from_xarray(array: Any) -> Volume:
    """Axes named z, y, x come in that order; others stay as they are."""
    if set(array.dims) == {"z", "y", "x"}:
        array = array.transpose("z", "y", "x")
    if len(array.dims) != 3:
        raise InvalidArgument(f"the DataArray has the axes {', '.join(map(str, array.dims))}, must have 3: z, y, x")
    given = [name in array.coords for name in array.dims]
    steps = [_even_step(f"the coordinates of '{name}'", array.coords[name].values) if has else 1.0 for name, has in zip(array.dims, given)]
    if not any(given):
        return Volume(array.data, grid_of())
    dz, dy, dx = steps
    z, y, x = (float(array.coords[name].values[0]) if has else 0.0 for name, has in zip(array.dims, given))
    return Volume(array.data, Grid(((dx, 0.0, 0.0), (0.0, dy, 0.0), (0.0, 0.0, dz)), (x, y, z), "scene"))


def _from_nibabel(image: Any) -> Volume:
    """Nibabel's arrays are x, y, z; its worlds are x to the right, y to anterior, z to superior, as ours."""
    array = numpy.asanyarray(image.dataobj)
    while array.ndim > 3 and array.shape[-1] == 1:
        array = array[..., 0]
    if array.ndim == 2:
        array = array[..., numpy.newaxis]
    if array.ndim != 3:
        raise InvalidArgument(f"the image has the shape {image.shape}, must have 3 axes: choose one of its volumes")
    affine = numpy.asarray(image.affine, numpy.float64)
    x, y, z = (tuple(map(float, affine[:3, i])) for i in range(3))
    scaled = array.dtype.kind == "f" and numpy.dtype(image.get_data_dtype()).kind != "f"
    return Volume(array.T, Grid((x, y, z), tuple(map(float, affine[:3, 3])), "patient"), rounds=scaled)  # type: ignore[arg-type]


def _to_ras(vector: Any) -> Any:
    """From DICOM's world: x to the left, y to posterior, z to superior."""
    return numpy.asarray(vector, numpy.float64) * (-1, -1, 1)


def _from_dicom(slices: Sequence[Any]) -> Volume:
    """Slices of one frame each, in any order."""
    first = slices[0]
    for field in ("ImageOrientationPatient", "ImagePositionPatient", "PixelSpacing"):
        if not all(hasattr(one, field) for one in slices):
            raise InvalidArgument(f"a DICOM dataset lacks {field}; give the path of its file or folder instead")
    along_row, along_column = (_to_ras(first.ImageOrientationPatient[i : i + 3]) for i in (0, 3))
    normal = numpy.cross(along_row, along_column)
    slices = sorted(slices, key=lambda one: float(normal @ _to_ras(one.ImagePositionPatient)))
    at = [_to_ras(one.ImagePositionPatient) for one in slices]
    if len(slices) > 1:
        heights = [float(normal @ position) for position in at]
        _even_step("the positions of the slices", heights)
        step = (at[-1] - at[0]) / (len(at) - 1)
    else:
        step = normal * float(getattr(first, "SliceThickness", None) or 1)
    frames, rounds = [], False
    for one in slices:
        try:
            pixels = numpy.asarray(one.pixel_array)
        except Exception as error:  # of any decoder
            raise InvalidArgument(f"pydicom cannot decode a dataset: {str(error).splitlines()[0]}; give the path of its file instead") from None
        if pixels.ndim != 2:
            raise InvalidArgument("a DICOM dataset has several frames or colours; give the path of its file instead")
        slope, intercept = float(getattr(one, "RescaleSlope", 1)), float(getattr(one, "RescaleIntercept", 0))
        if (slope, intercept) != (1, 0):
            rounds = rounds or not (slope.is_integer() and intercept.is_integer())
            pixels = pixels * slope + intercept
        frames.append(pixels)
    if len({frame.shape for frame in frames}) > 1:
        raise InvalidArgument("the DICOM datasets have different sizes: they are not of one series")
    between_rows, between_columns = (float(distance) for distance in first.PixelSpacing)
    steps = (along_row * between_columns, along_column * between_rows, step)
    x, y, z = (tuple(map(float, vector)) for vector in steps)
    return Volume(numpy.stack(frames), Grid((x, y, z), tuple(map(float, at[0])), "patient"), rounds)  # type: ignore[arg-type]


def volume_of(volume: Any, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None) -> Volume:
    """Given arguments take precedence over what the object states. InvalidArgument names what is wrong with it."""
    if _is_xarray(volume):
        found = _from_xarray(volume)
    elif _is_nibabel(volume):
        found = _from_nibabel(volume)
    elif _is_dicom(volume):
        found = _from_dicom([volume])
    elif isinstance(volume, (list, tuple)) and volume and all(map(_is_dicom, volume)):
        found = _from_dicom(volume)
    elif hasattr(volume, "shape") and hasattr(volume, "dtype") and hasattr(volume, "__getitem__"):
        found = Volume(volume, grid_of())
    else:
        raise InvalidArgument(f"a {type(volume).__name__} is no volume: expected a path or an array of z, y, x")
    if any(value is not None for value in (spacing, origin, direction, world)):
        found = dataclasses.replace(found, grid=grid_of(spacing, origin, direction, world))
    shape = tuple(found.samples.shape)
    if len(shape) == 2:  # a slice
        found = dataclasses.replace(found, samples=numpy.asanyarray(found.samples)[numpy.newaxis])
        shape = (1, *shape)
    if len(shape) != 3:
        raise InvalidArgument(f"the array has the shape {shape}, must have 3 axes: z, y, x, or 2 of a slice: y, x")
    if not all(1 <= side <= _MOST_SIDE for side in shape):
        raise InvalidArgument(f"the array has the shape {shape}, each side must be in [1, {_MOST_SIDE}]")
    file_type_of(found.samples.dtype)
    return found


def on_grid(volume: Volume, grid: Grid | None) -> Volume:
    """The volume on this grid, if it states none of its own."""
    return dataclasses.replace(volume, grid=grid) if grid is not None and volume.grid == grid_of() else volume


def file_type_of(dtype: Any) -> str:
    """That samples of this type are written as."""
    name = numpy.dtype(dtype).newbyteorder("=").name
    if name == "bool":
        return "uint8"
    if name in _AS_THEY_ARE:
        return name
    if name in _AS_FLOAT32:
        return "float32"
    raise InvalidArgument(f"the array has samples of type {numpy.dtype(dtype)}, which no volume has: expected whole or real numbers")


def _slab_ends(samples: Any) -> Iterator[int]:
    """Where slabs of some megabytes end along z: at the ends of chunks, if there are any."""
    depth = samples.shape[0]
    slice_bytes = samples.dtype.itemsize * samples.shape[1] * samples.shape[2]
    wanted = max(1, _SLAB_BYTES // slice_bytes)
    chunks = getattr(samples, "chunks", None)
    along_z = chunks[0] if chunks else 1
    if isinstance(along_z, int):  # zarr, h5py; or none at all
        step = max(wanted // along_z, 1) * along_z
        yield from range(step, depth, step)
    else:  # dask: the length of each
        begin = end = 0
        for length in along_z:
            end += length
            if end - begin >= wanted and end < depth:
                yield end
                begin = end
    yield depth


def _converted(slab: Any, file_type: str, rounds: bool) -> Any:
    """The slab as it is written: little endian. Refused by name, if a value does not fit exactly."""
    if slab.dtype.name == file_type or slab.dtype.kind == "b":
        return slab.astype(numpy.dtype(file_type).newbyteorder("<"), copy=False)
    with numpy.errstate(over="ignore"):
        converted = slab.astype("<f4")
    if not rounds:
        exact = converted.astype(slab.dtype) == slab if slab.dtype.kind == "f" else converted.astype(numpy.float64) == slab.astype(numpy.float64)
        if slab.dtype.itemsize == 8 and slab.dtype.kind != "f":
            exact &= numpy.abs(slab.astype(numpy.float64)) <= 2.0**53  # else float64 is not exact either
        if slab.dtype.kind == "f":
            exact |= numpy.isnan(slab)
        if not exact.all():
            value = slab[~exact].flat[0]
            raise InvalidArgument(
                f"the array has samples of type {slab.dtype.name}, and {value} is no float32; array.astype(numpy.float32) takes the nearest one"
            )
    return converted


def slabs_of(volume: Volume, from_the_end: bool = False) -> Iterator[Any]:
    """Its samples as they are written, slab by slab along z; or from the last one to the first."""
    file_type = file_type_of(volume.samples.dtype)
    ends = list(_slab_ends(volume.samples))
    pairs = list(zip([0, *ends], ends))
    for begin, end in reversed(pairs) if from_the_end else pairs:
        yield _converted(numpy.asarray(volume.samples[begin:end]), file_type, volume.rounds)


def write_nrrd(volume: Volume, path: str | os.PathLike[str]) -> None:
    """NRRD with raw samples: it keeps type, spacing and orientation, and is written from the front to the back."""
    samples, grid = volume.samples, volume.grid
    file_type = file_type_of(samples.dtype)
    depth, height, width = samples.shape

    def vector(parts: Vector) -> str:
        return "(" + ",".join(map(repr, parts)) + ")"

    lines = ["NRRD0004", f"type: {_AS_THEY_ARE[file_type]}", "dimension: 3", f"sizes: {width} {height} {depth}", "kinds: domain domain domain",
             "endian: little", "encoding: raw"]
    if grid.world == "voxels":
        lines.append("spacings: " + " ".join(repr(grid.steps[i][i]) for i in range(3)))
    else:
        lines.append("space: " + ("right-anterior-superior" if grid.world == "patient" else "3D-right-handed"))
        lines.append("space directions: " + " ".join(map(vector, grid.steps)))
        lines.append("space origin: " + vector(grid.origin))
    with pathlib.Path(path).open("wb") as file:
        file.write(("\n".join(lines) + "\n\n").encode())
        for slab in slabs_of(volume):
            file.write(numpy.ascontiguousarray(slab).data)
