"""Requests made from options: those of `slabstream render` and `slice`."""
from __future__ import annotations

import dataclasses
import difflib
import functools
import unicodedata
from typing import Any, Callable, Iterable, Mapping

from google.protobuf.descriptor import FieldDescriptor

from . import planes as planes_in_space
from . import schema, shapes, transfer, values
from .errors import InvalidArgument, UnknownOption
from .image import PictureFormat
from .options import COMMANDS, Option


@dataclasses.dataclass
class Draft:
    """A request that is being made from options."""

    frame: Any = dataclasses.field(default_factory=schema.FrameRequest)
    format: PictureFormat = PictureFormat()
    shapes: list[tuple[Any, shapes.Shape]] = dataclasses.field(default_factory=list)  # with the ShapeChoices in `frame` that lack their names
    sent: list[Any] = dataclasses.field(default_factory=list)  # what keeps these shapes at the service
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


#: By the type of the field's messages.
_MESSAGES: dict[str, Callable[[str, Any], Any]] = {
    "ImageSize": values.size, "ScalarRange": values.scalar_range, "ClipBox": values.clip_box, "ClipPlane": values.clip_planes,
    "Isosurface": values.isosurfaces, "GradientOpacityPoint": values.gradient_opacities, "LabelOpacity": values.label_opacities,
    "LabelRange": values.label_ranges, "Vec3": values.directions, "PlaneChoice": planes_in_space.choices,
}


def _text(option: Option, value: Any) -> str:
    if option.choices:
        values.choice(option.name, value, option.choices)
    value = values.whole_text(value)  # level=2
    if not isinstance(value, str) or not 1 <= len(value.encode()) <= values.MOST_NAME_BYTES:
        raise InvalidArgument(f"{option.name} {value!r} must be a text of 1 to {values.MOST_NAME_BYTES} bytes")
    return value


def _scalar(field: FieldDescriptor, option: Option, value: Any) -> Any:
    if field.cpp_type == FieldDescriptor.CPPTYPE_ENUM:  # lists the choices in their order, after the one that is never sent
        return 1 + values.choice(option.name, value, option.choices)
    if field.cpp_type == FieldDescriptor.CPPTYPE_BOOL:
        return _flag(option, value)
    if field.cpp_type == FieldDescriptor.CPPTYPE_STRING:
        return _text(option, value)
    if value == "auto" and (option.type or "").endswith("|auto"):
        return 0  # left to the service
    if field.cpp_type in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        return _number(option, value)
    return _whole(option, value)


def _field(draft: Draft, option: Option, value: Any) -> None:
    *outer, name = option.path.split(".")
    if outer == ["parameters"]:
        return _parameter(draft, option, value)
    if outer == ["overlay"]:
        holder = _look(draft, "overlay")
    elif outer == ["labels"]:
        holder = _look(draft, "labels").labels
    else:
        holder = functools.reduce(getattr, outer, draft.frame)
    field = holder.DESCRIPTOR.fields_by_name[name]
    if name == "preset":
        _transfer(draft, option, value, holder)
    elif field.message_type is None:
        setattr(holder, name, _scalar(field, option, value))
    elif hasattr(getattr(holder, name), "extend"):  # repeated; protobuf 7 has no FieldDescriptor.label
        getattr(holder, name).extend(_MESSAGES[field.message_type.name](option.name, value))
    elif field.message_type.name == "Vec3":
        getattr(holder, name).CopyFrom(values.vec3(values.point(option.name, value)))
    else:
        getattr(holder, name).CopyFrom(_MESSAGES[field.message_type.name](option.name, value))


def _look(draft: Draft, field: str) -> Any:
    """FieldChoice, which is made if there is none."""
    looks = draft.frame.fields
    return next((look for look in looks if look.field == field), None) or looks.add(field=field)


_PRESET_OF_MAPS = "viridis"  # it spans values and has opacities as all colour maps do


def _transfer(draft: Draft, option: Option, value: Any, choice: Any) -> None:
    colors = transfer.color_map(value)
    if colors is None:
        transfer.choose(option.name, value, choice)
    elif option.path.startswith("transfer."):
        draft.colors, choice.preset = colors, _PRESET_OF_MAPS
    else:
        _stretch(colors, choice)


