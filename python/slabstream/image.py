"""Image: a finished picture, or a preview of one."""
from __future__ import annotations

import dataclasses
import importlib
import os
import pathlib
import secrets
import shutil
import subprocess
import sys
import tempfile
from typing import Any, Sequence

import numpy
import numpy.typing

from . import exr, png, schema
from .annotations import Annotations, draw, encode
from .errors import InvalidArgument, Unavailable
from .runs import Floats, Rectangle

Vector = tuple[float, float, float]

_ENDINGS = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".exr", ".pdf", ".svg")
_ENDINGS_WITH_BITS = (".png", ".tif", ".tiff")
_STAGES = ("fetch", "prepare", "transform", "shade", "splat", "composite", "zbuffer", "combine", "encode", "resolve", "render", "sample")


@dataclasses.dataclass(frozen=True)
class PictureFormat:
    """How pixels become a picture, by whoever shows it."""

    background: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # straight, each in [0, 1]
    png_bits: int = 8  # of PNG and TIFF: 8 or 16
    quality: int = 90  # of JPEG and WebP
    dots_per_inch: int | None = None  # that files state
    annotations: Annotations = Annotations()
    key: dict[str, Any] | None = None  # of colour bar and legend, if they are wanted


@dataclasses.dataclass(frozen=True)
class Geometry:
    """How a picture shows the world of its volume. Vectors are x, y, z of the world, as on the command line."""

    world: str          # "voxels", "scene" or "patient" (x to the patient's right, y to anterior, z to superior)
    unit: str           # of lengths: "voxel", "file" (that of its spacing, which is not known), or "millimetre", "micrometre", ...
    perspective: bool
    right: Vector       # to the right in the picture; the three are unit vectors at right angles
    up: Vector          # upwards in the picture
    forward: Vector     # away from the viewer
    target: Vector      # the point that the picture's centre shows
    target_depth: float
    pixel_size: float   # side of a pixel at the target's depth; in orthographic pictures at any depth
    box_corner: Vector = (0.0, 0.0, 0.0)  # of the volume's box, where the axes of its voxels begin
    box_edges: tuple[Vector, Vector, Vector] = ((0.0, 0.0, 0.0),) * 3  # from there, along these axes; zero: not known


@dataclasses.dataclass(frozen=True)
class Statistics:
    """What a frame cost, and how the service made it."""

    workers: int
    groups: int
    attempts: int                # above 1: workers were lost
    renderer: str                # that made the picture, never "auto"
    decomposition: str
    axis: str
    combine: str
    balance_by: str
    assignment: str
    balance: str
    queued_seconds: float        # from the request's arrival to the plan
    frame_seconds: float         # from the plan to the last byte at the coordinator
    latency_seconds: float       # from submit() to the last byte here
    worker_seconds: dict[str, float]  # worker time by stage, summed over all of them
    levels: tuple[int, ...]      # that the picture was drawn from; 0 is the finest
    voxel_bytes: int             # that workers received for it
    stored_bytes: int            # that were read from the dataset's source for it, as they are stored
    lowered: str                 # with detail="auto": which coarser level was drawn, and why; else empty
    missing: str                 # what the picture lacks, since processes that hold its voxels are gone or late; else empty
    message: Any = dataclasses.field(repr=False)  # FrameStatistics of the wire, with the reports of all ranks


def geometry_of(message: Any) -> Geometry:
    vectors = {name: schema.xyz(getattr(message, name)) for name in ("right", "up", "forward", "target", "box_corner")}
    return schema.read(Geometry, message, box_edges=tuple(map(schema.xyz, (message.box_x, message.box_y, message.box_z))), world=schema.word(message, "world", "voxels"), unit=schema.word(message, "unit", "voxel"),
                       perspective=message.projection == schema.PROJECTION_PERSPECTIVE, **vectors)


