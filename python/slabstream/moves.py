"""Cameras that move: the views of the frames of a turntable, or along a path of cameras.

The path is that of common/view/camera_path.h, which says where its curves come from.
"""
from __future__ import annotations

import math
from typing import Any, Iterator, Mapping, Sequence

import numpy
import numpy.typing

from . import schema
from .errors import InvalidArgument
from .values import json_of, number

LEAST_CAMERAS, MOST_CAMERAS = 2, 1000
_MOST_TIMES = 1 << 20
_LEAST_ZOOM, _MOST_ZOOM = 1e-3, 1e4
_LEAST_FOV, _MOST_FOV = 1.0, 60.0

Numbers = numpy.typing.NDArray[numpy.float64]


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


# ---- rotations: unit quaternions w, x, y, z; and turns: vectors of as many radians as they are long, about themselves. One, or an array of them.


def _length(vectors: Any) -> Any:
    return numpy.linalg.norm(vectors, axis=-1, keepdims=True)


def _unit(vector: Any) -> Numbers:
    found: Numbers = vector / _length(vector)
    return found


def _product(a: Numbers, b: Numbers) -> Numbers:
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return numpy.concatenate([aw * bw - (av * bv).sum(-1, keepdims=True), aw * bv + bw * av + numpy.cross(av, bv)], -1)


def _inverse(a: Numbers) -> Numbers:
    return a * (1, -1, -1, -1)


def _rotation_by(turn: Numbers) -> Numbers:
    half = 0.5 * _length(turn)
    return numpy.concatenate([numpy.cos(half), 0.5 * numpy.sinc(half / math.pi) * turn], -1)


def _turn_of(rotation: Numbers) -> Numbers:
    """The shortest turn that makes the rotation."""
    rotation = numpy.where(rotation[..., :1] < 0, -rotation, rotation)
    sine = _length(rotation[..., 1:])
    turn: Numbers = 2 / numpy.sinc(numpy.arctan2(sine, rotation[..., :1]) / math.pi) * rotation[..., 1:]
    return turn


def _level_axes(view: Any) -> Any:
    """Three vectors at the view's azimuth and elevation: to the right and upwards, and away from the viewer."""
    azimuth, elevation = math.radians(view.azimuth_degrees), math.radians(view.elevation_degrees)
    sa, ca, se, ce = math.sin(azimuth), math.cos(azimuth), math.sin(elevation), math.cos(elevation)
    return (ca, sa, 0.0), (-se * sa, se * ca, ce), (-ce * sa, ce * ca, -se)


def _axes_of(view: Any) -> Numbers:
    """The same in the picture, which may be rolled."""
    if view.HasField("eye"):
        forward = _unit(numpy.subtract(schema.xyz(view.look_at), schema.xyz(view.eye)))
        right = numpy.cross(forward, _unit(schema.xyz(view.up)) if view.HasField("up") else (0, 0, 1))
        right = _unit(right if numpy.linalg.norm(right) >= 1e-6 else numpy.cross(forward, (0, 1, 0)))
        up = numpy.cross(right, forward)
    else:
        right, up, forward = numpy.array(_level_axes(view))
    c, s = math.cos(math.radians(view.roll_degrees)), math.sin(math.radians(view.roll_degrees))
    return numpy.array([c * right + s * up, c * up - s * right, forward])


def _rotation_of(axes: Numbers) -> Numbers:
    x, y, z = axes * ((1,), (1,), (-1,))
    wx, wy, wz, xy, yz, zx = y[2] - z[1], z[0] - x[2], x[1] - y[0], x[1] + y[0], y[2] + z[1], z[0] + x[2]
    multiples = numpy.array([(1 + x[0] + y[1] + z[2], wx, wy, wz), (wx, 1 + x[0] - y[1] - z[2], xy, zx),
                             (wy, xy, 1 - x[0] + y[1] - z[2], yz), (wz, zx, yz, 1 - x[0] - y[1] + z[2])])
    return _unit(multiples[multiples.diagonal().argmax()])  # the longest


def _turn_to(rotation: Numbers, view: Any) -> None:
    w, x, y, z = rotation.tolist()
    right = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    forward = -2 * (x * z + w * y), -2 * (y * z - w * x), -1 + 2 * (x * x + y * y)
    view.ClearField("eye")
    view.ClearField("up")
    view.elevation_degrees = math.degrees(math.asin(max(-1.0, min(1.0, -forward[2]))))
    pole = math.hypot(forward[0], forward[1]) < 1e-9  # there, azimuth and roll turn the picture alike
    view.azimuth_degrees = math.degrees(math.atan2(right[1], right[0]) if pole else math.atan2(-forward[0], forward[1]))
    across, along = (sum(x * y for x, y in zip(right, axis)) for axis in _level_axes(view)[:2])
    view.roll_degrees = math.degrees(math.atan2(along, across))


