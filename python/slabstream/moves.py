"""Cameras that move: the views of the frames of a turntable, or along a path of cameras.

The path is that of common/view/camera_path.h, which says where its curves come from.
"""
from __future__ import annotations

import bisect
import dataclasses
import math
from typing import Any, Iterator, Mapping, Sequence, Tuple

from . import schema
from .errors import InvalidArgument
from .values import json_of, number

LEAST_CAMERAS, MOST_CAMERAS = 2, 1000
_LEAST_ZOOM, _MOST_ZOOM = 1e-3, 1e4
_LEAST_FOV, _MOST_FOV = 1.0, 60.0

Vector = Tuple[float, float, float]
Rotation = Tuple[float, float, float, float]  # w, x, y, z: a unit quaternion


def turned_views(first: Any, frames: int, turns: int) -> Iterator[Any]:
    """Frame i is turned by i / frames of all turns, from the azimuth of `first` on."""
    for i in range(frames):
        view = schema.ViewParameters()
        view.CopyFrom(first)
        if first.HasField("azimuth_degrees"):
            # Back into one turn, so that a start near the limit of angles stays valid.
            view.azimuth_degrees = math.fmod(first.azimuth_degrees + 360.0 * turns * i / frames, 360.0)
        yield view


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


# ---- vectors and rotations


def _add(a: Sequence[float], b: Sequence[float], scale: float = 1) -> tuple[float, ...]:
    return tuple(x + scale * y for x, y in zip(a, b))


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(a: Sequence[float]) -> tuple[float, ...]:
    return tuple(x / math.hypot(*a) for x in a)


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b))


def _product(a: Rotation, b: Rotation) -> Rotation:
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def _inverse(a: Rotation) -> Rotation:
    return a[0], -a[1], -a[2], -a[3]


def _rotation_by(turn: Sequence[float]) -> Rotation:
    """By |turn| radians about `turn`."""
    half = 0.5 * math.hypot(*turn)
    scale = 0.5 if half < 1e-9 else 0.5 * math.sin(half) / half
    return math.cos(half), scale * turn[0], scale * turn[1], scale * turn[2]


def _turn_of(rotation: Rotation) -> tuple[float, ...]:
    """The shortest turn that makes the rotation."""
    sign = -1 if rotation[0] < 0 else 1
    sine = math.hypot(*rotation[1:])
    scale = sign * (2 if sine < 1e-9 else 2 * math.atan2(sine, sign * rotation[0]) / sine)
    return tuple(scale * x for x in rotation[1:])


_Axes = Tuple[Sequence[float], Sequence[float], Sequence[float]]  # to the right and upwards in the picture, and away from the viewer


def _axes_of(view: Any) -> _Axes:
    roll = math.radians(view.roll_degrees)
    if view.HasField("eye"):
        target, eye = _point(view.look_at), _point(view.eye)
        forward = _unit(_add(target, eye, -1))
        right: Sequence[float] = _cross(forward, _unit(_point(view.up)) if view.HasField("up") else (0, 0, 1))
        if math.hypot(*right) < 1e-6:
            right = _cross(forward, (0, 1, 0))
        right = _unit(right)
        up: Sequence[float] = _cross(right, forward)
    else:
        azimuth, elevation = math.radians(view.azimuth_degrees), math.radians(view.elevation_degrees)
        sa, ca, se, ce = math.sin(azimuth), math.cos(azimuth), math.sin(elevation), math.cos(elevation)
        right, up, forward = (ca, sa, 0.0), (-se * sa, se * ca, ce), (-ce * sa, ce * ca, -se)
    c, s = math.cos(roll), math.sin(roll)
    return _add([c * x for x in right], up, s), _add([c * x for x in up], right, -s), forward


def _point(v: Any) -> Vector:
    return v.x, v.y, v.z


def _rotation_of(axes: _Axes) -> Rotation:
    x, y, z = axes[0], axes[1], [-f for f in axes[2]]
    squares = (1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2])
    largest = max(range(4), key=lambda i: squares[i])
    twice = math.sqrt(squares[largest])
    scale = 0.5 / twice
    xy, yz, zx = scale * (x[1] + y[0]), scale * (y[2] + z[1]), scale * (z[0] + x[2])
    wx, wy, wz = scale * (y[2] - z[1]), scale * (z[0] - x[2]), scale * (x[1] - y[0])
    half = 0.5 * twice
    return ((half, wx, wy, wz), (wx, half, xy, zx), (wy, xy, half, yz), (wz, zx, yz, half))[largest]