def _stretch(colors: transfer.Colors, choice: Any) -> None:
    """Of an overlay or a channel: its values are not known here, so the colours span all of them."""
    choice.function.CopyFrom(transfer.mapped(colors, 0, 1, transfer.TransferFunction(opacities=[(0, 0), (1, 1)]).message().opacities))
    if not choice.HasField("scalar_range"):
        choice.scalar_range.min, choice.scalar_range.max, choice.scalar_range.percentiles = 0, 100, True


def _parameter(draft: Draft, option: Option, value: Any) -> None:
    text = _choice(option, value) if option.choices else values.text_of(_number(option, value))
    draft.frame.parameters.add(name=option.text_name, text=text)


_LOOK = ("color", "range", "gamma", "opacity", "transfer", "shown")


def _channel_look(name: str, key: str, look: Mapping[str, Any]) -> Any:
    """FieldChoice."""
    choice = schema.FieldChoice(field=key)
    for field in look:
        if field not in _LOOK:
            raise InvalidArgument(f"{name} has the field {field!r}, must be one of: {', '.join(_LOOK)}")
    given = {field: value for field, value in look.items() if value is not None}
    if "color" in given:
        choice.color.CopyFrom(values.opaque_color(f"{name} color", given["color"]))
    if "range" in given:
        choice.scalar_range.CopyFrom(values.scalar_range(f"{name} range", given["range"]))
    if "gamma" in given:
        choice.gamma = values.number(f"{name} gamma", given["gamma"], 0.01, 100)
    if "opacity" in given:
        choice.weight = values.number(f"{name} opacity", given["opacity"], 0, 1)
    if "transfer" in given:
        colors = transfer.color_map(given["transfer"])
        if colors is None:
            transfer.choose(f"{name} transfer", given["transfer"], choice)
        else:
            _stretch(colors, choice)
    return choice


_MOST_CHANNELS = 16


def _channels(draft: Draft, option: Option, value: Any) -> None:
    """[0, "Actin"], one of them, "0,Actin", or looks by channel: {"Actin": {"color": "magenta"}, 1: {"shown": False}}."""
    looks: Mapping[Any, Any] = value if isinstance(value, Mapping) else {}
    shown = []
    for item in value.split(",") if isinstance(value, str) else value if isinstance(value, Iterable) else [value]:
        key = values.whole_text(item)
        if not isinstance(key, str) or not 1 <= len(key.encode()) <= values.MOST_NAME_BYTES:
            raise InvalidArgument(f"{option.name} {item!r} is neither a number nor a name of 1 to {values.MOST_NAME_BYTES} bytes")
        look = looks.get(item)
        name = f"{option.name}[{item!r}]"
        if isinstance(look, (bool, type(None))):
            look = {"shown": look is not False}
        if not isinstance(look, Mapping):
            raise InvalidArgument(f"{name} {look!r} is no look, such as {{'color': 'magenta', 'range': (100, 4000)}}")
        choice = _channel_look(name, key, look)
        if values.flag(f"{name} shown", look.get("shown", True)):
            shown.append(key)
        if choice != schema.FieldChoice(field=key):
            draft.frame.fields.append(choice)
    if not 1 <= len(shown) <= _MOST_CHANNELS:
        raise InvalidArgument(f"{option.name} shows {len(shown)} channels, must be 1 to {_MOST_CHANNELS}")
    draft.frame.channels.extend(shown)


# ---- options that are no field, or several


def _shapes(draft: Draft, option: Option, value: Any) -> None:
    for choice, shape in shapes.choices(option.name, value):
        shown = draft.frame.shapes.add()
        shown.CopyFrom(choice)
        if shape is not None:
            draft.shapes.append((shown, shape))


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
    _look_from(draft.frame.view, _choice(option, value))


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
    look = _look(draft, option.name)
    if option.name == "labels":
        look.labels.SetInParent()


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


def _number(option: Option, value: Any) -> float:
    return values.number(option.name, value, option.least, option.most, option.above)