def statistics_of(message: Any, latency_seconds: float) -> Statistics:
    stages = dict.fromkeys(_STAGES, 0.0)
    for report in message.reports:
        for name, nanoseconds in zip(_STAGES, report.stage_ns):
            stages[name] += nanoseconds * 1e-9
    return schema.read(
        Statistics, message, message=message, queued_seconds=message.queued_ns * 1e-9,
        frame_seconds=(message.end_ns - message.begin_ns) * 1e-9, latency_seconds=latency_seconds, worker_seconds=stages,
        levels=tuple(use.level for use in message.levels),
        voxel_bytes=sum(report.voxel_bytes for report in message.reports),
        stored_bytes=sum(report.stored_bytes for report in message.reports),
    )


def _codes(rgba: Floats, bits: int) -> numpy.typing.NDArray[Any]:
    """Straight alpha: round(max * clamp(straight value, 0, 1)), halves away from zero, without a transfer curve; as the command line's PNG.
    The arithmetic is that of client/pictures: floats, until the rounding."""
    alpha, most = rgba[..., 3:], numpy.float32(2**bits - 1)
    straight = numpy.zeros_like(rgba)
    numpy.divide(rgba[..., :3], alpha, out=straight[..., :3], where=most * alpha >= numpy.float32(0.5))
    straight[..., 3:] = alpha
    scaled = most * numpy.clip(straight, numpy.float32(0), numpy.float32(1))
    codes: numpy.typing.NDArray[Any] = numpy.floor(scaled.astype(numpy.float64) + 0.5).astype(f"uint{bits}")
    return codes