def _turn_to(rotation: Rotation, view: Any) -> None:
    w, x, y, z = rotation
    right = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    forward = -2 * (x * z + w * y), -2 * (y * z - w * x), -1 + 2 * (x * x + y * y)
    view.ClearField("eye")
    view.ClearField("up")
    view.elevation_degrees = math.degrees(math.asin(max(-1.0, min(1.0, -forward[2]))))
    pole = math.hypot(forward[0], forward[1]) < 1e-9  # there, azimuth and roll turn the picture alike
    view.azimuth_degrees = math.degrees(math.atan2(right[1], right[0]) if pole else math.atan2(-forward[0], forward[1]))
    view.roll_degrees = 0
    level_right, level_up, _ = _axes_of(view)
    view.roll_degrees = math.degrees(math.atan2(_dot(right, level_up), _dot(right, level_right)))


# ---- the path


@dataclasses.dataclass
class _Knot:
    time: float
    view: Any
    numbers: tuple[float, ...]  # target x, y, z; logarithms of zoom and distance; field of view
    rotation: Rotation
    slopes: tuple[float, ...] = ()
    spin: tuple[float, ...] = ()


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


def _knot(time: float, view: Any) -> _Knot:
    target = _point(view.look_at) if view.HasField("look_at") else (0.0, 0.0, 0.0)
    distance = math.dist(target, _point(view.eye)) if view.HasField("eye") else view.distance
    numbers = (*target, math.log(view.zoom), math.log(distance) if distance > 0 else 0.0, view.fov_degrees)
    return _Knot(time, view, numbers, _rotation_of(_axes_of(view)))


def _slope_between(before: Sequence[float], after: Sequence[float], time_before: float, time_after: float) -> tuple[float, ...]:
    """The slope of the parabola through three points, at the middle one: `before` and `after` are the slopes of its chords."""
    return tuple((time_after * b + time_before * a) / (time_before + time_after) for b, a in zip(before, after))


class Path:
    def __init__(self, times: Sequence[float], views: Sequence[Any]):
        """Views are complete, as the service fills them in."""
        _check(times, views)
        self._knots = [_knot(time, view) for time, view in zip(times, views)]
        pairs = list(zip(self._knots, self._knots[1:]))
        lengths = [b.time - a.time for a, b in pairs]
        chords = [tuple((y - x) / length for x, y in zip(a.numbers, b.numbers)) for (a, b), length in zip(pairs, lengths)]
        turns = [tuple(t / length for t in _turn_of(_product(_inverse(a.rotation), b.rotation))) for (a, b), length in zip(pairs, lengths)]
        for i, knot in enumerate(self._knots):
            before, after = max(i - 1, 0), min(i, len(pairs) - 1)
            knot.slopes = _slope_between(chords[before], chords[after], lengths[before], lengths[after])
            knot.spin = _slope_between(turns[before], turns[after], lengths[before], lengths[after])

    def views(self, frames: int) -> Iterator[Any]:
        """The first camera is the first frame, the last camera the last one."""
        begin, length = self._knots[0].time, self._knots[-1].time - self._knots[0].time
        for i in range(frames):
            yield self._at(begin if frames == 1 else begin + length * (i / (frames - 1)))

    def _at(self, time: float) -> Any:
        after = bisect.bisect_right([knot.time for knot in self._knots], time)
        a = self._knots[max(after - 1, 0)]
        if after in (0, len(self._knots)) or time == a.time:
            return a.view
        b = self._knots[after]
        length = b.time - a.time
        t = (time - a.time) / length
        b1, b2, b3 = 1 - (1 - t) ** 3, t * t * (3 - 2 * t), t ** 3
        numbers = []
        for x, y, slope_a, slope_b in zip(a.numbers, b.numbers, a.slopes, b.slopes):
            first, third = slope_a * length / 3, slope_b * length / 3
            numbers.append(x + b1 * first + b2 * (y - x - first - third) + b3 * third)
        one, three = [[length / 3 * s for s in knot.spin] for knot in (a, b)]
        between = _product(_inverse(a.rotation), b.rotation)
        two = _turn_of(_product(_product(_rotation_by([-x for x in one]), between), _rotation_by([-x for x in three])))
        rotation = a.rotation
        for turn, share in ((one, b1), (two, b2), (three, b3)):
            rotation = _product(rotation, _rotation_by([share * x for x in turn]))

        view = schema.ViewParameters()
        view.CopyFrom(a.view)
        _turn_to(rotation, view)
        if view.HasField("look_at"):
            view.look_at.x, view.look_at.y, view.look_at.z = numbers[:3]
        view.zoom = max(_LEAST_ZOOM, min(_MOST_ZOOM, math.exp(numbers[3])))
        has_distance = view.projection == schema.PROJECTION_PERSPECTIVE and _has_distance(a.view)
        view.distance = math.exp(numbers[4]) if has_distance else 0
        view.fov_degrees = max(_LEAST_FOV, min(_MOST_FOV, numbers[5]))
        return view
