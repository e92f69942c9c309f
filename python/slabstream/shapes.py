"""Meshes, lines and points beside a volume: Mesh, Lines and Points, and the option `shape`.

Coordinates are x, y, z of the world in which the volume lies: that of its file, or that of load().
"""
from __future__ import annotations

import re
from typing import Any, Iterator, Mapping

import numpy

from . import schema, values
from .errors import InvalidArgument

_MOST_VERTICES = 1 << 30  # and parts
_MOST_SHAPES = 64         # of a picture
_LOOK = ("color", "opacity", "width", "map", "range", "time")
_MOST_TIME = 1_000_000
_VTK_TYPES = {"uint8": "unsigned_char", "int64": "vtktypeint64", "float32": "float", "float64": "double"}


def _bytes(array: Any) -> bytes:
    """Big endian, as legacy VTK files have numbers."""
    return bytes(array.astype(array.dtype.newbyteorder(">"), copy=False).tobytes())


def _type(array: Any) -> str:
    return _VTK_TYPES[array.dtype.name]


def _numbers(name: str, array: Any, rows: int | None, columns: tuple[int, ...]) -> Any:
    """As float32 or float64, with `rows` rows of one of these numbers of columns; (): there is one number in each. None: any number of rows."""
    found = numpy.asarray(array)
    if found.dtype.kind not in "iuf":
        raise InvalidArgument(f"{name} has elements of type {found.dtype}, must be whole or real numbers")
    if found.ndim != (2 if columns else 1) or (rows is not None and len(found) != rows) or (columns and found.shape[1] not in columns):
        wanted = ", ".join(["N" if rows is None else str(rows), *([" or ".join(map(str, columns))] if columns else [""])]).rstrip(" ")
        raise InvalidArgument(f"{name} has the shape {found.shape}, must have ({wanted})")
    return numpy.ascontiguousarray(found, numpy.float32 if found.dtype.name in ("float32", "float16") else numpy.float64)


def _places(name: str, points: Any) -> Any:
    found = _numbers(name, points, None, (3,))
    if not 1 <= len(found) <= _MOST_VERTICES:
        raise InvalidArgument(f"{name} has {len(found)} rows, must have 1 to {_MOST_VERTICES}")
    return _finite(name, found)


def _finite(name: str, array: Any) -> Any:
    wrong = ~numpy.isfinite(array)
    if wrong.any():
        raise InvalidArgument(f"{name}[{int(wrong.reshape(len(array), -1).any(axis=1).argmax())}] is not finite")
    return array


def _whole(name: str, array: Any, most: int) -> Any:
    """Whole numbers in [0, most]."""
    found = numpy.asarray(array)
    if found.dtype.kind not in "iu":
        raise InvalidArgument(f"{name} has elements of type {found.dtype}, must be whole numbers")
    wrong = (found < 0) | (found > most)
    if wrong.any():
        raise InvalidArgument(f"{name} has {found[wrong][0]}, must be in [0, {most}]")
    return found


def _colors(colors: Any, count: int) -> Any:
    """RGB or RGBA by vertex, as bytes."""
    found = numpy.asarray(colors)
    if found.dtype == numpy.uint8:
        _numbers("colors", found, count, (3, 4))
        return numpy.ascontiguousarray(found)
    found = _numbers("colors", found, count, (3, 4))
    if not ((found >= 0) & (found <= 1)).all():
        raise InvalidArgument("colors must be uint8, or real numbers in [0, 1]")
    return numpy.rint(255 * found).astype(numpy.uint8)


def _radii(radii: Any, count: int) -> Any:
    if numpy.ndim(radii) == 0:
        radii = numpy.full(count, values.number("radii", radii, 0, values.MOST_COORDINATE))
    found = _finite("radii", _numbers("radii", radii, count, ()))
    if (found < 0).any():
        raise InvalidArgument(f"radii has {found.min():g}, must be at least 0")
    return found