class Image:
    """A picture. Row 0 is the top.

    numpy.asarray(image) is height, width, 4: uint8 with straight alpha, the same codes as in the command line's PNG. `rgba` has what the
    service sent, over the background. Annotations are drawn onto what it shows: onto files and arrays, not onto `rgba`.
    """

    def __init__(self, rgba: Floats, depth: Floats | None = None, *, format: PictureFormat = PictureFormat(),
                 geometry: Geometry | None = None, statistics: Statistics | None = None, preview: bool = False,
                 panes: Sequence[Geometry] = (), bare: Floats | None = None):
        self.rgba = rgba                #: float32, height, width, 4: premultiplied, linear
        self.depth = depth              #: float32, height, width: camera depth, +infinity where nothing is seen; None: has none
        self.format = format
        self.geometry = geometry        #: how it shows the world; None for pictures put together of several
        self.statistics = statistics    #: None for previews, and pictures put together of several
        self.preview = preview          #: some groups are still missing
        self._panes = list(panes) or ([geometry] if geometry is not None else [])
        self._bare = bare                  # without the background, below which annotations may lie, too
        self._drawn: Floats | None = None  # with annotations

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, as Pillow has it."""
        return self.rgba.shape[1], self.rgba.shape[0]

    @property
    def shape(self) -> tuple[int, int, int]:
        """That of numpy.asarray(image)."""
        return self.rgba.shape[0], self.rgba.shape[1], 4

    def _ground(self) -> tuple[Floats, PictureFormat]:
        """What annotations are drawn onto, and over which background."""
        if self._bare is not None:
            return self._bare, self.format
        opaque = self.format.background[3] == 1
        return self.rgba, self.format if opaque else dataclasses.replace(self.format, background=(0.0, 0.0, 0.0, 0.0))

    def _shown(self) -> Floats:
        annotations = self.format.annotations
        if not annotations.any() or not self._panes:
            return self.rgba
        if self._drawn is None:
            self._drawn = draw(*self._ground(), self._panes)
        return self._drawn

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> numpy.typing.NDArray[Any]:
        codes = _codes(self._shown(), 8)
        return codes if dtype is None else codes.astype(dtype)

    def png(self, bits: int | None = None) -> bytes:
        """The picture as a PNG file with 8 or 16 bits a channel; None: as the option `depth` said."""
        if bits not in (None, 8, 16):
            raise InvalidArgument(f"bits is {bits}, must be 8 or 16")
        return png.encode(_codes(self._shown(), bits or self.format.png_bits), {"Software": "slabstream"}, self.format.dots_per_inch)

    def exr(self) -> bytes:
        """The picture as an OpenEXR file: `rgba` as the channels R, G, B and A, and `depth`, if there is one, as Z."""
        shown = self._shown()
        channels = {name: shown[..., number] for number, name in enumerate("RGBA")}
        if self.depth is not None:
            channels["Z"] = self.depth
        return exr.encode(channels, {"software": "slabstream"}, self.format.dots_per_inch)

    def save(self, path: str | os.PathLike[str], bits: int | None = None) -> None:
        """Writes a file of the type that its name's ending says, whole or not at all: .png, .jpg, .webp, .tif, .exr, .pdf or .svg, with the
        options `quality`, `dpi` and `depth` of the picture. `bits` is for PNG and TIFF, instead of `depth`. The program `slabstream`
        writes all but PNG and OpenEXR, and it must be on this machine for them."""
        file = pathlib.Path(path)
        kind = file.suffix.lower()
        if kind not in _ENDINGS:
            raise InvalidArgument(f"'{file}' must end in {', '.join(_ENDINGS[:-1])} or {_ENDINGS[-1]}; numpy.asarray(image) and image.rgba hold the "
                                  "pixels for other types")
        if bits not in (None, 8, 16):
            raise InvalidArgument(f"bits is {bits}, must be 8 or 16")
        if bits is not None and kind not in _ENDINGS_WITH_BITS:
            raise InvalidArgument(f"bits is {bits}, but samples of {kind} {'are floats' if kind == '.exr' else 'have 8'}")
        if kind == ".exr":
            content = self.exr()
        elif kind == ".png":
            content = self.png(bits)
        else:
            content = encode(*self._ground(), self._panes, kind, bits or self.format.png_bits, self.format.quality)
        temporary = file.with_name(f".{secrets.token_hex(8)}.tmp")
        try:
            try:
                temporary.write_bytes(content)
                temporary.replace(file)
            except BaseException:
                temporary.unlink(missing_ok=True)
                raise
        except OSError as error:
            raise Unavailable(f"cannot write '{file}': {error.strerror}") from None

    def show(self) -> None:
        """Shows the picture: in a notebook below the cell, elsewhere in the desktop's viewer of pictures, from a file that stays until the
        system clears its temporary files."""
        ipython = sys.modules.get("IPython")  # a notebook has loaded it
        if ipython is not None and hasattr(ipython.get_ipython(), "kernel"):
            importlib.import_module("IPython.display").display(self)
            return
        opener = next((found for found in map(shutil.which, ("xdg-open", "open")) if found is not None), None)
        if opener is None or not any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")):
            raise Unavailable("there is no desktop to show the picture on; save() writes it to a file")
        with tempfile.NamedTemporaryFile(prefix="slabstream-", suffix=".png", delete=False) as file:
            file.write(self.png(8))
        subprocess.Popen([opener, file.name], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                         start_new_session=True)

    def _repr_png_(self) -> bytes:
        """For notebooks."""
        return self.png(8)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<slabstream.Image {width}x{height}{' with depth' if self.depth is not None else ''}{', a preview' if self.preview else ''}>"


def compose(part: Rectangle, width: int, height: int, format: PictureFormat) -> tuple[Floats, Floats | None]:
    """The whole picture over its background; and its depths, if it has any."""
    red, green, blue, alpha = (numpy.float32(channel) for channel in format.background)
    behind = numpy.array([red * alpha, green * alpha, blue * alpha, alpha], numpy.float32)
    rgba = numpy.broadcast_to(behind, (height, width, 4)).copy()
    h, w = part.rgba.shape[:2]
    there = (slice(part.y, part.y + h), slice(part.x, part.x + w))
    if alpha > 0:
        rgba[there] = part.rgba + (numpy.float32(1) - part.rgba[..., 3:]) * behind
    else:
        rgba[there] = part.rgba
    depth: Floats | None = None
    if part.depth is not None:
        depth = numpy.full((height, width), numpy.inf, numpy.float32)
        depth[there] = part.depth
    return rgba, depth


def side_by_side(images: list[Image]) -> Image:
    """Pictures of one height, from left to right."""
    if len(images) == 1:
        return images[0]
    bare = [image._bare for image in images if image._bare is not None]
    return Image(numpy.concatenate([image.rgba for image in images], axis=1), format=images[0].format,
                 panes=[image.geometry for image in images if image.geometry is not None],
                 bare=numpy.concatenate(bare, axis=1) if bare else None)
