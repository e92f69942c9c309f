"""What a picture of a layer of napari shows: its volume at a service, its camera and its look, as options of Slabstream.

Pure: neither Qt nor the canvas. Vectors of the scene are those of the three displayed dimensions, in napari's order; vectors of a service
are x, y, z.
"""
from __future__ import annotations

import dataclasses
import itertools
import math
import os
import time
from typing import Any

import numpy as np
import slabstream as ss
from slabstream.moves import ball_of, perspective_of

_POINTS = 65  # of a colour map in a transfer function
_DENSE = 0.25  # opacity of a voxel length at the upper contrast limit, in modes that add up opacities
_BESIDE = 1 / 4096  # of the contrast limits: what has another opacity than the limit itself
_UPRIGHT = 1e-3  # by which axes may miss right angles, and sides their lengths
_LEAST_ZOOM, _MOST_ZOOM = 0.001, 10000.0
_OWNED_BYTES = 1 << 30  # larger arrays of dask stay where they are, and are computed chunk by chunk
_MOST_BOXES = 4096
_COME_SECONDS, _ASK_AGAIN_SECONDS = 20.0, 0.05
_ADDRESSES = (".zarr", ".n5", ".ims")  # whose levels and channels a service reads itself

#: Renderers by napari's mode of rendering.
_MODES: dict[str, dict[str, Any]] = {
    "mip": {"renderer": "mip"}, "attenuated_mip": {"renderer": "mip"}, "minip": {"renderer": "mip", "projection_mode": "minimum"},
    "average": {"renderer": "mip", "projection_mode": "mean"}, "iso": {"renderer": "raycast"},
    "translucent": {"renderer": "raycast", "shading": "none"}, "additive": {"renderer": "raycast", "shading": "none"},
}


class NotShown(Exception):
    """Why napari goes on drawing a layer itself, in a sentence."""


def is_volume(layer: Any) -> bool:
    return type(layer).__name__ == "Image" and not layer.rgb and layer.ndim >= 3


@dataclasses.dataclass(frozen=True)
class Camera:
    """How the canvas shows the scene. Picture and canvas have the same middle."""

    width: int         # of the canvas, in its own pixels
    height: int
    zoom: float        # pixels of the canvas a unit of the scene
    perspective: float  # vertical field of view in degrees; 0: orthographic
    center: tuple[float, ...]
    forward: tuple[float, ...]
    up: tuple[float, ...]
    mirrored: bool     # right is not forward x up, in napari's order of axes


def camera_model(viewer: Any) -> Any:
    return getattr(viewer, "scene", viewer).camera  # napari 0.9 moved it


def camera_of(viewer: Any, height: int, width: int) -> Camera:
    camera = camera_model(viewer)
    handedness = str(getattr(camera, "handedness", "left"))
    return Camera(int(width), int(height), float(camera.zoom), float(camera.perspective), tuple(map(float, camera.center)),
                  tuple(map(float, camera.view_direction)), tuple(map(float, camera.up_direction)), "left" in handedness.lower())


@dataclasses.dataclass(frozen=True)
class Place:
    """Which voxels of a layer the scene shows, and where."""

    index: tuple[int | None, ...]           # of the layer's data; None: an axis of the volume, of which there are three
    columns: tuple[tuple[float, ...], ...]  # from a voxel to the next one along each of these axes, in the scene
    origin: tuple[float, ...]               # of voxel (0, 0, 0)

    @property
    def spacing(self) -> tuple[float, float, float]:
        z, y, x = (float(np.linalg.norm(column)) for column in self.columns)
        return z, y, x


def place_of(layer: Any, viewer: Any) -> Place:
    dims, apart = viewer.dims, viewer.dims.ndim - layer.ndim
    axes = [axis - apart for axis in dims.displayed]
    if len(axes) != 3 or min(axes) < 0:
        raise NotShown("the layer has fewer axes than the scene shows")
    shape = layer.level_shapes[0] if layer.multiscale else layer.data.shape
    at = np.round(layer.world_to_data(np.asarray(dims.point)[apart:])).astype(int)
    base = np.array([0 if axis in axes else min(max(at[axis], 0), shape[axis] - 1) for axis in range(layer.ndim)], float)
    origin = np.array(layer.data_to_world(base))[axes]
    columns = [np.array(layer.data_to_world(base + np.eye(layer.ndim)[axis]))[axes] - origin for axis in sorted(axes)]
    place = Place(tuple(None if axis in axes else int(base[axis]) for axis in range(layer.ndim)),
                  tuple(tuple(map(float, column)) for column in columns), tuple(map(float, origin)))
    units = np.array(columns) / np.array(place.spacing)[:, None]
    if np.abs(units @ units.T - np.eye(3)).max() > _UPRIGHT:
        raise NotShown("its axes are not at right angles in the scene")
    return place


