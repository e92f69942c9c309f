"""Cameras that move: the views of the frames of a turntable, and the cameras of a path."""
from __future__ import annotations

import math
from typing import Any, Iterator, Mapping, Sequence

import numpy

from . import schema
from .errors import InvalidArgument
from .values import json_of, number

LEAST_CAMERAS, MOST_CAMERAS = 2, 1000
_LEAST_FOV, _MOST_FOV = 1.0, 60.0  # degrees, of the option fov
_MOST_TIMES = 1 << 20


def turned_views(first: Any, frames: int, turns: int) -> Iterator[Any]:
    """Frame i is turned by i / frames of all turns, from the azimuth of `first` on."""
    for i in range(frames):
        view = schema.ViewParameters()
        view.CopyFrom(first)
        if first.HasField("azimuth_degrees"):
            # Back into one turn, so that a start near the limit of angles stays valid.
            view.azimuth_degrees = math.fmod(first.azimuth_degrees + 360.0 * turns * i / frames, 360.0)
        yield view


def times_of(time: Any) -> list[str]:
    """The numbers of "FIRST:LAST" or "FIRST:LAST:STEP"; of anything else none."""
    parts = time.split(":") if isinstance(time, str) else []
    if not 2 <= len(parts) <= 3:
        return []
    numbers = [int(part) for part in parts if part.isascii() and part.isdigit()]
    if len(numbers) < len(parts) or numbers[0] > numbers[1] or max(numbers) >= _MOST_TIMES or 0 in numbers[2:]:
        raise InvalidArgument(f"time '{time}' must be FIRST:LAST or FIRST:LAST:STEP: whole numbers below {_MOST_TIMES}, FIRST not above "
                              "LAST, STEP not 0")
    return [str(number) for number in range(numbers[0], numbers[1] + 1, *numbers[2:])]


def ball_around(a: Any, b: Any) -> Any:
    """The smallest ball around two."""
    centre, other = numpy.array(schema.xyz(a.centre)), numpy.array(schema.xyz(b.centre))
    apart = math.dist(centre, other)
    if abs(a.radius - b.radius) >= apart:
        return a if a.radius >= b.radius else b
    radius = 0.5 * (apart + a.radius + b.radius)
    x, y, z = (centre + (radius - a.radius) / apart * (other - centre)).tolist()
    return schema.Ball(centre=schema.Vec3(x=x, y=y, z=z), radius=radius)


def ball_of(service: Any, dataset: str, time: Any = None) -> tuple[tuple[float, float, float], float]:
    """The ball round a whole volume: its centre, x, y, z of the world, and its radius. At zoom 1 an orthographic picture shows it. A small
    picture tells both."""
    side = 16
    geometry = service.render(dataset, size=side, fit=False, projection="orthographic", azimuth=0, elevation=0, time=time).geometry
    return geometry.target, geometry.pixel_size * side / 2


def perspective_of(slope: float) -> dict[str, Any]:
    """The options of a perspective picture. `slope`: half its shorter side, divided by the distance from the eye, both in the plane of the
    point looked at. The zoom makes up for what the option `fov` cannot take."""
    fov = min(max(2 * math.degrees(math.atan(slope)), _LEAST_FOV), _MOST_FOV)
    return {"projection": "perspective", "fov": fov, "zoom": math.tan(math.radians(fov / 2)) / slope}


def cameras_of(path: Any) -> tuple[list[float], list[dict[str, Any]]]:
    """Times and cameras of a file, or of a list of cameras."""
    path = json_of("path", path)
    if not isinstance(path, Sequence) or isinstance(path, str) or not LEAST_CAMERAS <= len(path) <= MOST_CAMERAS:
        raise InvalidArgument(f"path must be a list of {LEAST_CAMERAS} to {MOST_CAMERAS} cameras")
    times: list[float] = []
    cameras: list[dict[str, Any]] = []
    timed = isinstance(path[0], Mapping) and "time" in path[0]
    for i, camera in enumerate(path):
        if not isinstance(camera, Mapping):
            raise InvalidArgument(f"camera {i + 1} of the path is no camera: it is not one JSON object")
        if ("time" in camera) != timed:
            this, first = ("no", "one") if timed else ("a", "none")
            raise InvalidArgument(f"camera {i + 1} of the path has {this} time, but the first one has {first}")
        times.append(number("time", camera["time"], -1e6, 1e6) if timed else float(i))
        cameras.append({name: value for name, value in camera.items() if name != "time"})
    return times, cameras
