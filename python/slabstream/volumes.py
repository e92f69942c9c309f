"""Volumes as Python programs hold them, and how they get into a file that the service reads.

Arrays are z, y, x: array[z, y, x], as numpy has volumes in C order, and so are spacing, origin and directions. Taken are numpy arrays and
whatever has shape, dtype and slices like one (dask, zarr, h5py, memory maps), what numpy can view (torch, jax), xarray.DataArray, images of
nibabel, ITK, SimpleITK and VTK, and datasets of pydicom. None of these packages is needed: an object is known by its attributes. Arrays are
written slab by slab, so that one which is computed or read by chunks is never in memory as a whole.
"""
from __future__ import annotations

import dataclasses
import importlib
import os
import pathlib
from typing import Any, Iterator, Sequence

import numpy

from .errors import InvalidArgument, warn

Vector = tuple[float, float, float]

_MOST_SIDE = 65535
_SLAB_BYTES = 16 << 20
_EVEN = 1e-3  # part of a step by which steps may differ

# Types that are written as they are, and how NRRD calls them.
_AS_THEY_ARE = {"uint8": "uint8", "int8": "int8", "uint16": "uint16", "int16": "int16", "float32": "float", "int32": "int32",
                "uint32": "uint32", "int64": "int64", "uint64": "uint64"}
# Of these, the service makes float32 too, and keeps whole numbers beside that which float32 rounds (docs/formats.md).
_WIDE = ("int32", "uint32", "int64", "uint64")
_MASKED: Any = numpy.ma  # which has no types
_AS_FLOAT32 = ("float16", "float64", "bfloat16")


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
    rounds: bool = False  # samples were calculated from others: the nearest float32 will do, without a word
    masked: bool = False  # some samples may be masked, as numpy.ma has it


def is_xarray(volume: Any) -> bool:
    return hasattr(volume, "dims") and hasattr(volume, "coords") and hasattr(volume, "data")


def _is_nibabel(volume: Any) -> bool:
    return hasattr(volume, "dataobj") and hasattr(volume, "affine")


def _is_dicom(volume: Any) -> bool:
    return hasattr(volume, "PixelData") and hasattr(volume, "Rows")


def _is_vtk(volume: Any) -> bool:
    return hasattr(volume, "GetDirectionMatrix") and hasattr(volume, "GetPointData")


def _is_itk(volume: Any) -> bool:
    return hasattr(volume, "GetOrigin") and hasattr(volume, "GetDirection")


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


# What axes of a DataArray are, by their names or by what CF conventions say of their coordinates.
_AXIS_NAMES = {
    "x": ("x", "lon", "long", "longitude", "easting", "col", "column"),
    "y": ("y", "lat", "latitude", "northing", "row"),
    "z": ("z", "depth", "height", "altitude", "elevation", "lev", "level", "plev", "pressure", "slice"),
    "t": ("t", "time", "date", "datetime"),
    "c": ("c", "channel", "band", "variable"),
}


def _role(array: Any, name: Any) -> str:
    """x, y, z, t or c; "": not known."""
    attributes = array.coords[name].attrs if name in array.coords else {}
    if str(attributes.get("axis", "")).lower() in _AXIS_NAMES:
        return str(attributes["axis"]).lower()
    names = [str(name).lower(), str(attributes.get("standard_name", "")).lower()]
    return next((role for role, known in _AXIS_NAMES.items() if any(each in known for each in names)), "")


def _first_of_others(array: Any) -> Any:
    """A DataArray of three axes: of times, channels and whatever else there is, the first, with a warning that says so."""
    roles = {name: _role(array, name) for name in array.dims}
    others = [name for name in array.dims if array.sizes[name] == 1 and roles[name] not in ("x", "y", "z")]
    others += [name for name in array.dims if roles[name] in ("t", "c", "") and name not in others]
    for name in others:
        if len(array.dims) <= 3 or not {"x", "y"} <= set(roles.values()):
            break
        if array.sizes[name] > 1:
            warn(f"the DataArray has {array.sizes[name]} of '{name}': the first is taken; array.isel({name}=...) chooses another one")
        array = array.isel({name: 0})
    return array


def at_time(array: Any, number: int) -> Any:
    """Of an array of four axes, or a DataArray with times, what it holds at one of them."""
    if is_xarray(array):
        name = next((name for name in array.dims if _role(array, name) == "t"), None)
        if name is None:
            raise InvalidArgument(f"time is {number}, but the DataArray has no times: its axes are {', '.join(map(str, array.dims))}")
        return array.isel({name: number})
    if array.ndim != 4:
        raise InvalidArgument(f"time is {number}, but the array has {array.ndim} axes, must have 4: time, z, y, x")
    return array[number]