def _picked(array: Any, index: tuple[int | None, ...]) -> Any:
    return array[tuple(slice(None) if number is None else number for number in index)]


def address_of(layer: Any) -> str | None:
    """Where a service can read the layer's data itself: what layer.metadata["slabstream"] says, else the store that it was opened from."""
    stated, opened = layer.metadata.get("slabstream"), str(layer.source.path or "").rstrip("/")
    path = str(stated or (opened if opened.endswith(_ADDRESSES) else ""))
    if not path and not layer.multiscale and type(layer.data).__module__.startswith("zarr"):
        root = getattr(layer.data.store, "root", None) or getattr(layer.data.store, "path", None)  # of a folder, in zarr 3 and 2
        path = f"{root}/{layer.data.path}".rstrip("/") if root else ""
    if not path:
        return None
    return path if "://" in path or os.path.exists(path.partition("?")[0]) else None


class Source:
    """A volume at a service."""

    def __init__(self, volume: ss.Volume, shape: tuple[int, ...], unit: float = 1, kept: Any = None, **options: Any):
        self.volume, self.shape, self.options, self.kept = volume, shape, options, kept
        self.unit = unit  # of the service's world, in the scene
        self.centre, self.radius = ball_of(volume.service, volume.name, options.get("time"))


def _channel_of(layer: Any, siblings: list[Any], fields: Any) -> int | None:
    """Its number in a store of several: by its name, or by its place among the layers of the store."""
    channels = [field for field in fields if field.channel]
    named = [number for number, field in enumerate(channels) if field.name and layer.name == field.name]
    if len(channels) == 1 or len(named) == 1:
        return 0 if len(channels) == 1 else named[0]
    return siblings.index(layer) if len(siblings) == len(channels) else None


def by_address(layer: Any, siblings: list[Any], address: str, place: Place, service: ss.Service | None) -> Source | None:
    """None: what lies there is not this layer, as far as shape and spacing tell."""
    volume = ss.load(address, service=service)
    volume.render(size=16)  # loads what datasets() then tells of
    dataset = next(each for each in volume.service.datasets() if each.name == volume.name)
    units = np.array(place.spacing) / np.array(dataset.spacing)
    if units.max() - units.min() > _UPRIGHT * units.max():
        return None
    shape = tuple(layer.level_shapes[0] if layer.multiscale else layer.data.shape)
    inner = tuple(side for side, number in zip(shape, place.index) if number is None)
    outer = [(side, number) for side, number in zip(shape, place.index) if number is not None and side > 1]
    if dataset.shape != inner:
        return None
    options: dict[str, Any] = {}
    if dataset.times > 1:
        if not outer or outer[0][0] != dataset.times:
            return None
        options["time"] = outer.pop(0)[1]
    channel = _channel_of(layer, siblings, dataset.fields)
    if outer and outer[0][0] == len(dataset.fields):
        channel = outer.pop(0)[1]
    if outer or channel is None:
        return None
    return Source(volume, inner, float(units.mean()), channels=[channel], **options)


def by_value(layer: Any, place: Place, service: ss.Service | None) -> Source:
    array = _picked(layer.data[0] if layer.multiscale else layer.data, place.index)
    if hasattr(array, "dask") and array.nbytes > _OWNED_BYTES and np.prod(array.numblocks) <= _MOST_BOXES:
        return _owned(array, place, service)
    return Source(ss.load(array, spacing=place.spacing, service=service), tuple(array.shape))


def _owned(array: Any, place: Place, service: ss.Service | None) -> Source:
    """The service asks this process for chunks when a picture needs them."""
    from slabstream.local import running

    service = service or running().service
    name = f"napari-{os.getpid()}-{next(_names)}"
    ends = [np.cumsum(sides).tolist() for sides in array.chunks]
    boxes = list(itertools.product(*([*zip([0, *end[:-1]], end)] for end in ends)))
    blocks = list(np.ndindex(*array.numblocks))
    endpoint = f"{service.endpoint}.workers" if service.endpoint.startswith("ipc:") else None
    owner = ss.Owner(name, array.shape, array.dtype, boxes, spacing=place.spacing, service=endpoint, budget=_OWNED_BYTES,
                     make=lambda box, _: np.ascontiguousarray(array.blocks[blocks[box]].compute()))
    owner.publish(1)
    end = time.monotonic() + _COME_SECONDS
    while all(dataset.name != name for dataset in service.datasets()):
        if time.monotonic() > end:
            raise ss.Unavailable(f"the array's chunks are not known to the service after {_COME_SECONDS:g} s")
        time.sleep(_ASK_AGAIN_SECONDS)
    return Source(ss.Volume(service, name, {}, []), tuple(array.shape), kept=owner)


