"""TransferFunction: colours and opacities of data values."""
from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import os
from typing import Any, Container, Mapping, Sequence

import numpy

from . import schema
from .errors import InvalidArgument
from .presets import presets
from .values import json_of

_MOST_POINTS = 4096
_MATERIAL = ("ambient", "diffuse", "specular", "shininess")
_MOST_REGIONS, _MOST_CORNERS = 16, 32
_REGION = ("Corners", "Values", "Slopes", "Color", "Opacity", "Softness")
_EDGE = 1e-5  # VTK takes midpoints of 0 and 1 too, as this close to the end


@dataclasses.dataclass(frozen=True)
class Region:
    """What a two-dimensional transfer function shows: a polygon of data values and slopes, which are magnitudes of gradients in data values
    per unit of the world."""

    corners: Sequence[tuple[float, float]]  #: 3 to 32 of (data value, slope), in order
    color: tuple[float, float, float]       #: straight (r, g, b) from 0 to 1
    opacity: float = 1                      #: from 0 to 1
    softness: float = 0.25                  #: width of the soft border: 0 is hard, 1 reaches the middle of a square

    @staticmethod
    def box(values: tuple[float, float], slopes: tuple[float, float], color: tuple[float, float, float], opacity: float = 1,
            softness: float = 0.25) -> Region:
        """All between two values and two slopes."""
        (low, high), (least, most) = values, slopes
        return Region([(low, least), (high, least), (high, most), (low, most)], color, opacity, softness)


@dataclasses.dataclass(frozen=True)
class TransferFunction:
    """A value of the option `transfer`. Values ascend; between points both curves are linear, unless an opacity has a midpoint (0, 1) and a
    sharpness [0, 1] of its own.

        TransferFunction(colors=[(40, (0, 0, 0)), (120, (1, 0.9, 0.8))], opacities=[(40, 0), (120, 0.6)])

    A two-dimensional one has regions in place of the curves; renderers that cast rays show it:

        TransferFunction(regions=[Region.box(values=(150, 600), slopes=(0, 120), color=(0.8, 0.1, 0.1), opacity=0.5)])
    """

    colors: Sequence[tuple[float, tuple[float, float, float]]] = ()  #: data value, and straight (r, g, b) from 0 to 1
    opacities: Sequence[tuple[float, ...]] = ()                     #: data value, opacity from 0 to 1[, midpoint, sharpness]
    material: Mapping[str, float] | None = None                     #: some of ambient, diffuse, specular and shininess
    regions: Sequence[Region] = ()                                  #: at most 16, in place of colours and opacities

    def message(self) -> Any:
        """TransferFunction of the wire. Its ranges are checked by the service."""
        found = schema.TransferFunction(opacity_distance=1)
        for value, (red, green, blue) in self.colors:
            found.colors.add(value=value, r=red, g=green, b=blue)
        for value, opacity, *shape in self.opacities:
            midpoint, sharpness = [*shape, 0.5, 0.0][:2] if len(shape) != 1 else (shape[0], 0.0)
            found.opacities.add(value=value, opacity=opacity, midpoint=midpoint, sharpness=sharpness)
        for region in self.regions:
            red, green, blue = region.color
            added = found.regions.add(r=red, g=green, b=blue, opacity=region.opacity, softness=region.softness)
            for value, slope in region.corners:
                added.corners.add(value=value, slope=slope)
        if self.material is not None:
            found.material.SetInParent()
            for name, number in _checked_material(self.material, "transfer").items():
                setattr(found.material, name, number)
        return found


def window(width: float, level: float) -> TransferFunction:
    """Black to white, and opaque, round `level`."""
    return TransferFunction([(level - width / 2, (0, 0, 0)), (level + width / 2, (1, 1, 1))], [(level, 1)])


def _number(found: Any, name: str) -> float:
    if isinstance(found, bool) or not isinstance(found, (int, float)):
        raise InvalidArgument(f"{name} is not a number")
    return found


def _numbers(found: Any, name: str, counts: Container[int], what: str) -> list[float]:
    if not isinstance(found, list) or len(found) not in counts:
        raise InvalidArgument(f"{name} must be an array of {what}")
    return [_number(value, f"{name}[{i}]") for i, value in enumerate(found)]


def _checked_object(found: Any, name: str, known: Sequence[str]) -> Mapping[str, Any]:
    if not isinstance(found, Mapping):
        raise InvalidArgument(f"{name} is not an object")
    for field in found:
        if field not in known:
            raise InvalidArgument(f"{name} has the field {field!r}, must be one of: {', '.join(known)}")
    return found


def _checked_material(material: Any, name: str) -> dict[str, float]:
    found = _checked_object(material, f"{name}: Material", _MATERIAL)
    return {field: _number(number, f"{name}: Material.{field}") for field, number in found.items()}