class Shape:
    """A mesh, lines or points beside a volume, for the option `shape` of pictures. The arrays are copied. It is sent to a service with the first
    picture that shows it, and stays there as long as it is kept here."""

    kind = "shape"

    def __init__(self, places: Any, cells: tuple[str, Any, Any] | None, normals: Any, radii: Any, colors: Any, scalars: Any):
        """`cells`: a keyword of VTK, where each cell begins among the vertices of all and where the last one ends, and those vertices."""
        count = len(places)
        given = {
            "normals": None if normals is None else _finite("normals", _numbers("normals", normals, count, (3,))),
            "colors": None if colors is None else _colors(colors, count),
            "radius": None if radii is None else _radii(radii, count),
            "values": None if scalars is None else _numbers("values", scalars, count, ()),
        }
        arrays: dict[str, Any] = {name: array for name, array in given.items() if array is not None}
        if "values" in arrays and numpy.isinf(arrays["values"]).any():
            raise InvalidArgument("values must be finite, or NaN where there is none")
        parts = [f"# vtk DataFile Version 5.1\n{self.kind}\nBINARY\nDATASET POLYDATA\nPOINTS {count} {_type(places)}\n".encode(), _bytes(places)]
        if cells is not None:
            keyword, begins, corners = cells
            parts += [f"\n{keyword} {len(begins)} {len(corners)}\nOFFSETS {_type(begins)}\n".encode(), _bytes(begins)]
            parts += [f"\nCONNECTIVITY {_type(corners)}\n".encode(), _bytes(corners)]
        if arrays:
            parts.append(f"\nPOINT_DATA {count}\nFIELD FieldData {len(arrays)}".encode())
        for name, array in arrays.items():
            parts += [f"\n{name} {1 if array.ndim == 1 else array.shape[1]} {count} {_type(array)}\n".encode(), _bytes(array)]
        self._file = b"".join(parts)
        self._says = f"{count} vertices"

    def look(self, *, color: Any = None, opacity: float | None = None, width: float | str | None = None, map: str | None = None,
             range: Any = None) -> dict[str, Any]:
        """How pictures show it, for the option `shape`: `color` of all of it; `opacity` in (0, 1]; `width`, the thickness of lines or the diameter of
        points, in the world's unit or as "3px"; `map`, a colour map for its values, and the `range` of values that the map spans."""
        return {"shape": self, "color": color, "opacity": opacity, "width": width, "map": map, "range": range}

    def __repr__(self) -> str:
        return f"<slabstream.{type(self).__name__} of {self._says}>"


class Mesh(Shape):
    """Triangles: `vertices` are (N, 3), `faces` (M, 3) whole numbers of vertices. By vertex: `normals` (N, 3), `colors` (N, 3 or 4) as uint8 or in
    [0, 1], and `values` (N,), which a colour map shows, NaN: none."""

    kind = "mesh"

    def __init__(self, vertices: Any, faces: Any, *, normals: Any = None, colors: Any = None, values: Any = None):
        places = _places("vertices", vertices)
        corners = _whole("faces", faces, len(places) - 1)
        if corners.ndim != 2 or corners.shape[1] != 3 or not 1 <= len(corners) <= _MOST_VERTICES:
            raise InvalidArgument(f"faces has the shape {corners.shape}, must have (M, 3) with M in [1, {_MOST_VERTICES}]")
        begins = numpy.arange(0, corners.size + 1, 3, dtype=numpy.int64)
        super().__init__(places, ("POLYGONS", begins, corners.astype(numpy.int64).ravel()), normals, None, colors, values)
        self._says += f" and {len(corners)} triangles"


class Lines(Shape):
    """Lines: a list of arrays (N, 3), one a line; or one array (N, 3) with the points of all, and `begins`, the ascending numbers of the points
    where lines begin, 0 first. By point of all lines: `radii` (N,), or one number for all, `colors` and `values` as of Mesh."""

    kind = "lines"

    def __init__(self, points: Any, begins: Any = None, *, radii: Any = None, colors: Any = None, values: Any = None):
        if begins is None:
            several = isinstance(points, (list, tuple)) and len(points) > 0 and numpy.ndim(points[0]) == 2
            lines = list(points) if several or numpy.ndim(points) == 3 else [points]
            if not lines:
                raise InvalidArgument("points has no line")
            parts = [_places(f"points[{i}]" if len(lines) > 1 else "points", line) for i, line in enumerate(lines)]
            places, begins = numpy.concatenate(parts), numpy.cumsum([0, *map(len, parts[:-1])])
        else:
            places = _places("points", points)
        firsts = _whole("begins", begins, len(places) - 1).astype(numpy.int64)
        if firsts.ndim != 1 or len(firsts) == 0 or firsts[0] != 0:
            raise InvalidArgument(f"begins has the shape {firsts.shape}, must have (L,) and begin with 0")
        ends = numpy.append(firsts, len(places))
        short = numpy.diff(ends) < 2
        if short.any():
            raise InvalidArgument(f"line {int(short.argmax())} has {int(numpy.diff(ends)[short][0])} points, must have at least 2")
        super().__init__(places, ("LINES", ends, numpy.arange(len(places))), None, radii, colors, values)
        self._says += f" in {len(firsts)} lines"


class Points(Shape):
    """Points: an array (N, 3). By point: `radii` (N,), or one number for all, `colors` and `values` as of Mesh."""

    kind = "points"

    def __init__(self, points: Any, *, radii: Any = None, colors: Any = None, values: Any = None):
        super().__init__(_places("points", points), None, None, radii, colors, values)