def channels_of(array: Any, axis: int | None) -> dict[str, Any]:
    """By names. Of an array without channels: itself, without a name. `axis`: as of DaskService.render."""
    if axis is not None and not (array.ndim == 4 and -4 <= axis < 4):
        raise InvalidArgument(f"channel_axis is {axis}, but the array has {array.ndim} axes: must have 4, and channel_axis be in [-4, 3]")
    if is_xarray(array):
        dim = next((dim for dim in array.dims if _role(array, dim) == "c"), None) if axis is None else array.dims[axis]
        if dim is None:
            return {"": array}
        names = array.coords[dim].values if dim in array.coords else range(array.sizes[dim])
        return {str(name).replace(",", " "): array.isel({dim: number}) for number, name in enumerate(names)}
    if axis is None:
        return {"": array}
    return {str(number): array[(slice(None),) * (axis % 4) + (number,)] for number in range(array.shape[axis])}


def _from_xarray(array: Any, places: bool) -> Volume:
    """Axes that are known come in the order z, y, x; others stay as they are. `places`: coordinates give spacing and place."""
    array = _first_of_others(array)
    if len(array.dims) != 3:
        raise InvalidArgument(f"the DataArray has the axes {', '.join(map(str, array.dims))}, must have 3: z, y, x")
    roles = {name: _role(array, name) for name in array.dims}
    if sorted(roles.values()) == ["t", "x", "y"]:  # a map over time: time is upwards
        roles = {name: "z" if role == "t" else role for name, role in roles.items()}
    by_role = {role: name for name, role in roles.items()}
    known = set(by_role) == {"x", "y", "z"}
    if known:
        array = array.transpose(*(by_role[role] for role in "zyx"))
    given = [name in array.coords for name in array.dims]
    if not places or not any(given):
        return Volume(array.data, grid_of())
    steps, begins = [1.0] * 3, [0.0] * 3
    for axis in (2, 1, 0):
        name = array.dims[axis]
        if not given[axis]:
            continue
        coordinates = array.coords[name]
        if coordinates.dtype.kind in "mM":  # instants have no length: they get that of the next axis
            steps[axis] = abs(steps[min(axis + 1, 2)])
            continue
        try:
            steps[axis] = _even_step(f"the coordinates of '{name}'", coordinates.values)
        except InvalidArgument as error:
            raise InvalidArgument(f"{error}: array.interp({name}=...) makes them even, spacing=... leaves them out of account") from None
        begins[axis] = float(coordinates.values[0])
        if known and axis == 0 and coordinates.attrs.get("positive", "down" if str(name).lower() == "depth" else "up") == "down":
            steps[axis], begins[axis] = -steps[axis], 0.0 - begins[axis]  # z is upwards
    (dz, dy, dx), (z, y, x) = steps, begins
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


def _placed(samples: Any, spacing: Any, origin: Any, columns: Any, world: str) -> Volume:
    """`samples` are z, y, x; all else is x, y, z: column i of `columns` is the direction of voxels along axis i."""
    steps = (numpy.asarray(columns, numpy.float64) * numpy.asarray(spacing, numpy.float64)).T
    x, y, z = (tuple(map(float, step)) for step in steps)
    return Volume(samples, Grid((x, y, z), tuple(map(float, origin)), world))  # type: ignore[arg-type]


def _from_vtk(image: Any) -> Volume:
    """A vtkImageData, and so pyvista.ImageData. The active scalars of its points, or else of its cells, lie in VTK's world as they are."""
    sizes, spacing, scalars = numpy.array(image.GetDimensions()), numpy.array(image.GetSpacing()), image.GetPointData().GetScalars()
    matrix = image.GetDirectionMatrix()
    columns = numpy.array([[matrix.GetElement(row, column) for column in range(3)] for row in range(3)])
    first = numpy.array(image.GetExtent()[::2], numpy.float64)  # its number along each axis; the origin is that of number 0
    if scalars is None:
        scalars, sizes, first = image.GetCellData().GetScalars(), numpy.maximum(sizes - 1, 1), first + 0.5
    if scalars is None:
        raise InvalidArgument("the vtkImageData has no active scalars, of points or of cells: SetActiveScalars names an array")
    if scalars.GetNumberOfComponents() != 1:
        raise InvalidArgument(f"the scalars of the vtkImageData have {scalars.GetNumberOfComponents()} components, must have 1")
    origin = numpy.array(image.GetOrigin()) + columns @ (spacing * first)
    return _placed(numpy.asarray(memoryview(scalars)).reshape(sizes[::-1]), spacing, origin, columns, "scene")


