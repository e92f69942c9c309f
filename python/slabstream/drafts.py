"""Requests made from options: those of `slabstream render` and `slice`."""
from __future__ import annotations

import dataclasses
import difflib
import functools
import unicodedata
from typing import Any, Callable, Iterable, Mapping

from google.protobuf.descriptor import FieldDescriptor

from . import schema, transfer, values
from .errors import InvalidArgument, UnknownOption
from .image import PictureFormat
from .options import COMMANDS, Option


@dataclasses.dataclass
class Draft:
    """A request that is being made from options."""

    frame: Any = dataclasses.field(default_factory=schema.FrameRequest)
    format: PictureFormat = PictureFormat()
    colors: transfer.Colors | None = None  # that take the place of those of the preset, once the dataset's values are known
    # Of slices.
    plane: str = ""
    at: values.Vector | None = None
    index: int | None = None
    thickness: float = 0.0
    window: float | None = None
    level: float | None = None


Put = Callable[[Draft, Option, Any], None]


# ---- fields of the request: how a value is put into one follows from the field's type in the schema


def _set_vector(message: Any, vector: values.Vector) -> None:
    message.x, message.y, message.z = vector


_CLIP_UNITS = {"": schema.CLIP_UNIT_WORLD, "v": schema.CLIP_UNIT_VOXELS, "%": schema.CLIP_UNIT_PERCENT}