# ---- the path


def _has_distance(view: Any) -> bool:
    return bool(view.HasField("eye") or view.distance > 0)


def _check(times: Sequence[float], views: Sequence[Any]) -> None:
    first = views[0]
    for i, view in enumerate(views):
        what = ""
        if view.projection != first.projection:
            what = "has another projection than the first one"
        elif view.HasField("eye") and not view.HasField("look_at"):
            what = "has an eye, but no look-at"
        elif view.HasField("look_at") != first.HasField("look_at"):
            what = "has a look-at, but the first one has none" if view.HasField("look_at") else "has no look-at, but the first one has"
        elif view.projection == schema.PROJECTION_PERSPECTIVE and _has_distance(view) != _has_distance(first):
            what = ("has a distance or an eye, but the first one has none" if _has_distance(view)
                    else "has no distance and no eye, but the first one has")
        elif i > 0 and not times[i] > times[i - 1]:
            what = f"has the time {times[i]:g}, which must be more than {times[i - 1]:g} of the one before"
        if what:
            raise InvalidArgument(f"camera {i + 1} of the path {what}")


def _numbers_of(view: Any) -> tuple[float, ...]:
    """Target x, y, z; logarithms of zoom and distance; field of view."""
    target = schema.xyz(view.look_at) if view.HasField("look_at") else (0.0, 0.0, 0.0)
    distance = math.dist(target, schema.xyz(view.eye)) if view.HasField("eye") else view.distance
    return (*target, math.log(view.zoom), math.log(distance) if distance > 0 else 0.0, view.fov_degrees)


def _moved(before: Any, numbers: Sequence[float], rotation: Numbers) -> Any:
    view = schema.ViewParameters()
    view.CopyFrom(before)
    _turn_to(rotation, view)
    if view.HasField("look_at"):
        view.look_at.x, view.look_at.y, view.look_at.z = numbers[:3]
    view.zoom = max(_LEAST_ZOOM, min(_MOST_ZOOM, math.exp(numbers[3])))
    has_distance = view.projection == schema.PROJECTION_PERSPECTIVE and _has_distance(before)
    view.distance = math.exp(numbers[4]) if has_distance else 0
    view.fov_degrees = max(_LEAST_FOV, min(_MOST_FOV, numbers[5]))
    return view


class Path:
    def __init__(self, times: Sequence[float], views: Sequence[Any]):
        """Views are complete, as the service fills them in."""
        _check(times, views)
        self._times, self._views = numpy.array(times), views
        self._numbers = numpy.array([_numbers_of(view) for view in views])
        self._rotations = numpy.array([_rotation_of(_axes_of(view)) for view in views])
        self._between = _product(_inverse(self._rotations[:-1]), self._rotations[1:])
        self._slopes, self._spins = self._slopes_of(numpy.diff(self._numbers, axis=0)), self._slopes_of(_turn_of(self._between))

    def _slopes_of(self, steps: Numbers) -> Numbers:
        """The slope at each camera of the parabola through it and its neighbours: `steps` lie between them."""
        lengths = numpy.diff(self._times)[:, None]
        chords, camera = steps / lengths, numpy.arange(len(self._times))
        before, after = numpy.maximum(camera - 1, 0), numpy.minimum(camera, len(lengths) - 1)
        slopes: Numbers = (lengths[after] * chords[before] + lengths[before] * chords[after]) / (lengths[before] + lengths[after])
        return slopes

    def views(self, frames: int) -> Iterator[Any]:
        """The first camera is the first frame, the last camera the last one."""
        times = numpy.linspace(self._times[0], self._times[-1], frames)
        b = numpy.clip(numpy.searchsorted(self._times, times, "right"), 1, len(self._times) - 1)
        a = b - 1
        lengths = (self._times[b] - self._times[a])[:, None]
        t = (times - self._times[a])[:, None] / lengths
        b1, b2, b3 = 1 - (1 - t) ** 3, t * t * (3 - 2 * t), t ** 3
        first, third = self._slopes[a] * lengths / 3, self._slopes[b] * lengths / 3
        numbers = self._numbers[a] + b1 * first + b2 * (self._numbers[b] - self._numbers[a] - first - third) + b3 * third
        one, three = self._spins[a] * lengths / 3, self._spins[b] * lengths / 3
        two = _turn_of(_product(_product(_rotation_by(-one), self._between[a]), _rotation_by(-three)))
        rotations = self._rotations[a]
        for turn, share in ((one, b1), (two, b2), (three, b3)):
            rotations = _product(rotations, _rotation_by(share * turn))
        cameras = dict(zip(self._times.tolist(), self._views))
        for i, time in enumerate(times.tolist()):
            yield cameras[time] if time in cameras else _moved(self._views[a[i]], numbers[i].tolist(), rotations[i])