def _from_itk(image: Any) -> Volume:
    """An image of ITK or SimpleITK. Its world is DICOM's."""
    package = importlib.import_module(type(image).__module__.partition(".")[0])  # SimpleITK or itk: it made the image
    view = getattr(package, "GetArrayViewFromImage", None) or getattr(package, "array_view_from_image")
    dimension = len(tuple(image.GetSpacing()))
    if dimension != 3:
        raise InvalidArgument(f"the image of ITK has {dimension} dimensions, must have 3: extract one of its volumes")
    columns = numpy.asarray(image.GetDirection()).reshape(3, 3)
    return _placed(view(image), tuple(image.GetSpacing()), _to_ras(tuple(image.GetOrigin())), _to_ras(columns.T).T, "patient")


def _as_numpy(volume: Any) -> Any:
    """What numpy can view: tensors of torch and others whose types or slices are not numpy's."""
    kind = f"{type(volume).__module__.partition('.')[0]}.{type(volume).__name__}"
    for view in (numpy.asarray if hasattr(volume, "__array__") else None, numpy.from_dlpack if hasattr(volume, "__dlpack__") else None):
        if view is None:
            continue
        try:
            return view(volume)
        except Exception as error:  # of any package: a device, a gradient, a type
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
    raise InvalidArgument(f"numpy cannot view a {kind}: {why}")


def _known_dtype(volume: Any) -> bool:
    try:
        numpy.dtype(volume.dtype)
        return True
    except TypeError:
        return False


def _is_masked(samples: Any) -> bool:
    """Of numpy.ma, or of dask, whose chunks are."""
    array = getattr(samples, "_meta", samples)
    if not isinstance(array, numpy.ma.MaskedArray):
        return False
    return array is not samples or bool(_MASKED.getmaskarray(array).any())


def _of_array(volume: Any) -> Volume:
    like_an_array = hasattr(volume, "shape") and hasattr(volume, "dtype") and hasattr(volume, "__getitem__")
    if not (like_an_array and _known_dtype(volume)) and (hasattr(volume, "__array__") or hasattr(volume, "__dlpack__")):
        volume = _as_numpy(volume)
    elif not like_an_array:
        raise InvalidArgument(f"a {type(volume).__name__} is no volume: expected a path or an array of z, y, x")
    elif not _known_dtype(volume):
        raise InvalidArgument(f"the array has samples of type {volume.dtype!r}, which numpy does not know: give an array of numpy")
    return Volume(volume, grid_of())


def volume_of(volume: Any, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None) -> Volume:
    """Given arguments take precedence over what the object states. InvalidArgument names what is wrong with it."""
    if is_xarray(volume):
        found = _from_xarray(volume, places=spacing is None)
    elif _is_nibabel(volume):
        found = _from_nibabel(volume)
    elif _is_vtk(volume):
        found = _from_vtk(volume)
    elif _is_itk(volume):
        found = _from_itk(volume)
    elif _is_dicom(volume):
        found = _from_dicom([volume])
    elif isinstance(volume, (list, tuple)) and volume and all(map(_is_dicom, volume)):
        found = _from_dicom(volume)
    else:
        found = _of_array(volume)
    if any(value is not None for value in (spacing, origin, direction, world)):
        found = dataclasses.replace(found, grid=grid_of(spacing, origin, direction, world))
    shape = tuple(found.samples.shape)
    if len(shape) == 2:  # a slice
        found = dataclasses.replace(found, samples=numpy.asanyarray(found.samples)[numpy.newaxis])
        shape = (1, *shape)
    if len(shape) != 3:
        choose = "; array[0] has its first time or channel" if len(shape) == 4 else ""
        raise InvalidArgument(f"the array has the shape {shape}, must have 3 axes: z, y, x, or 2 of a slice: y, x{choose}")
    if not all(1 <= side <= _MOST_SIDE for side in shape):
        raise InvalidArgument(f"the array has the shape {shape}, each side must be in [1, {_MOST_SIDE}]")
    found = dataclasses.replace(found, masked=_is_masked(found.samples))
    file_type_of(found)
    return found


def labels_of(labels: Any) -> Volume:
    """A volume of the numbers of structures. What is masked has none."""
    found = volume_of(labels)
    if found.masked:
        found = dataclasses.replace(found, samples=_MASKED.filled(numpy.asanyarray(found.samples), 0), masked=False)
    if numpy.dtype(found.samples.dtype).name == "float64":  # float32 would make labels of what is none
        array = numpy.asarray(found.samples)
        with numpy.errstate(invalid="ignore"):
            whole = array.astype(numpy.int64)
        if (whole != array).any():
            raise InvalidArgument(f"labels hold {array[whole != array].flat[0]}, must be whole numbers")
        found = dataclasses.replace(found, samples=whole)
    return found


