"""Annotations of pictures (title, scale bar, sides of a patient, axes, colour bar and legend), drawn by the program `slabstream`, so that they are
those of the command line; and files of types that it alone writes."""
from __future__ import annotations

import dataclasses
import json
from typing import Any, Sequence

import numpy

from .errors import NotFound, Unavailable
from .programs import find_program, run_program
from .runs import Floats


@dataclasses.dataclass(frozen=True)
class Annotations:
    """As the options of these names."""

    title: str = ""
    scale_bar: bool = False
    orientation_marker: bool = False
    sides_only: bool = False       # of a patient the letters without the axes, as in slices
    axes: str = "off"              # round the volume: "box", "axes" or "grid"
    color_bar: str | None = None   # its caption; "": none
    legend: bool = False
    font_size: float | None = None  # points

    def any(self) -> bool:
        return bool(self.title) or self.scale_bar or self.orientation_marker or self.axes != "off" or self.need_key()

    def need_key(self) -> bool:
        return self.color_bar is not None or self.legend


def key_of(message: Any) -> dict[str, Any]:
    """What colour bars and legend say."""
    bars = [{"name": bar.name, "colors": [[point.value, point.r, point.g, point.b] for point in bar.colors]} for bar in message.bars]
    entries = [{"name": entry.name, "color": [entry.red, entry.green, entry.blue]} for entry in message.entries]
    return {name: values for name, values in (("bars", bars), ("entries", entries)) if values}


_UNITS = {"file": "unknown", "millimetre": "mm", "micrometre": "µm", "nanometre": "nm", "angstrom": "Å", "centimetre": "cm", "metre": "m"}


def _geometry_fields(geometry: Any) -> dict[str, Any]:
    """As records of pictures have it."""
    fields = dataclasses.asdict(geometry)
    projection = "perspective" if fields.pop("perspective") else "orthographic"
    return {**fields, "projection": projection, "unit": _UNITS.get(geometry.unit, "voxel")}


def _run(rgba: Floats, format: Any, panes: Sequence[Any], purpose: str, **more: Any) -> bytes:
    """What `slabstream annotate` makes of the pixels, over the format's background. `panes`: the geometries of pictures of equal widths, from left to right."""
    height, width = rgba.shape[:2]
    order = {"size": [width, height], "panes": [_geometry_fields(pane) for pane in panes] or [{}], "background": format.background,
             **dataclasses.asdict(format.annotations), "dpi": format.dots_per_inch, "key": format.key, **more}
    try:
        program = find_program()
    except NotFound:
        raise NotFound(f"{purpose} the program slabstream, which is not here: put it on the path, or name its folder in "
                       "$SLABSTREAM_PROGRAMS") from None
    pixels = numpy.ascontiguousarray(rgba, numpy.float32)
    given = json.dumps({name: value for name, value in order.items() if value is not None})
    return run_program(program, "annotate", given=given.encode() + b"\n" + pixels.tobytes())


def draw(rgba: Floats, format: Any, panes: Sequence[Any]) -> Floats:
    """The pixels with the format's annotations on them."""
    drawn = _run(rgba, format, panes, "annotations are drawn by")
    if len(drawn) != rgba.size * 4:
        raise Unavailable(f"slabstream annotate gave {len(drawn)} bytes of {rgba.size * 4}")
    return numpy.frombuffer(drawn, numpy.float32).reshape(rgba.shape)


def encode(rgba: Floats, format: Any, panes: Sequence[Any], ending: str, bits: int, quality: int) -> bytes:
    """A file of the type that has this ending (".jpg"), with the format's annotations."""
    return _run(rgba, format, panes, f"files of type {ending} are written by", file=ending[1:], depth=bits, quality=quality)
