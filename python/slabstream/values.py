"""Values of options: what Python users write, or the command line's text, turned into numbers and messages of the wire.

Each function takes the option's name, for what it says of mistakes, and a value. Sentences are those of the command line, without dashes:
"zoom 0 is out of range [0.001, 10000]". Points and directions are x, y, z of the world.
"""
from __future__ import annotations

import json
import math
import operator
import os
import pathlib
from typing import Any, Iterable, Sequence

import numpy

from . import schema
from .errors import InvalidArgument, NotFound

Vector = tuple[float, float, float]
Color = tuple[float, float, float, float]  # straight, each in [0, 1], with the precision of a float32

MOST_COORDINATE = 1e300  # of the world: practically any; a bound of a clip box that is left out
MOST_SCALAR = 1e300
MOST_SIDE = 16384      # pixels
MOST_LABEL = (1 << 64) - 1
MOST_NAME_BYTES = 256
MOST_ISOSURFACES = 8

#: The colours that CSS names, as codes: those of the command line (python/update-options writes the file).
NAMED_COLORS: dict[str, str] = json.loads(pathlib.Path(__file__).with_name("colors.json").read_text(encoding="utf-8"))

# Of isosurfaces without a colour, by their place in the list: bone, blood, fat, nerve and so on.
_ISOSURFACE_COLORS: list[Vector] = [
    (0.92, 0.84, 0.72), (0.80, 0.30, 0.26), (0.38, 0.60, 0.86), (0.95, 0.78, 0.35),
    (0.45, 0.72, 0.48), (0.66, 0.48, 0.78), (0.88, 0.55, 0.70), (0.60, 0.60, 0.60),
]


def json_of(name: str, value: Any) -> Any:
    """What the JSON file of this path holds; what is no path, as it is."""
    if not isinstance(value, (str, os.PathLike)):
        return value
    try:
        return json.loads(pathlib.Path(value).read_bytes())
    except FileNotFoundError:
        raise NotFound(f"{name} '{value}' does not exist") from None
    except (OSError, ValueError) as error:
        raise InvalidArgument(f"{name} '{value}' cannot be read: {error}") from None


def text_of(number: float) -> str:
    """As short as it reads back the same: 10000, 0.001."""
    return str(int(number)) if number == int(number) and abs(number) < 1e16 else repr(float(number))