def _several(value: Any, count: int) -> list[Any]:
    """Values of an option that may be repeated: one of `count` numbers or a text, or a list of such."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        return [value]
    listed = list(value)
    return [listed] if len(listed) == count and not any(isinstance(item, (str, Iterable)) for item in listed) else listed


def _size(size: Any, name: str, value: Any) -> None:
    size.width, size.height = values.size(name, value)


def _scalar_range(scalar_range: Any, name: str, value: Any) -> None:
    scalar_range.min, scalar_range.max, scalar_range.percentiles = values.scalar_range(name, value)


def set_clip_box(box: Any, name: str, value: Any) -> None:
    low, high, unit = values.clip_box(name, value)
    _set_vector(box.low, low)
    _set_vector(box.high, high)
    box.unit = _CLIP_UNITS[unit]


def _clip_planes(planes: Any, name: str, value: Any) -> None:
    for item in _several(value, 4):
        normal, offset = values.clip_plane(name, item)
        _set_vector(planes.add(offset=offset).normal, normal)


def _lights(lights: Any, name: str, value: Any) -> None:
    for item in _several(value, 3):
        _set_vector(lights.add(), values.direction(name, item))


def _isosurfaces(surfaces: Any, name: str, value: Any) -> None:
    for surface, (red, green, blue), opacity in values.isosurfaces(name, value):
        surfaces.add(value=surface, r=red, g=green, b=blue, opacity=opacity)


def _gradient_opacities(points: Any, name: str, value: Any) -> None:
    for slope, opacity in values.gradient_opacities(name, value):
        points.add(slope=slope, opacity=opacity)


def _label_opacities(opacities: Any, name: str, value: Any) -> None:
    for label, opacity in values.label_opacities(name, value):
        opacities.add(value=label, opacity=opacity)


def _label_ranges(ranges: Any, name: str, value: Any) -> None:
    for item in values.label_ranges(name, value):
        if isinstance(item, str):
            ranges.add(name=item)
        else:
            ranges.add(first=item[0], last=item[1])


#: By the type of the field's messages.
_MESSAGES: dict[str, Callable[[Any, str, Any], None]] = {
    "ImageSize": _size, "ScalarRange": _scalar_range, "ClipBox": set_clip_box, "ClipPlane": _clip_planes, "Isosurface": _isosurfaces,
    "GradientOpacityPoint": _gradient_opacities, "LabelOpacity": _label_opacities, "LabelRange": _label_ranges,
}


def _text(option: Option, value: Any) -> str:
    if option.choices:
        values.choice(option.name, value, option.choices)
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)  # level=2
    if not isinstance(value, str) or not 1 <= len(value.encode()) <= values.MOST_NAME_BYTES:
        raise InvalidArgument(f"{option.name} {value!r} must be a text of 1 to {values.MOST_NAME_BYTES} bytes")
    return value


def _scalar(field: FieldDescriptor, option: Option, value: Any) -> Any:
    if field.cpp_type == FieldDescriptor.CPPTYPE_ENUM:  # lists the choices in their order, after the one that is never sent
        return 1 + values.choice(option.name, value, option.choices)
    if field.cpp_type == FieldDescriptor.CPPTYPE_BOOL:
        return values.flag(option.name, value)
    if field.cpp_type == FieldDescriptor.CPPTYPE_STRING:
        return _text(option, value)
    if value == "auto" and (option.type or "").endswith("|auto"):
        return 0  # left to the service
    if field.cpp_type in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        return values.number(option.name, value, option.least, option.most, option.above)
    return values.integer(option.name, value, int(option.least), int(option.most))


def _field(draft: Draft, option: Option, value: Any) -> None:
    *outer, name = option.path.split(".")
    if outer == ["parameters"]:
        return _parameter(draft, option, value)
    holder = functools.reduce(getattr, outer, draft.frame)
    field = holder.DESCRIPTOR.fields_by_name[name]
    if name == "preset":
        _transfer(draft, option, value, holder)
    elif field.message_type is None:
        setattr(holder, name, _scalar(field, option, value))
    elif field.message_type.name == "Vec3" and field.label != FieldDescriptor.LABEL_REPEATED:
        _set_vector(getattr(holder, name), values.point(option.name, value))
    else:
        put = _lights if field.message_type.name == "Vec3" else _MESSAGES[field.message_type.name]
        put(getattr(holder, name), option.name, value)


_PRESET_OF_MAPS = "viridis"  # it spans values and has opacities as all colour maps do


def _transfer(draft: Draft, option: Option, value: Any, choice: Any) -> None:
    colors = transfer.color_map(value)
    if colors is None:
        transfer.choose(option.name, value, choice)
    elif option.path.startswith("transfer."):
        draft.colors, choice.preset = colors, _PRESET_OF_MAPS
    else:  # an overlay's: its values are not known here, so it is stretched over all of them
        choice.function.CopyFrom(transfer.mapped(colors, 0, 1, transfer.TransferFunction(opacities=[(0, 0), (1, 1)]).message().opacities))
        if not choice.HasField("scalar_range"):
            choice.scalar_range.min, choice.scalar_range.max, choice.scalar_range.percentiles = 0, 100, True


def _parameter(draft: Draft, option: Option, value: Any) -> None:
    if option.choices:
        values.choice(option.name, value, option.choices)
        draft.frame.parameters.add(name=option.text_name, text=str(value))
    else:
        number = values.number(option.name, value, option.least, option.most, option.above)
        draft.frame.parameters.add(name=option.text_name, text=values.text_of(number))


# ---- options that are no field, or several


def _slice_field(parse: Callable[[Option, Any], Any]) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        setattr(draft, option.name, parse(option, value))

    return put


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
    fields = values.json_of(option.name, value)
    if not isinstance(fields, Mapping):
        raise InvalidArgument(f"{option.name} {value!r} is no camera: it is not one JSON object")
    for field, inner in fields.items():
        if field.replace("-", "_") in option.excludes and field != "view":
            _put(draft, COMMANDS["render"][field.replace("-", "_")], inner)
        else:
            raise InvalidArgument(f"{option.name} has the field {field!r}, which cameras do not have")


def _layer(draft: Draft, option: Option, value: Any) -> None:
    """labels=True, overlay=True: shown as usual. Files belong to the dataset."""
    if value is not True:
        raise InvalidArgument(f"{option.name} {value!r} must be True: at a service, layers belong to the dataset (add_data, render of a file)")
    getattr(draft.frame, option.name).SetInParent()


def _background(draft: Draft, option: Option, value: Any) -> None:
    draft.format = dataclasses.replace(draft.format, background=values.color(option.name, value))


def _depth(draft: Draft, option: Option, value: Any) -> None:
    draft.format = dataclasses.replace(draft.format, png_bits=(8, 16)[values.choice(option.name, value, option.choices)])


def _format(field: str) -> Put:
    """A whole number of PictureFormat."""

    def put(draft: Draft, option: Option, value: Any) -> None:
        number = values.integer(option.name, value, int(option.least), int(option.most))
        draft.format = dataclasses.replace(draft.format, **{field: number})

    return put


def _annotation(parse: Callable[[Option, Any], Any]) -> Put:
    def put(draft: Draft, option: Option, value: Any) -> None:
        annotations = dataclasses.replace(draft.format.annotations, **{option.name: parse(option, value)})
        draft.format = dataclasses.replace(draft.format, annotations=annotations)

    return put


_MOST_TITLE_CHARACTERS = 120


def _line(option: Option, value: Any) -> str:
    if not isinstance(value, str) or len(value) > _MOST_TITLE_CHARACTERS or any(unicodedata.category(c) == "Cc" for c in value):
        raise InvalidArgument(f"{option.name} {value!r} must be one line of at most {_MOST_TITLE_CHARACTERS} characters")
    return value


def _caption(option: Option, value: Any) -> str | None:
    """True: a bar without a caption."""
    return ("" if value else None) if isinstance(value, bool) else _line(option, value)


def _window(draft: Draft, option: Option, value: Any) -> None:
    if isinstance(value, str) and value[:1].isalpha():
        if value not in option.windows:
            raise InvalidArgument(f"{option.name} '{value}' is neither a number nor one of {', '.join(option.windows)}")
        draft.window, level = option.windows[value]
        draft.level = level if draft.level is None else draft.level
    else:
        draft.window = values.number(option.name, value, 0, 1e30, above=True)


#: Every option of options.json is here, or has a path.
_PUT: dict[str, Put] = {
    "view": _view,
    "camera": _camera,
    "background": _background,
    "depth": _depth,
    "quality": _format("quality"),
    "dpi": _format("dots_per_inch"),
    "font_size": _annotation(lambda option, value: values.number(option.name, value, option.least, option.most)),
    "title": _annotation(_line),
    "scale_bar": _annotation(lambda option, value: values.flag(option.name, value)),
    "orientation_marker": _annotation(lambda option, value: values.flag(option.name, value)),
    "color_bar": _annotation(_caption),
    "legend": _annotation(lambda option, value: values.flag(option.name, value)),
    "labels": _layer,
    "overlay": _layer,
    "plane": _slice_field(lambda option, value: option.choices[values.choice(option.name, value, option.choices)]),
    "at": _slice_field(lambda option, value: values.point(option.name, value)),
    "index": _slice_field(lambda option, value: values.integer(option.name, value, 0, 65534)),
    "thickness": _slice_field(lambda option, value: values.number(option.name, value, option.least, option.most)),
    "window": _window,
    "level": _slice_field(lambda option, value: values.number(option.name, value, -1e30, 1e30)),
}


def _put(draft: Draft, option: Option, value: Any) -> None:
    (_field if option.path else _PUT[option.name])(draft, option, value)


def _check(command: str, given: Mapping[str, Any]) -> None:
    known = COMMANDS[command]
    for name in given:
        if name not in known:
            close = difflib.get_close_matches(name, known, 1, 0.6)
            raise UnknownOption(f"there is no option '{name}'" + (f"; did you mean '{close[0]}'?" if close else ""))
    for name in given:
        for other in known[name].excludes:
            if other in given:
                raise InvalidArgument(f"{name} excludes {other}")
        for other in known[name].needs:
            if other in known and other not in given:
                raise InvalidArgument(f"{name} requires {other}")


def _put_all(draft: Draft, command: str, given: Mapping[str, Any]) -> None:
    """What is left out has its default at the service."""
    for name, value in given.items():
        _put(draft, COMMANDS[command][name], value)


def _given(options: Mapping[str, Any]) -> dict[str, Any]:
    """None says that an option is not given; so does False of a layer."""
    return {name: value for name, value in options.items() if not (value is None or (value is False and name in ("labels", "overlay")))}


def draft_of(dataset: str, options: Mapping[str, Any]) -> Draft:
    """The request of `slabstream render` with these options. InvalidArgument, UnknownOption: the sentence names the option."""
    given = _given(options)
    _check("render", given)
    draft = Draft()
    frame = draft.frame
    if not isinstance(dataset, str) or not 1 <= len(dataset.encode()) <= values.MOST_NAME_BYTES:
        raise InvalidArgument(f"dataset {dataset!r} must be a name of 1 to {values.MOST_NAME_BYTES} bytes")
    frame.dataset = dataset
    _put_all(draft, "render", given)
    if "isovalue" in given and "transfer" not in given:
        frame.transfer.preset = "none"  # they stand alone
    if not frame.HasField("size"):
        _put(draft, COMMANDS["render"]["size"], COMMANDS["render"]["size"].default)  # replies are compared with it
    return draft


def camera_draft_of(dataset: str, options: Mapping[str, Any], index: int, camera: Mapping[str, Any]) -> Draft:
    """The request at a camera of a path."""
    try:
        return draft_of(dataset, {**options, "camera": camera})
    except InvalidArgument as error:
        raise InvalidArgument(f"camera {index + 1} of the path: {error}") from None


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


def _renderer_with(*wanted: str) -> str:
    """The first one with these abilities and parameters."""
    renderers = COMMANDS["render"]["renderer"].renderers
    return next(str(each["name"]) for each in renderers if set(wanted) <= {*each["abilities"], *each["parameters"]})


def slice_drafts_of(dataset: str, options: Mapping[str, Any]) -> list[Draft]:
    """The requests of `slabstream slice` with these options, one a plane, from left to right."""
    given = _given(options)
    _check("slice", given)
    planes = Draft(plane=COMMANDS["slice"]["plane"].default or "")
    planes.frame.transfer.preset = COMMANDS["slice"]["transfer"].default or ""
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
        annotations = dataclasses.replace(planes.format.annotations, sides_only=True)
        draft.format = dataclasses.replace(planes.format, annotations=annotations)
        frame = draft.frame
        frame.MergeFrom(planes.frame)
        draft.colors = planes.colors
        frame.renderer = _renderer_with("labels", "overlay") if layers else _renderer_with("projection-mode")
        if layers:
            frame.shading.model = schema.SHADING_MODEL_NONE
        _look_from(frame.view, side, of_patient)
        frame.view.fit = True
        slab = frame.clipping.slab
        _set_vector(slab.normal, normal)
        slab.thickness = planes.thickness
        if planes.at is not None:
            _set_vector(slab.through, planes.at)
        if planes.index is not None:
            slab.slice = planes.index + 1
        drafts.append(draft)
    return drafts