_names = itertools.count(1)


def camera_options(camera: Camera, place: Place, source: Source, scale: float) -> tuple[dict[str, Any], bool]:
    """Options of a picture `scale` times as large as the canvas, and whether it must be mirrored from left to right."""
    spacing, unit = np.array(place.spacing), source.unit
    to_scene = (np.array(place.columns) / spacing[:, None]).T  # of directions as z, y, x of the service; orthogonal
    middle = np.array(place.origin) + to_scene @ (spacing * (np.array(source.shape) - 1) / 2)

    def there(vector: Any) -> Any:  # of the scene, as x, y, z of the service
        return (to_scene.T @ np.array(vector))[::-1]

    forward, up = there(camera.forward), there(camera.up)
    look_at = np.array(source.centre) + there(np.array(camera.center) - middle) / unit
    right = there(np.cross(camera.forward, camera.up)) * (-1 if camera.mirrored else 1)
    shorter = min(camera.width, camera.height)
    size = (max(round(camera.width * scale), 1), max(round(camera.height * scale), 1))
    options: dict[str, Any] = {"size": size, "look_at": tuple(look_at), "up": tuple(up)}
    if camera.perspective == 0:
        zoom = 2 * source.radius * unit * camera.zoom / shorter
        options.update(eye=tuple(look_at - 4 * source.radius * forward), zoom=min(max(zoom, _LEAST_ZOOM), _MOST_ZOOM))
    else:
        half = math.tan(math.radians(camera.perspective / 2))
        options.update(eye=tuple(look_at - camera.height / (camera.zoom * unit * 2 * half) * forward),
                       **perspective_of(half * shorter / camera.height))
    return options, bool(np.cross(forward, up) @ right < 0)


def look_options(layer: Any) -> dict[str, Any]:
    """Renderer and transfer function: the colour map over the contrast limits, with gamma."""
    low, high = map(float, layer.contrast_limits)
    high = max(high, low + 1e-6 * max(abs(low), 1))
    options = dict(_MODES[str(layer.rendering)])
    share = np.linspace(0, 1, _POINTS)
    rgba = np.asarray(layer.colormap.map(share**float(layer.gamma)), float).clip(0, 1)
    values = (low + (high - low) * share).tolist()
    colors = list(zip(values, map(tuple, rgba[:, :3].tolist())))
    projects = options["renderer"] == "mip"
    if projects:
        options["interpolation"] = "nearest" if str(layer.interpolation3d) == "nearest" else "linear"
    if str(layer.rendering) == "iso":
        at = float(layer.iso_threshold)
        options["isovalue"] = [(at, tuple(rgba[-1, :3].tolist()))]
        return options
    opacities = list(zip(values, (rgba[:, 3] * (1 if projects else _DENSE * share ** float(layer.gamma))).tolist()))
    if str(layer.blending).startswith("translucent"):  # then napari leaves out what lies beyond one of the limits
        beside = (high - low) * _BESIDE
        if str(layer.rendering).endswith("mip"):
            opacities[:1] = [(low, 0.0), (low + beside, opacities[0][1])]
        elif str(layer.rendering) == "minip":
            opacities[-1:] = [(high - beside, opacities[-1][1]), (high, 0.0)]
    options["transfer"] = ss.TransferFunction(colors, opacities)
    return options


def blend(below: Any, rgba: Any, opacity: float, blending: str, first: bool) -> Any:
    """Red, green and blue of the canvas with a picture on it. Pictures are premultiplied; all is from 0 to 1. `first`: nothing but the
    canvas is below, which napari treats apart."""
    color, alpha = rgba[..., :3], rgba[..., 3:]
    if first and blending == "additive":
        return np.where(alpha > 0, opacity * color, below)
    if first or blending in ("translucent", "translucent_no_depth"):
        return opacity * color + (1 - opacity * alpha) * below
    if blending == "additive":
        return np.minimum(below + opacity * color, 1)
    if blending == "multiplicative":
        return below * (1 - alpha + color)
    straight = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
    return np.where(alpha > 0, np.minimum(below, straight) if blending == "minimum" else straight, below)