def number(name: str, value: object, least: float, most: float, above: bool = False) -> float:
    """In [least, most], or in (least, most] if `above`."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if math.isnan(found) or isinstance(value, bool):
        raise InvalidArgument(f"{name} {value!r} is not a number")
    if not least <= found <= most or (above and found == least):
        raise InvalidArgument(f"{name} {value} is out of range {'(' if above else '['}{text_of(least)}, {text_of(most)}]")
    return found


def integer(name: str, value: object, least: int, most: int) -> int:
    try:
        found = int(value) if isinstance(value, str) else operator.index(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        found = None
    if found is None or isinstance(value, bool):
        raise InvalidArgument(f"{name} {value!r} is not a whole number in [{least}, {most}]")
    if not least <= found <= most:
        raise InvalidArgument(f"{name} {value} is out of range [{least}, {most}]")
    return found


def whole_text(value: Any) -> Any:
    """The text of a whole number; anything else as it is."""
    return str(operator.index(value)) if hasattr(value, "__index__") and not isinstance(value, (bool, numpy.bool_)) else value


def flag(name: str, value: object) -> bool:
    if isinstance(value, (bool, numpy.bool_)):
        return bool(value)
    raise InvalidArgument(f"{name} {value!r} is neither True nor False")


def choice(name: str, value: object, choices: Sequence[str]) -> int:
    """Its index."""
    if str(value) in choices:
        return choices.index(str(value))
    raise InvalidArgument(f"{name} '{value}' is not one of {', '.join(choices)}")


def _listed(value: Any, separator: str = ",") -> list[Any]:
    return value.split(separator) if isinstance(value, str) else list(value) if isinstance(value, Iterable) else [value]


def _parts(name: str, value: object, count: int, shape: str) -> list[Any]:
    found = _listed(value)
    if len(found) != count:
        raise InvalidArgument(f"{name} {value!r} is not {shape}")
    return found


def point(name: str, value: object) -> Vector:
    x, y, z = (number(name, part, -MOST_COORDINATE, MOST_COORDINATE) for part in _parts(name, value, 3, "X,Y,Z"))
    return x, y, z


def _direction(name: str, value: object) -> Vector:
    found = point(name, value)
    if found == (0, 0, 0):
        raise InvalidArgument(f"{name} {value} has no direction")
    return found


def vec3(vector: Iterable[float]) -> Any:
    return schema.Vec3(**dict(zip("xyz", vector)))


def size(name: str, value: object) -> Any:
    """ImageSize: (640, 480), "640x480", or one number for a square."""
    sides = _listed(value, "x")
    if len(sides) not in (1, 2):
        raise InvalidArgument(f"{name} {value!r} is neither WIDTHxHEIGHT nor one number")
    return schema.ImageSize(width=integer(name, sides[0], 1, MOST_SIDE), height=integer(name, sides[-1], 1, MOST_SIDE))


def scalar_range(name: str, value: object) -> Any:
    """ScalarRange: (0, 255), "0:255", "2%:98%"."""
    if isinstance(value, str):
        ends: list[Any] = value.split(":")
        percentiles = all(end.endswith("%") for end in ends)
        if len(ends) != 2 or any(end.endswith("%") for end in ends) != percentiles:
            raise InvalidArgument(f"{name} '{value}' is neither LOW:HIGH nor LOW%:HIGH%")
        ends = [end.rstrip("%") for end in ends]
    else:
        ends, percentiles = _parts(name, value, 2, "LOW:HIGH"), False
    least, most = (0.0, 100.0) if percentiles else (-MOST_SCALAR, MOST_SCALAR)
    low, high = (number(name, end, least, most) for end in ends)
    if low >= high:
        raise InvalidArgument(f"{name} {value!r} must rise")
    return schema.ScalarRange(min=low, max=high, percentiles=percentiles)


_CLIP_UNITS = {"": schema.CLIP_UNIT_WORLD, "v": schema.CLIP_UNIT_VOXELS, "%": schema.CLIP_UNIT_PERCENT}


def color_map_name(name: str, value: object) -> str:
    if not isinstance(value, str) or not 1 <= len(value.encode()) <= MOST_NAME_BYTES:
        raise InvalidArgument(f"{name} {value!r} must be the name of a colour map")
    return value


def clip_box(name: str, value: object) -> Any:
    """ClipBox: ((x0, x1), (y0, y1), (z0, z1)), with None for a bound that does not clip, and "v" for voxels or "%" of the sides as a fourth
    value; or "X0:X1,Y0:Y1,Z0:Z1%", where a unit behind any bound is that of all."""
    unit = ""
    if isinstance(value, str):
        unit = "".join(mark for mark in "v%" if mark in value)
        if len(unit) > 1:
            raise InvalidArgument(f"{name} {value!r} has bounds in voxels (v) and in percent (%): all must have one unit")
        axes: list[Any] = [[(end[:-1] if end[-1:] in ("v", "%") else end) or None for end in axis.split(":")] for axis in value.split(",")]
    else:
        axes = list(value) if isinstance(value, Iterable) else []
        if len(axes) == 4 and axes[3] in _CLIP_UNITS:
            unit = axes.pop()
    if len(axes) != 3 or not all(isinstance(axis, Iterable) and len(list(axis)) == 2 for axis in axes):
        raise InvalidArgument(f"{name} {value!r} is not X0:X1,Y0:Y1,Z0:Z1")
    low, high = [], []
    for letter, (begin, end) in zip("xyz", axes):
        low.append(-MOST_COORDINATE if begin is None else number(name, begin, -MOST_COORDINATE, MOST_COORDINATE))
        high.append(MOST_COORDINATE if end is None else number(name, end, -MOST_COORDINATE, MOST_COORDINATE))
        if low[-1] >= high[-1]:
            raise InvalidArgument(f"{name} {value!r}: {letter} runs from {low[-1]:g} to {high[-1]:g}, but must rise")
    return schema.ClipBox(low=vec3(low), high=vec3(high), unit=_CLIP_UNITS[unit])


def _several(value: Any, count: int) -> list[Any]:
    """Values of an option that may be repeated: one of `count` numbers or a text, or a list of such."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        return [value]
    listed = list(value)
    return [listed] if len(listed) == count and not any(isinstance(item, (str, Iterable)) for item in listed) else listed


def clip_planes(name: str, value: object) -> list[Any]:
    """ClipPlanes: (nx, ny, nz, d), or "NX,NY,NZ,D"; or several."""
    found = []
    for item in _several(value, 4):
        parts = _parts(name, item, 4, "NX,NY,NZ,D")
        offset = number(name, parts[3], -MOST_COORDINATE, MOST_COORDINATE)
        found.append(schema.ClipPlane(normal=vec3(_direction(name, parts[:3])), offset=offset))
    return found


def directions(name: str, value: object) -> list[Any]:
    """Vec3 of each."""
    return [vec3(_direction(name, item)) for item in _several(value, 3)]


def color(name: str, value: object) -> Color:
    """(r, g, b) or (r, g, b, a) from 0 to 1, "R,G,B", "#rgb", "#rrggbb", "#rrggbbaa", or a name such as "white"."""
    text = NAMED_COLORS.get(value, value) if isinstance(value, str) else value
    if isinstance(text, str) and text.startswith("#"):
        try:
            digits = "".join(2 * digit for digit in text[1:]) if len(text) == 4 else text[1:]
            codes = bytes.fromhex(digits) if text.isascii() and " " not in text else b""
        except ValueError:
            codes = b""
        if len(codes) not in (3, 4):
            raise InvalidArgument(f"{name} '{value}' is neither #rgb nor #rrggbb nor #rrggbbaa")
        channels = [float(numpy.float32(code) / numpy.float32(255)) for code in codes]
    else:
        parts = _listed(text)
        if len(parts) not in (3, 4):
            raise InvalidArgument(f"{name} {value!r} is neither R,G,B[,A] nor #rrggbb nor the name of a colour")
        channels = [float(numpy.float32(number(name, part, 0, 1))) for part in parts]
    red, green, blue, alpha = [*channels, 1.0][:4]
    return red, green, blue, alpha


