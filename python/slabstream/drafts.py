"""Requests made from options: a table that says what each option changes, and the requests of `slabstream render` and `slice`."""
from __future__ import annotations

import dataclasses
import difflib
import functools
import json
import os
import pathlib
from typing import Any, Callable, Iterable, Mapping

from . import schema, transfer, values
from .errors import InvalidArgument, NotFound, UnknownOption
from .image import PictureFormat
from .options import COMMANDS, Option

_MOST_NAME_BYTES = 256


@dataclasses.dataclass
class Draft:
    """A request that is being made from options."""

    frame: Any = dataclasses.field(default_factory=schema.FrameRequest)
    format: PictureFormat = PictureFormat()
    # Of slices.
    plane: str = ""
    at: values.Vector | None = None
    index: int | None = None
    thickness: float = 0.0
    window: float | None = None
    level: float | None = None


Put = Callable[[Draft, Option, Any], None]


# Ways to put a value into a field of the frame, named by its path such as "view.zoom".


def _holder(draft: Draft, path: str) -> tuple[Any, str]:
    *outer, field = path.split(".")
    return functools.reduce(getattr, outer, draft.frame), field


def _number(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        setattr(holder, field, values.number(option.name, value, option.least, option.most, option.above))

    return put


def _integer(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        setattr(holder, field, values.integer(option.name, value, int(option.least), int(option.most)))

    return put


def _flag(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        setattr(holder, field, values.flag(option.name, value))

    return put


def _enum(path: str) -> Put:
    """The schema's enums list the choices in the command line's order, after the one that is never sent."""

    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        setattr(holder, field, 1 + values.choice(option.name, value, option.choices))

    return put


def _text(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        if option.choices:
            values.choice(option.name, value, option.choices)
        if not isinstance(value, str) or not 1 <= len(value.encode()) <= _MOST_NAME_BYTES:
            raise InvalidArgument(f"{option.name} {value!r} must be a text of 1 to {_MOST_NAME_BYTES} bytes")
        setattr(holder, field, value)

    return put


def _set_vector(message: Any, vector: values.Vector) -> None:
    message.x, message.y, message.z = vector


def _point(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        _set_vector(getattr(holder, field), values.point(option.name, value))

    return put


def _transfer(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        transfer.choose(option.name, value, getattr(holder, field))

    return put


def _scalar_range(path: str) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        holder, field = _holder(draft, path)
        low, high, percentiles = values.scalar_range(option.name, value)
        getattr(holder, field).CopyFrom(schema.ScalarRange(min=low, max=high, percentiles=percentiles))

    return put


def _slice_field(parse: Callable[[Option, Any], Any]) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        setattr(draft, option.name, parse(option, value))

    return put


# Options of a form of their own.


def _size(draft: Draft, option: Option, value: Any) -> None:
    draft.frame.size.width, draft.frame.size.height = values.size(option.name, value)


# Azimuth and elevation in degrees, and whether only patients have such a side (common/view/named_view.h).
NAMED_VIEWS: dict[str, tuple[float, float, bool]] = {
    "anterior": (180, 0, True), "posterior": (0, 0, True), "superior": (0, 90, True), "inferior": (180, -90, True),
    "left": (270, 0, False), "right": (90, 0, False), "front": (0, 0, False), "back": (180, 0, False),
    "top": (0, 90, False), "bottom": (0, -90, False),
}


def _look_from(view: Any, side: str, of_patient: bool | None = None) -> None:
    view.azimuth_degrees, view.elevation_degrees, patients = NAMED_VIEWS[side]
    view.of_patient = patients if of_patient is None else of_patient


def _view(draft: Draft, option: Option, value: Any) -> None:
    values.choice(option.name, value, option.choices)
    _look_from(draft.frame.view, value)


def _camera(draft: Draft, option: Option, value: Any) -> None:
    """A file that --save-camera wrote, or its contents: whatever options it stands for, and excludes."""
    if isinstance(value, (str, os.PathLike)):
        try:
            fields = json.loads(pathlib.Path(value).read_bytes())
        except FileNotFoundError:
            raise NotFound(f"{option.name} '{value}' does not exist") from None
        except (OSError, ValueError) as error:
            raise InvalidArgument(f"{option.name} '{value}' cannot be read: {error}") from None
    else:
        fields = value
    if not isinstance(fields, Mapping):
        raise InvalidArgument(f"{option.name} {value!r} is no camera: it is not one JSON object")
    for field, inner in fields.items():
        if field == "of_patient":
            draft.frame.view.of_patient = values.flag(f"{option.name} {field}", inner)
        elif field in option.excludes and field != "view":
            _PUT[field](draft, COMMANDS["render"][field], inner)
        else:
            raise InvalidArgument(f"{option.name} has the field {field!r}, which cameras do not have")


_CLIP_UNITS = {"": schema.CLIP_UNIT_WORLD, "v": schema.CLIP_UNIT_VOXELS, "%": schema.CLIP_UNIT_PERCENT}


def _clip_box(draft: Draft, option: Option, value: Any) -> None:
    low, high, unit = values.clip_box(option.name, value)
    box = draft.frame.clipping.box
    _set_vector(box.low, low)
    _set_vector(box.high, high)
    box.unit = _CLIP_UNITS[unit]


def _several(value: Any, count: int) -> list[Any]:
    """Values of an option that may be repeated: one of `count` numbers or a text, or a list of such."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        return [value]
    listed = list(value)
    return [listed] if len(listed) == count and not any(isinstance(item, (str, Iterable)) for item in listed) else listed


def _clip_planes(draft: Draft, option: Option, value: Any) -> None:
    for item in _several(value, 4):
        normal, offset = values.clip_plane(option.name, item)
        plane = draft.frame.clipping.clip_planes.add(offset=offset)
        _set_vector(plane.normal, normal)


def _lights(draft: Draft, option: Option, value: Any) -> None:
    for item in _several(value, 3):
        _set_vector(draft.frame.shading.lights.add(), values.direction(option.name, item))


def _isovalue(draft: Draft, option: Option, value: Any) -> None:
    for surface, (red, green, blue), opacity in values.isosurfaces(option.name, value):
        draft.frame.transfer.isosurfaces.add(value=surface, r=red, g=green, b=blue, opacity=opacity)


def _gradient_opacity(draft: Draft, option: Option, value: Any) -> None:
    for slope, opacity in values.gradient_opacities(option.name, value):
        draft.frame.transfer.gradient_opacities.add(slope=slope, opacity=opacity)


def _parameter(draft: Draft, option: Option, value: Any) -> None:
    if option.choices:
        values.choice(option.name, value, option.choices)
        draft.frame.parameters.add(name=option.text_name, text=str(value))
    else:
        number = values.number(option.name, value, option.least, option.most, option.above)
        draft.frame.parameters.add(name=option.text_name, text=values.text_of(number))


def _groups(draft: Draft, option: Option, value: Any) -> None:
    draft.frame.policy.groups = 0 if value == "auto" else values.integer(option.name, value, 0, 1024)


def _label_opacity(draft: Draft, option: Option, value: Any) -> None:
    for label, opacity in values.label_opacities(option.name, value):
        draft.frame.labels.opacities.add(value=label, opacity=opacity)


def _labels_shown(draft: Draft, option: Option, value: Any) -> None:
    for first, last in values.label_ranges(option.name, value):
        draft.frame.labels.shown.add(first=first, last=last)


def _layer(draft: Draft, option: Option, value: Any) -> None:
    """labels=True, overlay=True: shown as usual. Files belong to the dataset."""
    if value is not True:
        raise InvalidArgument(f"{option.name} {value!r} must be True: at a service, layers belong to the dataset (add_data, render of a file)")


def _background(draft: Draft, option: Option, value: Any) -> None:
    draft.format = dataclasses.replace(draft.format, background=values.color(option.name, value))


def _depth(draft: Draft, option: Option, value: Any) -> None:
    draft.format = dataclasses.replace(draft.format, png_bits=(8, 16)[values.choice(option.name, value, option.choices)])


#: Every option of options.json is here.
_PUT: dict[str, Put] = {
    # View
    "size": _size,
    "projection": _enum("view.projection"),
    "view": _view,
    "azimuth": _number("view.azimuth_degrees"),
    "elevation": _number("view.elevation_degrees"),
    "look_at": _point("view.look_at"),
    "fit": _flag("view.fit"),
    "eye": _point("view.eye"),
    "up": _point("view.up"),
    "distance": _number("view.distance"),
    "roll": _number("view.roll_degrees"),
    "zoom": _number("view.zoom"),
    "fov": _number("view.fov_degrees"),
    "camera": _camera,
    # Clipping
    "clip_box": _clip_box,
    "clip_plane": _clip_planes,
    "clip_mode": _enum("clipping.mode"),
    # Look
    "renderer": _text("renderer"),
    "interpolation": _parameter,
    "kernel": _parameter,
    "projection_mode": _parameter,
    "sampling_rate": _parameter,
    "supersampling": _parameter,
    "transfer": _transfer("transfer"),
    "scalar_range": _scalar_range("transfer.scalar_range"),
    "opacity_distance": _number("transfer.opacity_distance"),
    "isovalue": _isovalue,
    "gradient_opacity": _gradient_opacity,
    "shading": _enum("shading.model"),
    "light": _lights,
    "termination": _number("termination"),
    "background": _background,
    "depth": _depth,
    # Layers
    "labels": _layer,
    "overlay": _layer,
    "label_mode": _enum("labels.mode"),
    "label_tint": _number("labels.tint"),
    "label_opacity": _label_opacity,
    "labels_shown": _labels_shown,
    "overlay_transfer": _transfer("overlay.transfer"),
    "overlay_range": _scalar_range("overlay.transfer.scalar_range"),
    "overlay_weight": _number("overlay.weight"),
    # Distribution
    "decomposition": _text("policy.decomposition"),
    "axis": _enum("policy.axis"),
    "balance_by": _text("policy.load_metric"),
    "assignment": _text("policy.assignment"),
    "balance": _text("policy.balance"),
    "groups": _groups,
    "frame_parallel": _integer("policy.teams"),
    "combine": _text("policy.combine"),
    "pixel_error": _number("policy.pixel_error"),
    # Plane, of slices
    "plane": _slice_field(lambda option, value: option.choices[values.choice(option.name, value, option.choices)]),
    "at": _slice_field(lambda option, value: values.point(option.name, value)),
    "index": _slice_field(lambda option, value: values.integer(option.name, value, 0, 65534)),
    "thickness": _slice_field(lambda option, value: values.number(option.name, value, option.least, option.most)),
    "window": _slice_field(lambda option, value: values.number(option.name, value, 0, 1e30, above=True)),
    "level": _slice_field(lambda option, value: values.number(option.name, value, -1e30, 1e30)),
}

_PARAMETERS = {name for name, put in _PUT.items() if put is _parameter}
_LABELS = {"labels", "label_mode", "label_tint", "label_opacity", "labels_shown"}
_OVERLAY = {"overlay", "overlay_transfer", "overlay_range", "overlay_weight"}
# Their defaults are told in words.
_WORDED = {"level"}


def _check(command: str, given: Mapping[str, Any]) -> None:
    known = COMMANDS[command]
    for name in given:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1, 0.6)
            raise UnknownOption(f"there is no option '{name}'" + (f"; is '{close[0]}' meant?" if close else ""))
    for name in given:
        for other in known[name].excludes:
            if other in given:
                raise InvalidArgument(f"{name} excludes {other}")
        for other in known[name].needs:
            if other in known and other not in given:
                raise InvalidArgument(f"{name} requires {other}")


def _put_all(draft: Draft, command: str, given: Mapping[str, Any]) -> None:
    """The command's defaults, then what is given."""
    labels, overlay = bool(_LABELS & set(given)), bool(_OVERLAY & set(given))
    for name, option in COMMANDS[command].items():
        shown = name not in _PARAMETERS and (labels or name not in _LABELS) and (overlay or name not in _OVERLAY)
        if shown and option.default is not None and name not in _WORDED:
            _PUT[name](draft, option, option.default)
    if overlay:
        draft.frame.overlay.transfer.opacity_distance = 1
    for name, value in given.items():
        _PUT[name](draft, COMMANDS[command][name], value)


def _given(options: Mapping[str, Any]) -> dict[str, Any]:
    """None says that an option is not given; so does False of a layer."""
    return {name: value for name, value in options.items() if not (value is None or (value is False and name in ("labels", "overlay")))}


def draft_of(dataset: str, options: Mapping[str, Any]) -> Draft:
    """The request of `slabstream render` with these options. InvalidArgument, UnknownOption: the sentence names the option."""
    given = _given(options)
    _check("render", given)
    draft = Draft()
    frame = draft.frame
    if not isinstance(dataset, str) or not 1 <= len(dataset.encode()) <= _MOST_NAME_BYTES:
        raise InvalidArgument(f"dataset {dataset!r} must be a name of 1 to {_MOST_NAME_BYTES} bytes")
    frame.dataset = dataset
    # No options, but always sent: common/view/shading.h.
    frame.shading.ambient, frame.shading.diffuse, frame.shading.specular, frame.shading.shininess = 0.2, 0.8, 0.2, 20
    _put_all(draft, "render", given)
    if "isovalue" in given and "transfer" not in given:
        frame.transfer.preset = "none"  # they stand alone
    if not (frame.clipping.HasField("box") or frame.clipping.clip_planes):
        frame.ClearField("clipping")
    return draft


# How one looks at a plane: the view, the plane's normal, and whether only patients have it (client/cli/slice_planes.h).
_PLANES: dict[str, tuple[str, values.Vector, bool]] = {
    "axial": ("inferior", (0, 0, 1), True),
    "coronal": ("anterior", (0, 1, 0), True),
    "sagittal": ("left", (1, 0, 0), True),
    "z": ("top", (0, 0, 1), False),
    "y": ("front", (0, 1, 0), False),
    "x": ("right", (1, 0, 0), False),
}
_SEVERAL_PLANES = {"anatomical": ("axial", "coronal", "sagittal"), "zyx": ("z", "y", "x")}


def slice_drafts_of(dataset: str, options: Mapping[str, Any]) -> list[Draft]:
    """The requests of `slabstream slice` with these options, one a plane, from left to right."""
    given = _given(options)
    _check("slice", given)
    planes = Draft()
    _put_all(planes, "slice", given)
    layers = planes.frame.HasField("labels") or planes.frame.HasField("overlay")
    if layers and planes.thickness > 0:
        raise InvalidArgument(f"thickness {planes.thickness:g} is no plane, and layers are shown in planes only")
    names = _SEVERAL_PLANES.get(planes.plane, (planes.plane,))
    if planes.index is not None and len(names) > 1:
        raise InvalidArgument(f"index {planes.index} is the number of a slice of one plane, but there are {len(names)}")
    if planes.window is not None:
        level = planes.window / 2 if planes.level is None else planes.level
        planes.frame.transfer.function.CopyFrom(transfer.window(planes.window, level).message())
    drafts = []
    for name in names:
        side, normal, of_patient = _PLANES[name]
        draft = draft_of(dataset, {})
        draft.format = planes.format
        frame = draft.frame
        frame.transfer.Clear()
        frame.MergeFrom(planes.frame)
        frame.renderer = "raycast" if layers else "mip"
        if layers:
            frame.shading.model = schema.SHADING_MODEL_NONE
        _look_from(frame.view, side, of_patient)
        frame.view.fit = True
        slab = frame.clipping.slab
        frame.clipping.mode = schema.CLIP_MODE_KEEP
        _set_vector(slab.normal, normal)
        slab.thickness = planes.thickness
        if planes.at is not None:
            _set_vector(slab.through, planes.at)
        if planes.index is not None:
            slab.slice = planes.index + 1
        drafts.append(draft)
    return drafts