def _curve(preset: dict[str, Any], field: str, name: str) -> list[list[float]]:
    found = _numbers(preset[field], f"{name}: {field}", range(4, 4 * _MOST_POINTS + 1, 4), f"4 numbers a point, of 1 to {_MOST_POINTS} points")
    return [found[i : i + 4] for i in range(0, len(found), 4)]


def _region(region: Any, name: str) -> Region:
    found = _checked_object(region, name, _REGION)
    if ("Values" in found) != ("Slopes" in found) or ("Corners" in found) == ("Values" in found):
        raise InvalidArgument(f"{name} must have either Corners or Values and Slopes")
    if "Color" not in found:
        raise InvalidArgument(f"{name} has no Color")
    red, green, blue = _numbers(found["Color"], f"{name}.Color", (3,), "3 numbers")
    shares = {field.lower(): _number(found[field], f"{name}.{field}") for field in ("Opacity", "Softness") if field in found}
    if "Values" in found:
        (low, high), (least, most) = (_numbers(found[field], f"{name}.{field}", (2,), "2 numbers") for field in ("Values", "Slopes"))
        return Region.box((low, high), (least, most), (red, green, blue), **shares)
    counts = range(6, 2 * _MOST_CORNERS + 1, 2)
    corners = _numbers(found["Corners"], f"{name}.Corners", counts, f"6 to {counts[-1]} numbers, 2 a corner")
    return Region(list(zip(corners[::2], corners[1::2])), (red, green, blue), **shares)


def from_paraview(document: Any, name: str = "transfer") -> TransferFunction:
    """A colour map as ParaView exports it: the contents of its JSON file. `name` begins messages."""
    preset = document[0] if isinstance(document, list) and document else document
    if not isinstance(preset, dict) or not preset.keys() & {"RGBPoints", "Regions"}:
        raise InvalidArgument(f"{name}: not a colour map: RGBPoints is missing")
    material = _checked_material(preset["Material"], name) if "Material" in preset else None
    if "Regions" in preset:
        if "RGBPoints" in preset or "Points" in preset:
            raise InvalidArgument(f"{name}: Regions stand in the place of RGBPoints and Points: one of both must go")
        found = preset["Regions"]
        if not isinstance(found, list) or not 1 <= len(found) <= _MOST_REGIONS:
            raise InvalidArgument(f"{name}: Regions must be an array of 1 to {_MOST_REGIONS} regions")
        return TransferFunction(regions=[_region(region, f"{name}: Regions[{i}]") for i, region in enumerate(found)], material=material)
    colors = [(value, (red, green, blue)) for value, red, green, blue in _curve(preset, "RGBPoints", name)]
    if "Points" not in preset:
        return TransferFunction(colors, [(colors[0][0], 0), (colors[-1][0], 1)], material)
    opacities = []
    for value, opacity, midpoint, sharpness in _curve(preset, "Points", name):
        opacities.append((value, opacity, min(max(midpoint, _EDGE), 1 - _EDGE) if midpoint in (0, 1) else midpoint, sharpness))
    return TransferFunction(colors, opacities, material)


Colors = list[tuple[float, float, float]]  # at equal distances, from the least value to the greatest
_MAP_COLORS = 256


def color_map(value: object) -> Colors | None:
    """A colour map of matplotlib, or the name of one that no preset has. None: it is none."""
    if isinstance(value, str):
        if value in presets() or not value.isidentifier() or importlib.util.find_spec("matplotlib") is None:
            return None
        matplotlib: Any = importlib.import_module("matplotlib")
        value = matplotlib.colormaps[value] if value in matplotlib.colormaps else None
    if not (callable(value) and hasattr(value, "N") and hasattr(value, "name")):
        return None
    return [(float(red), float(green), float(blue)) for red, green, blue, *_ in value(numpy.linspace(0, 1, _MAP_COLORS))]


def mapped(colors: Colors, low: float, high: float, opacities: Sequence[Any]) -> Any:
    """TransferFunction of the wire with these colours from `low` to `high`. `opacities`: messages."""
    found = schema.TransferFunction(opacity_distance=1)
    for value, (red, green, blue) in zip(numpy.linspace(low, high, len(colors)), colors):
        found.colors.add(value=float(value), r=red, g=green, b=blue)
    found.opacities.extend(opacities)
    return found


def choose(name: str, value: object, choice: Any) -> None:
    """Puts a preset's name, a ParaView colour map (a path, or its contents) or a TransferFunction into a TransferChoice. Whether there is
    such a preset is for the service to say."""
    if isinstance(value, (dict, list)):
        value = from_paraview(value, name)
    elif isinstance(value, os.PathLike) or (isinstance(value, str) and (value.endswith(".json") or "/" in value)):
        value = from_paraview(json_of(name, value), f"{name} {value}")
    if isinstance(value, TransferFunction):
        choice.function.CopyFrom(value.message())
    elif isinstance(value, str) and value:
        choice.preset = value
    else:
        raise InvalidArgument(f"{name} {value!r} is neither the name of a preset nor a colour map of ParaView or matplotlib")