def opaque_color(name: str, value: object) -> Any:
    """Color: as color(), without an opacity."""
    red, green, blue, alpha = color(name, value)
    if alpha != 1:
        raise InvalidArgument(f"{name} {value!r} has an opacity of {alpha:g}, but must be opaque")
    return schema.Color(r=red, g=green, b=blue)


def _surface_texts(text: str) -> list[tuple[Any, ...]]:
    """120:red:0.3,300:0.1,0.2,0.3 as its surfaces: a colour that begins with a digit goes on behind two more commas."""
    parts, found = text.split(","), []
    while parts:
        item = parts.pop(0)
        colour = item.partition(":")[2]
        if colour[:1] in set("0123456789.") and colour and len(parts) >= 2:
            item += "," + parts.pop(0) + "," + parts.pop(0)
        found.append(tuple(item.split(":")))
    return found


def isosurfaces(name: str, value: object) -> list[Any]:
    """Isosurfaces, ascending: 120, (120, "red"), (120, "red", 0.3), a list of such, or "120:red:0.3,300"."""
    if isinstance(value, str):
        items = _surface_texts(value)
    else:
        listed = list(value) if isinstance(value, (list, numpy.ndarray)) else [value]
        items = [tuple(item) if isinstance(item, tuple) else (item,) for item in listed]
    if len(items) > MOST_ISOSURFACES:
        raise InvalidArgument(f"{name} {value!r} has more than {MOST_ISOSURFACES} values")
    found = []
    for item, usual in zip(items, _ISOSURFACE_COLORS):
        if not 1 <= len(item) <= 3:
            raise InvalidArgument(f"{name} {item!r} is not V[:COLOUR[:OPACITY]]")
        red, green, blue, opacity = color(name, item[1]) if len(item) > 1 else (*usual, 1.0)
        if len(item) > 2:
            opacity = number(name, item[2], 0, 1)
        at = number(name, item[0], -MOST_SCALAR, MOST_SCALAR)
        found.append(schema.Isosurface(value=at, r=red, g=green, b=blue, opacity=opacity))
    found.sort(key=lambda surface: float(surface.value))
    for one, next_one in zip(found, found[1:]):
        if one.value == next_one.value:
            raise InvalidArgument(f"{name} {value!r} has the value {one.value:g} twice")
    return found


def gradient_opacities(name: str, value: object) -> list[Any]:
    """GradientOpacityPoints: [(0, 0), (40, 1)], or "0:0,40:1"."""
    found = []
    for item in _listed(value):
        item = _listed(item, ":")
        if len(item) != 2:
            raise InvalidArgument(f"{name} {item!r} is not GRADIENT:OPACITY")
        slope, opacity = number(name, item[0], 0, MOST_SCALAR), number(name, item[1], 0, 1)
        found.append(schema.GradientOpacityPoint(slope=slope, opacity=opacity))
    return found


def label_opacities(name: str, value: object) -> list[Any]:
    """LabelOpacities: {3: 0.5, 7: 0}, or "3=0.5,7=0"."""
    if isinstance(value, str):
        pairs: list[Any] = [item.partition("=")[::2] for item in value.split(",")]
    elif isinstance(value, dict):
        pairs = list(value.items())
    else:
        raise InvalidArgument(f"{name} {value!r} is not LABEL=OPACITY,...")
    return [schema.LabelOpacity(value=integer(name, label, 1, MOST_LABEL), opacity=number(name, opacity, 0, 1)) for label, opacity in pairs]


def label_ranges(name: str, value: object) -> list[Any]:
    """LabelRanges: labels, ranges with both ends, names and patterns: [1, (5, 9), "Temporal_*"], 3, or "1,5-9,Temporal_*"."""
    found = []
    for item in _listed(value):
        if isinstance(item, str) and item.strip("0123456789-"):
            if len(item.encode()) > MOST_NAME_BYTES:
                raise InvalidArgument(f"{name} has a name of {len(item.encode())} bytes, at most {MOST_NAME_BYTES} are possible")
            found.append(schema.LabelRange(name=item))
            continue
        if isinstance(item, str) and "-" in item:
            item = item.split("-", 1)
        ends = [item] if isinstance(item, str) or not isinstance(item, Iterable) else list(item)
        if len(ends) not in (1, 2):
            raise InvalidArgument(f"{name} {item!r} is not LABEL[-LABEL]")
        first = integer(name, ends[0], 1, MOST_LABEL)
        found.append(schema.LabelRange(first=first, last=integer(name, ends[-1], first, MOST_LABEL)))
    return found