def layers_of(labels: Any, overlay: Any) -> tuple[Volume | None, Volume | None]:
    return None if labels is None else labels_of(labels), None if overlay is None else volume_of(overlay)


def on_grid(volume: Volume, grid: Grid | None) -> Volume:
    """The volume on this grid, if it states none of its own."""
    return dataclasses.replace(volume, grid=grid) if grid is not None and volume.grid == grid_of() else volume


def file_type_of(volume: Volume) -> str:
    """That its samples are written as."""
    dtype = numpy.dtype(volume.samples.dtype)
    name: str = dtype.newbyteorder("=").name
    if volume.masked and (name == "bool" or name in _AS_THEY_ARE):
        return "float32"  # NaN is what is masked
    if name == "bool":
        return "uint8"
    if name in _AS_THEY_ARE:
        return name
    if name in _AS_FLOAT32:
        return "float32"
    raise InvalidArgument(f"the array has samples of type {dtype}, which no volume has: expected whole or real numbers")


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


def _float32(slab: Any) -> tuple[Any, bool]:
    """The nearest float32 of each sample, and whether any was rounded."""
    with numpy.errstate(over="ignore", invalid="ignore"):
        converted = slab.astype("<f4")
        if slab.dtype.kind == "f":
            exact = bool(((converted.astype(slab.dtype) == slab) | numpy.isnan(slab)).all())
        elif slab.dtype.kind in "iu" and slab.dtype.itemsize > 2:
            whole = numpy.float64(converted)  # every whole float32 is one of float64
            exact = bool((numpy.abs(whole) <= 2.0**53).all() and (whole == slab.astype(numpy.float64)).all())
        else:
            exact = True  # bool, few bits, and bfloat16, which float32 holds
    return converted, not exact


def slabs_of(volume: Volume, from_the_end: bool = False, file_type: str | None = None) -> Iterator[Any]:
    """Its samples as they are written, slab by slab along z, little endian; or from the last slab to the first. `file_type`: in place of
    file_type_of(volume). A warning says if pictures show them rounded, as they do those of files."""
    file_type = file_type or file_type_of(volume)
    samples, wide = volume.samples, file_type in _WIDE
    ends = list(_slab_ends(samples))
    pairs = list(zip([0, *ends], ends))
    rounded, infinite = False, 0
    ends_of_values: list[int] = []
    for begin, end in reversed(pairs) if from_the_end else pairs:
        slab = numpy.asanyarray(samples[begin:end])
        values = _MASKED.getdata(slab)
        if wide:
            ends_of_values += [int(values.min()), int(values.max())]
        if file_type == "float32" or (wide and not rounded):
            floats, rounds = _float32(values)
            if values.dtype.kind == "f" and values.dtype.itemsize > 4 and rounds:
                infinite += int((numpy.isinf(floats) & ~numpy.isinf(values) & ~_MASKED.getmaskarray(slab)).sum())
            rounded = rounded or rounds
        if file_type == "float32":
            if volume.masked:
                floats[_MASKED.getmaskarray(slab)] = numpy.nan
            yield floats
        else:
            yield values.astype(numpy.dtype(file_type).newbyteorder("<"), copy=False)
    if infinite > 0:
        warn(f"{infinite} values of the array are beyond those of float32 (3.4e38) and are not shown: divide the array by some number")
    elif rounded and not volume.rounds and not _fits_uint16(ends_of_values):
        warn(_rounding_text(numpy.dtype(samples.dtype).name, wide))


def _fits_uint16(ends: list[int]) -> bool:
    """The service keeps whole numbers that lie so near each other as they are."""
    return bool(ends) and max(ends) - min(ends) <= 65535 and max(abs(end) for end in ends) < 2**53


def _rounding_text(dtype: str, wide: bool) -> str:
    text = f"pictures show the array's values of type {dtype} rounded to float32"
    if wide:
        return text + "; values at points and labels are exact"
    return text + "; array.astype(numpy.float32) does so without this warning"


def write_nrrd(volume: Volume, path: str | os.PathLike[str]) -> None:
    """NRRD with raw samples: it keeps type, spacing and orientation, and is written from the front to the back."""
    samples, grid = volume.samples, volume.grid
    file_type = file_type_of(volume)
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
