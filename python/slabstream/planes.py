"""Planes through the volume that show its values: Plane, and the option `plane` of pictures of the whole volume."""
from __future__ import annotations

from typing import Any, Sequence

from . import schema, values
from .errors import InvalidArgument

_MOST_PLANES = 16     # of a picture
_MOST_SLICES = 65535  # of a volume
#: Planes by name: directions of the world.
NORMALS: dict[str, values.Vector] = {
    "axial": (0, 0, 1), "coronal": (0, 1, 0), "sagittal": (1, 0, 0), "x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1),
}
_LOOK = ("opacity", "map", "range")


class Plane:
    """A plane for the option `plane`: "axial", "coronal", "sagittal", "x", "y" or "z", or its normal, a direction (x, y, z) of the world. `at`: a
    number is the coordinate along the plane's axis; three numbers are a point. `index` is the number of a slice instead, from 0. Without them the
    plane goes through the volume's centre. `opacity` in (0, 1]; `map`, a colour map for the values, usually "grey", and the `range` of values that it spans."""

    def __init__(self, plane: str | Sequence[float], at: float | str | Sequence[float] | None = None, *, index: int | None = None,
                 opacity: float | None = None, map: str | None = None, range: Any = None):
        self.choice = schema.PlaneChoice()
        slab = self.choice.slab
        normal = NORMALS.get(plane) if isinstance(plane, str) else values.point("plane", plane)
        if normal is None or not any(normal):
            raise InvalidArgument(f"plane {plane!r} must be one of: {', '.join(NORMALS)}, or a normal (x, y, z) other than (0, 0, 0)")
        slab.normal.CopyFrom(values.vec3(normal))
        if at is not None and index is not None:
            raise InvalidArgument("plane has both at and index, but one is enough")
        if index is not None:
            slab.slice = 1 + values.integer("plane index", index, 0, _MOST_SLICES - 1)
        elif at is not None:
            slab.through.CopyFrom(values.vec3(_through(normal, at)))
        if opacity is not None:
            self.choice.opacity = values.number("plane opacity", opacity, 0, 1, above=True)
        if map is not None:
            self.choice.map = values.color_map_name("plane map", map)
        if range is not None:
            self.choice.range.CopyFrom(values.scalar_range("plane range", range))


def _through(normal: Sequence[float], at: Any) -> Any:
    """A point of the plane."""
    if not isinstance(at, (int, float, str)):
        return values.point("plane at", at)
    axes = [i for i, part in enumerate(normal) if part]
    if len(axes) != 1:
        raise InvalidArgument(f"plane at {at!r} must be a point (x, y, z), since its normal lies along no axis")
    return [values.number("plane at", at, -values.MOST_COORDINATE, values.MOST_COORDINATE) if i == axes[0] else 0.0 for i in (0, 1, 2)]


def _of_text(name: str, text: str) -> Plane:
    """"axial:z=12,opacity=0.4", as the command line takes it."""
    head, *looks = text.split(",")
    plane, _, where = head.partition(":")
    given: dict[str, Any] = {}
    for look in looks:
        key, _, value = look.partition("=")
        if key not in _LOOK or key in given:
            raise InvalidArgument(f"{name} {text!r} has {look!r}, but must have one of: {', '.join(_LOOK)}")
        given[key] = value
    key, _, value = where.partition("=")
    normal: Any = NORMALS.get(plane) or (tuple(plane.split("/")) if plane.count("/") == 2 else plane)
    if key == "index":
        given["index"] = value
    elif key == "at":
        given["at"] = value.split("/")
    elif where:
        axes = [axis for axis, part in zip("xyz", values.point(name, normal) if isinstance(normal, tuple) else ()) if part]
        if axes != [key]:
            raise InvalidArgument(f"{name} {text!r} has {where!r}, but must have index=N, at=X/Y/Z, or x=, y= or z= along its normal")
        given["at"] = value
    return Plane(normal, **given)


def choices(name: str, value: Any) -> list[Any]:
    """The PlaneChoices of the option: a Plane, a text such as "axial:z=12,opacity=0.4", or a list of these."""
    given = list(value) if isinstance(value, (list, tuple)) else [value]
    if len(given) > _MOST_PLANES:
        raise InvalidArgument(f"{name} has {len(given)} planes, at most {_MOST_PLANES} are possible")
    for each in given:
        if not isinstance(each, (str, Plane)):
            raise InvalidArgument(f"{name} {each!r} must be a Plane, or a text such as 'axial:z=12'")
    return [(_of_text(name, each) if isinstance(each, str) else each).choice for each in given]