def _whole(option: Option, value: Any) -> int:
    return values.integer(option.name, value, int(option.least), int(option.most))


def _flag(option: Option, value: Any) -> bool:
    return values.flag(option.name, value)


def _choice(option: Option, value: Any) -> str:
    return option.choices[values.choice(option.name, value, option.choices)]


def _in(place: str, parse: Callable[[Option, Any], Any], field: str = "") -> Put:
    """Puts the value into this field of the draft, of its "format" or of the format's "annotations"; usually into that of the option's name."""

    def put(draft: Draft, option: Option, value: Any) -> None:
        found = {field or option.name: parse(option, value)}
        if place == "annotations":
            found = {place: dataclasses.replace(draft.format.annotations, **found)}
        if place != "draft":
            found = {"format": dataclasses.replace(draft.format, **found)}
        vars(draft).update(found)

    return put


#: Every option of options.json is here, or has a path.
_PUT: dict[str, Put] = {
    "shape": _shapes,
    "view": _view,
    "camera": _camera,
    "channels": _channels,
    "background": _in("format", lambda option, value: values.color(option.name, value)),
    "depth": _in("format", lambda option, value: int(_choice(option, value)), "png_bits"),
    "quality": _in("format", _whole),
    "dpi": _in("format", _whole, "dots_per_inch"),
    "font_size": _in("annotations", _number),
    "title": _in("annotations", _line),
    "scale_bar": _in("annotations", _flag),
    "orientation_marker": _in("annotations", _flag),
    "axes": _in("annotations", _choice),
    "color_bar": _in("annotations", _caption),
    "legend": _in("annotations", _flag),
    "labels": _layer,
    "overlay": _layer,
    "plane": _in("draft", _choice),
    "at": _in("draft", lambda option, value: values.point(option.name, value)),
    "index": _in("draft", lambda option, value: values.integer(option.name, value, 0, 65534)),
    "thickness": _in("draft", _number),
    "window": _window,
    "level": _in("draft", lambda option, value: values.number(option.name, value, -1e30, 1e30)),
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
    frame.key = draft.format.annotations.need_key()
    if not frame.HasField("size"):
        _put(draft, COMMANDS["render"]["size"], COMMANDS["render"]["size"].default)  # replies are compared with it
    return draft


def camera_draft_of(dataset: str, options: Mapping[str, Any], index: int, camera: Mapping[str, Any]) -> Draft:
    """The request at a camera of a path."""
    try:
        return draft_of(dataset, {**options, "camera": camera})
    except InvalidArgument as error:
        raise InvalidArgument(f"camera {index + 1} of the path: {error}") from None


# How one looks at a plane: the view, and whether only patients have it (client/request/slice_planes.h).
_PLANES: dict[str, tuple[str, bool]] = {
    "axial": ("inferior", True), "coronal": ("anterior", True), "sagittal": ("left", True),
    "z": ("top", False), "y": ("front", False), "x": ("right", False),
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
    layers = "overlay" in planes.frame.channels or any(look.field == "overlay" or look.HasField("labels") for look in planes.frame.fields)
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
        side, of_patient = _PLANES[name]
        draft = draft_of(dataset, {})
        annotations = dataclasses.replace(planes.format.annotations, sides_only=True)
        draft.format = dataclasses.replace(planes.format, annotations=annotations)
        frame = draft.frame
        frame.MergeFrom(planes.frame)
        frame.key = annotations.need_key()
        draft.colors = planes.colors
        frame.renderer = _renderer_with("labels", "fields") if layers else _renderer_with("projection-mode")
        if layers:
            frame.shading.model = schema.SHADING_MODEL_NONE
        _look_from(frame.view, side, of_patient)
        frame.view.fit = True
        slab = frame.clipping.slab
        slab.normal.CopyFrom(values.vec3(planes_in_space.NORMALS[name]))
        slab.thickness = planes.thickness
        if planes.at is not None:
            slab.through.CopyFrom(values.vec3(planes.at))
        if planes.index is not None:
            slab.slice = planes.index + 1
        drafts.append(draft)
    return drafts
