"""TransferFunction: colours and opacities of data values."""
from __future__ import annotations

import dataclasses
import json
import os
import pathlib
from typing import Any, Mapping, Sequence

from . import schema
from .errors import InvalidArgument, NotFound

_NUMBERS_PER_POINT = 4
_MOST_POINTS = 4096
_MOST_FILE_BYTES = 16 << 20
_MATERIAL = ("ambient", "diffuse", "specular", "shininess")
_EDGE = 1e-5  # VTK takes midpoints of 0 and 1 too, as this close to the end


@dataclasses.dataclass(frozen=True)
class TransferFunction:
    """A value of the option `transfer`. Values ascend; between points both curves are linear, unless an opacity has a midpoint (0, 1) and a
    sharpness [0, 1] of its own.

        TransferFunction(colors=[(40, (0, 0, 0)), (120, (1, 0.9, 0.8))], opacities=[(40, 0), (120, 0.6)])
    """

    colors: Sequence[tuple[float, tuple[float, float, float]]]     #: data value, and straight (r, g, b) from 0 to 1
    opacities: Sequence[tuple[float, ...]]                        #: data value, opacity from 0 to 1[, midpoint, sharpness]
    material: Mapping[str, float] | None = None                   #: some of ambient, diffuse, specular and shininess

    def message(self) -> Any:
        """TransferFunction of the wire. Its ranges are checked by the service."""
        found = schema.TransferFunction(opacity_distance=1)
        for value, (red, green, blue) in self.colors:
            found.colors.add(value=value, r=red, g=green, b=blue)
        for value, opacity, *shape in self.opacities:
            midpoint, sharpness = [*shape, 0.5, 0.0][:2] if len(shape) != 1 else (shape[0], 0.0)
            found.opacities.add(value=value, opacity=opacity, midpoint=midpoint, sharpness=sharpness)
        if self.material is not None:
            found.material.SetInParent()
            for name, number in _checked_material(self.material, "transfer").items():
                setattr(found.material, name, number)
        return found


def window(width: float, level: float) -> TransferFunction:
    """Black to white, and opaque, round `level`."""
    return TransferFunction([(level - width / 2, (0, 0, 0)), (level + width / 2, (1, 1, 1))], [(level, 1)])


def _curve(preset: dict[str, Any], field: str, name: str) -> list[list[float]]:
    found = preset[field]
    if not isinstance(found, list) or not found or len(found) % _NUMBERS_PER_POINT or len(found) > _NUMBERS_PER_POINT * _MOST_POINTS:
        raise InvalidArgument(f"{name}: {field} must be an array of 4 numbers a point, of 1 to {_MOST_POINTS} points")
    for i, value in enumerate(found):
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InvalidArgument(f"{name}: {field}[{i}] is not a number")
    return [found[i : i + _NUMBERS_PER_POINT] for i in range(0, len(found), _NUMBERS_PER_POINT)]


def _checked_material(material: Any, name: str) -> dict[str, float]:
    if not isinstance(material, Mapping):
        raise InvalidArgument(f"{name}: Material is not an object")
    for field, number in material.items():
        if field not in _MATERIAL:
            raise InvalidArgument(f"{name}: Material has the field {field!r}, must be one of: {', '.join(_MATERIAL)}")
        if isinstance(number, bool) or not isinstance(number, (int, float)):
            raise InvalidArgument(f"{name}: Material.{field} is not a number")
    return dict(material)


def from_paraview(document: Any, name: str = "transfer") -> TransferFunction:
    """A colour map as ParaView exports it: the contents of its JSON file. `name` begins messages."""
    preset = document[0] if isinstance(document, list) and document else document
    if not isinstance(preset, dict) or "RGBPoints" not in preset:
        raise InvalidArgument(f"{name}: not a colour map: RGBPoints is missing")
    colors = [(value, (red, green, blue)) for value, red, green, blue in _curve(preset, "RGBPoints", name)]
    material = _checked_material(preset["Material"], name) if "Material" in preset else None
    if "Points" not in preset:
        return TransferFunction(colors, [(colors[0][0], 0), (colors[-1][0], 1)], material)
    opacities = []
    for value, opacity, midpoint, sharpness in _curve(preset, "Points", name):
        opacities.append((value, opacity, min(max(midpoint, _EDGE), 1 - _EDGE) if midpoint in (0, 1) else midpoint, sharpness))
    return TransferFunction(colors, opacities, material)


def read_paraview(path: str | os.PathLike[str], name: str) -> TransferFunction:
    """The same of a file."""
    try:
        text = pathlib.Path(path).read_bytes()[: _MOST_FILE_BYTES + 1]
    except FileNotFoundError:
        raise NotFound(f"{name} '{path}' does not exist") from None
    except OSError as error:
        raise InvalidArgument(f"{name} '{path}' cannot be read: {error.strerror}") from None
    try:
        document = json.loads(text)
    except ValueError as error:
        raise InvalidArgument(f"{name} {path}: not JSON: {error}") from None
    return from_paraview(document, f"{name} {path}")


def choose(name: str, value: object, choice: Any) -> None:
    """Puts a preset's name, a ParaView colour map (a path, or its contents) or a TransferFunction into a TransferChoice. Whether there is
    such a preset is for the service to say."""
    if isinstance(value, (dict, list)):
        value = from_paraview(value, name)
    elif isinstance(value, os.PathLike) or (isinstance(value, str) and (value.endswith(".json") or "/" in value)):
        value = read_paraview(value, name)
    if isinstance(value, TransferFunction):
        choice.function.CopyFrom(value.message())
    elif isinstance(value, str) and value:
        choice.preset = value
    else:
        raise InvalidArgument(f"{name} {value!r} is neither the name of a preset nor a colour map")