def _of_polydata(data: Any) -> Shape:
    """Of a pyvista.PolyData: its polygons, else its lines, else its points, with its active scalars."""
    count, arrays = len(data.points), data.point_data
    normals = getattr(arrays, "active_normals", None)
    scalars = getattr(arrays, "active_scalars", None)
    scalars = None if scalars is None else numpy.asarray(scalars)
    are_colors = scalars is not None and scalars.dtype == numpy.uint8 and scalars.shape in ((count, 3), (count, 4))
    found: dict[str, Any] = {"colors": scalars} if are_colors else {"values": scalars} if scalars is not None and scalars.ndim == 1 else {}
    if len(data.faces) or getattr(data, "n_strips", 0):
        faces = numpy.asarray(data.faces)
        if getattr(data, "n_strips", 0) or len(faces) % 4 != 0 or (faces[::4] != 3).any():
            faces = numpy.asarray(data.triangulate().faces)
        return Mesh(data.points, faces.reshape(-1, 4)[:, 1:], normals=normals, **found)
    found["radii"] = arrays["radius"] if "radius" in arrays else None
    if not len(data.lines):
        return Points(data.points, **found)
    cells, lines, at = numpy.asarray(data.lines), [], 0
    while at < len(cells):
        lines.append(cells[at + 1 : at + 1 + int(cells[at])])
        at += 1 + int(cells[at])
    order = numpy.concatenate(lines)
    of_points = {name: None if array is None else numpy.asarray(array)[order] for name, array in found.items()}
    return Lines(numpy.asarray(data.points)[order], numpy.cumsum([0, *map(len, lines[:-1])]), **of_points)


def shape_of(shape: Any) -> Shape:
    """A Mesh, Lines or Points of a pyvista.PolyData or a trimesh.Trimesh, as they are now. The option `shape` takes these objects, too, but sends
    them with each picture; what this returns is sent once."""
    if isinstance(shape, Shape):
        return shape
    if all(hasattr(shape, name) for name in ("points", "faces", "lines", "point_data")):
        return _of_polydata(shape)
    if hasattr(shape, "vertices") and hasattr(shape, "faces"):
        visual: Any = getattr(shape, "visual", None)
        return Mesh(shape.vertices, shape.faces, colors=visual.vertex_colors if getattr(visual, "kind", None) == "vertex" else None)
    raise InvalidArgument(f"a {type(shape).__name__} is no shape: expected the name of a dataset, a Mesh, Lines or Points, or a mesh of PyVista or trimesh")


# ---- the option


def _of_text(name: str, text: str) -> dict[str, Any]:
    """"lung,color=pink,opacity=0.4", as the command line takes it."""
    first, *rest = re.split(r"(?<!\\),(?=[a-z]+=)", text)
    found: dict[str, Any] = {"shape": re.sub(r"\\(.)", r"\1", first)}
    for part in rest:
        key, _, value = part.partition("=")
        if key in found:
            raise InvalidArgument(f"{name} '{text}' names '{key}' twice")
        found[key] = value
    return found


def _choice(name: str, given: Any) -> tuple[Any, Shape | None]:
    """A ShapeChoice, without a name if there is a Shape to be sent."""
    look = _of_text(name, given) if isinstance(given, str) else given if isinstance(given, Mapping) else {"shape": given}
    for key in look:
        if key not in ("shape", *_LOOK):
            raise InvalidArgument(f"{name} {given!r} has {key!r}, but must have one of: {', '.join(_LOOK)}")
    shape = look.get("shape")
    look = {key: value for key, value in look.items() if value is not None and key != "shape"}
    choice = schema.ShapeChoice()
    if isinstance(shape, str):
        if not 1 <= len(shape.encode()) <= values.MOST_NAME_BYTES:
            raise InvalidArgument(f"{name} {shape!r} must be a name of 1 to {values.MOST_NAME_BYTES} bytes")
        choice.shape = shape
    if "color" in look:
        choice.color.CopyFrom(values.opaque_color(f"{name} color", look["color"]))
    if "opacity" in look:
        choice.opacity = values.number(f"{name} opacity", look["opacity"], 0, 1, above=True)
    if "width" in look:
        width = look["width"]
        choice.width_in_pixels = isinstance(width, str) and width.endswith("px")
        choice.width = values.number(f"{name} width", str(width)[:-2] if choice.width_in_pixels else width, 0, values.MOST_COORDINATE)
    if "map" in look:
        choice.map = values.color_map_name(f"{name} map", look["map"])
    if "range" in look:
        choice.range.CopyFrom(values.scalar_range(f"{name} range", look["range"]))
    if "time" in look:
        choice.time = values.integer(f"{name} time", look["time"], 0, _MOST_TIME)
    return choice, None if isinstance(shape, str) else shape_of(shape)


def choices(name: str, value: Any) -> Iterator[tuple[Any, Shape | None]]:
    """The ShapeChoices of the option: a name, a text, a shape, a look such as {"shape": "lung", "color": "pink"}, or a list of these."""
    given = list(value) if isinstance(value, (list, tuple)) else [value]
    if len(given) > _MOST_SHAPES:
        raise InvalidArgument(f"{name} has {len(given)} shapes, at most {_MOST_SHAPES} are possible")
    return (_choice(name if len(given) == 1 else f"{name}[{i}]", each) for i, each in enumerate(given))
