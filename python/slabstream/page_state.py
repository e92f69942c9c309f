"""What the viewer's page shows, in the names and texts of its link (web/src/link.ts): made of options of pictures, and read back as such."""
from __future__ import annotations

import dataclasses
import functools
import urllib.parse
from typing import Any, Callable, Mapping

from . import schema, values
from .drafts import Draft
from .errors import InvalidArgument
from .options import COMMANDS, Option
from .status import Dataset
from .transfer import Region, TransferFunction

Texts = dict[str, str]

BACKGROUND = "#0d1014"  # where the state names none

_CAMERA = ("azimuth", "elevation", "roll", "zoom", "look_at", "projection")
_TRANSFER = ("transfer", "scalar_range", "opacity_distance", "gradient_opacity", "isovalue")
_FLAGS = ("scale_bar", "orientation_marker", "color_bar", "legend")
_LABELS = ("label_mode", "label_tint", "label_surface", "labels_shown", "label_opacity")
_LISTS = ("light", "clip_plane", "shape")  # with semicolons between
#: Options that the page has a place for, by the same name, beside parameters of renderers. transfer, channels and layers have more than one.
_SHOWN = {*_CAMERA, *_TRANSFER, *_FLAGS, *_LABELS, *_LISTS, "renderer", "shading", "shadows", "ambient_occlusion", "clip_box", "clip_mode", "blend",
          "time", "background", "axes"}
_MADE_OF_OTHERS = {"view", "camera", "fit", "of_patient", "channels", "labels", "overlay", "overlay_transfer", "overlay_range", "overlay_weight"}
_OF_PICTURES = {"size", "depth", "quality", "dpi", "title", "font_size"}
_MATERIAL = ("ambient", "diffuse", "specular", "shininess")
_LOOKS = {"channel-transfer": "transfer", "channel-color": "color", "channel-range": "range", "channel-gamma": "gamma", "channel-opacity": "opacity"}

#: What the page begins with, and so leaves out. What it leaves out is not said here either: it would correct it.
_FIRST = {"roll": "0", "zoom": "1", "projection": "orthographic", "shading": "phong", "shadows": "0", "ambient-occlusion": "0", "transfer": "auto",
          "opacity-distance": "1", "surfaces-alone": "1", "clip-mode": "keep", "label-tint": "0.5", "label-surface": "blocky", "overlay": "0",
          "blend": "auto", "background": BACKGROUND, "legend": "1", "orientation-marker": "1", "scale-bar": "1", "axes": "off", "color-bar": "0"}

#: Of which names each property of a widget is made.
PARTS: dict[str, tuple[str, ...]] = {
    "camera": tuple(name.replace("_", "-") for name in _CAMERA), "transfer": ("transfer", "function"), "scalar_range": ("scalar-range",),
    "channels": ("channel", *_LOOKS), "time": ("time",), "dataset": ("dataset",),
}


@dataclasses.dataclass(frozen=True)
class Camera:
    """Where a widget looks from: the options of these names. None: as the dataset has it at first."""

    azimuth: float | None = None
    elevation: float | None = None
    roll: float = 0.0
    zoom: float = 1.0
    look_at: values.Vector | None = None  #: x, y, z of the world; None: the middle of the volume
    projection: str = "orthographic"


# ---- from options


def _numbers(*parts: float) -> str:
    return ",".join(map(values.text_of, parts))


def _hex(red: float, green: float, blue: float) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in (red, green, blue))


def _range_text(name: str, found: Any) -> str:
    if found.percentiles:
        raise InvalidArgument(f"{name} is in percentiles, but the viewer takes data values")
    return f"{values.text_of(found.min)}:{values.text_of(found.max)}"


def _bound(value: float) -> str:
    return "" if abs(value) >= values.MOST_COORDINATE else values.text_of(value)


def _box_text(name: str, box: Any) -> str:
    if box.unit != schema.CLIP_UNIT_WORLD:
        raise InvalidArgument(f"{name} is in voxels or percent, but the viewer takes coordinates of the world")
    return ",".join(f"{_bound(low)}:{_bound(high)}" for low, high in zip(schema.xyz(box.low), schema.xyz(box.high)))


def _label_range(found: Any) -> str:
    return found.name or (f"{found.first}" if found.first == found.last else f"{found.first}-{found.last}")


def _shape_text(choice: Any) -> str:
    """As the command line takes it, but with the name quoted."""
    looks = {"color": _hex(choice.color.r, choice.color.g, choice.color.b) if choice.HasField("color") else None,
             "opacity": values.text_of(choice.opacity) if choice.HasField("opacity") else None,
             "width": values.text_of(choice.width) + ("px" if choice.width_in_pixels else "") if choice.width else None,
             "map": choice.map or None, "range": _range_text("range of a shape", choice.range) if choice.HasField("range") else None}
    return ",".join([urllib.parse.quote(choice.shape, safe=""), *(f"{name}={text}" for name, text in looks.items() if text is not None)])


def _shape_of(text: str) -> dict[str, str]:
    """As the option `shape` takes it."""
    name, *looks = text.split(",")
    return {"shape": urllib.parse.unquote(name), **_map_of(",".join(looks))}


#: By the type of the field's messages, and what stands between several.
_MESSAGES: dict[str, tuple[Callable[[str, Any], str], str]] = {
    "Vec3": (lambda name, v: _numbers(v.x, v.y, v.z), ";"),
    "ScalarRange": (_range_text, ""),
    "ClipBox": (_box_text, ""),
    "ClipPlane": (lambda name, p: _numbers(p.normal.x, p.normal.y, p.normal.z, p.offset), ";"),
    "Isosurface": (lambda name, s: f"{values.text_of(s.value)}:{_hex(s.r, s.g, s.b)}:{values.text_of(s.opacity if s.HasField('opacity') else 1)}", ","),
    "GradientOpacityPoint": (lambda name, p: f"{values.text_of(p.slope)}:{values.text_of(p.opacity)}", ","),
    "LabelOpacity": (lambda name, o: f"{o.value}={values.text_of(o.opacity)}", ","),
    "LabelRange": (lambda name, r: _label_range(r), ","),
}


def function_text(function: Any) -> str:
    """Of a TransferFunction of the wire."""
    colors = ";".join(_numbers(p.value, p.r, p.g, p.b) for p in function.colors)
    opacities = ";".join(_numbers(p.value, p.opacity, *(() if (p.midpoint, p.sharpness) == (0.5, 0) else (p.midpoint, p.sharpness)))
                         for p in function.opacities)
    material = ",".join(values.text_of(getattr(function.material, name)) if function.material.HasField(name) else "" for name in _MATERIAL)
    regions = ";".join(_numbers(r.r, r.g, r.b, r.opacity, r.softness, *(n for c in r.corners for n in (c.value, c.slope))) for r in function.regions)
    return "|".join(("python", colors, opacities, material if function.HasField("material") else "", regions)).rstrip("|")


def _text(frame: Any, option: Option) -> str | None:
    """Of an option with a path; None: it says nothing."""
    *outer, name = option.path.split(".")
    if outer == ["parameters"]:
        return next((each.text for each in frame.parameters if each.name == name), None)
    holder = next((look.labels for look in frame.fields if look.field == "labels"), None) if outer == ["labels"] else functools.reduce(getattr, outer, frame)
    if holder is None:
        return None
    field, value = holder.DESCRIPTOR.fields_by_name[name], getattr(holder, name)
    if field.message_type is not None:
        write, between = _MESSAGES[field.message_type.name]
        if hasattr(value, "extend"):
            return between.join(write(option.name, each) for each in value) or None
        return write(option.name, value) if holder.HasField(name) else None
    if field.has_presence and not holder.HasField(name):
        return None
    if field.enum_type is not None:
        return option.choices[value - 1] if value else None
    return str(value) or None if isinstance(value, str) else values.text_of(value)


def _look_texts(frame: Any) -> Texts:
    """Of channels and the overlay."""
    found: dict[str, list[str]] = {}
    for look in frame.fields:
        if look.field == "labels":
            continue
        texts = {"channel-transfer": urllib.parse.quote(function_text(look.function)) if look.HasField("function") else look.preset or None,
                 "channel-color": _hex(look.color.r, look.color.g, look.color.b) if look.HasField("color") else None,
                 "channel-range": _range_text(f"range of channel {look.field}", look.scalar_range) if look.HasField("scalar_range") else None,
                 "channel-gamma": values.text_of(look.gamma) if look.HasField("gamma") else None,
                 "channel-opacity": values.text_of(look.weight) if look.HasField("weight") else None}
        for name, text in texts.items():
            if text is not None:
                found.setdefault(name, []).append(f"{look.field}={text}")
    shown = [channel for channel in frame.channels if channel != "overlay"]
    return {name: ",".join(parts) for name, parts in found.items()} | ({"channel": ",".join(shown)} if shown else {})


def for_pictures(options: Mapping[str, Any]) -> dict[str, Any]:
    """Those that are for pictures alone. InvalidArgument: the viewer has no place for one."""
    found = {}
    for name, value in options.items():
        option = COMMANDS["render"][name]
        if name in _OF_PICTURES or (option.same_picture and name not in _MADE_OF_OTHERS):
            found[name] = value
        elif value is not None and name not in _SHOWN | _MADE_OF_OTHERS and not option.path.startswith("parameters."):
            raise InvalidArgument(f"the viewer has no {name}; picture({name}=...) takes it")
    return found


def texts_of(draft: Draft, options: Mapping[str, Any]) -> Texts:
    """The state of these options, of which the draft was made, with the values that its colour maps span."""
    given = {name for name, value in options.items() if value is not None}
    if given & {"view", "camera"}:
        given |= set(_CAMERA)
    frame, annotations = draft.frame, draft.format.annotations
    found = {"dataset": frame.dataset} | _look_texts(frame)
    for option in COMMANDS["render"].values():
        if option.name in given and option.path and (option.name in _SHOWN or option.path.startswith("parameters.")) and option.name != "transfer":
            text = _text(frame, option)
            if text is not None:
                found[option.text_name] = text
    if "transfer" in given:
        if frame.transfer.HasField("function"):
            found["function"] = function_text(frame.transfer.function)
        else:
            found["transfer"] = frame.transfer.preset
        if "isovalue" in given:
            found["surfaces-alone"] = "0"
    if draft.colors is not None:
        found.pop("scalar-range", None)  # the function spans it
    if any(look.field == "labels" for look in frame.fields):
        found["label-mode"] = found["label-mode"] if found.get("label-mode", "auto") != "auto" else "tint"
        found.setdefault("label-tint", COMMANDS["render"]["label_tint"].default or "")
    if any(look.field == "overlay" for look in frame.fields):
        found["overlay"] = "1"
    if "background" in given and draft.format.background[3] == 1:
        found["background"] = _hex(*draft.format.background[:3])
    if frame.shapes:
        found["shape"] = ";".join(map(_shape_text, frame.shapes))
    if "axes" in given:
        found["axes"] = annotations.axes
    for name in given & set(_FLAGS):
        found[name.replace("_", "-")] = "0" if getattr(annotations, name) in (False, None) else "1"
    return {name: text for name, text in found.items() if _FIRST.get(name) != text}


# ---- to options


def _map_of(text: str | None) -> Texts:
    return dict(item.split("=", 1) for item in text.split(",") if "=" in item) if text else {}


def _floats(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


def _region_of(text: str) -> Region:
    red, green, blue, opacity, softness, *corners = _floats(text)
    return Region(list(zip(corners[::2], corners[1::2])), (red, green, blue), opacity, softness)


def function_of(text: str) -> TransferFunction:
    _, colors, opacities, material, regions = [*text.split("|"), "", "", "", "", ""][:5]
    points = [_floats(each) for each in colors.split(";") if each]
    numbers = {name: float(part) for name, part in zip(_MATERIAL, material.split(",")) if part}
    areas = [_region_of(each) for each in regions.split(";") if each]
    if areas:
        return TransferFunction(material=numbers or None, regions=areas)
    return TransferFunction([(x, (r, g, b)) for x, r, g, b in points], [tuple(_floats(each)) for each in opacities.split(";") if each], numbers or None)


def transfer_of(state: Mapping[str, str]) -> str | TransferFunction:
    return function_of(state["function"]) if state.get("function") else state.get("transfer") or "auto"


def range_of(text: str | None) -> tuple[float, float] | None:
    if not text:
        return None
    low, high = text.split(":")
    return float(low), float(high)


def camera_of(state: Mapping[str, str]) -> Camera:
    numbers: dict[str, Any] = {name: float(state[name]) for name in ("azimuth", "elevation", "roll", "zoom") if state.get(name)}
    if state.get("look-at"):
        x, y, z = _floats(state["look-at"])
        numbers["look_at"] = (x, y, z)
    return Camera(**numbers, projection=state.get("projection") or "orthographic")


_READ: dict[str, Callable[[str], Any]] = {
    "range": range_of, "gamma": float, "opacity": float, "color": str,
    "transfer": lambda text: function_of(urllib.parse.unquote(text)) if "|" in urllib.parse.unquote(text) else text,
}


def looks_of(state: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """By channel, and of the overlay; as the option `channels` takes them."""
    found: dict[str, dict[str, Any]] = {}
    for name, field in _LOOKS.items():
        for key, text in _map_of(state.get(name)).items():
            found.setdefault(key, {})[field] = _READ[field](text)
    return found


def channels_of(state: Mapping[str, str]) -> dict[str, dict[str, Any]] | None:
    """The channels that show, with their looks, and hidden ones that have a look. None: as the dataset says."""
    looks = {key: look for key, look in looks_of(state).items() if key != "overlay"}
    if not state.get("channel"):
        return looks or None
    shown = [] if state["channel"] == "none" else state["channel"].split(",")
    return {key: looks.get(key, {}) for key in shown} | {key: {**look, "shown": False} for key, look in looks.items() if key not in shown}


def time_of(state: Mapping[str, str]) -> int | str | None:
    text = state.get("time", "")
    return int(text) if text.isdigit() else text or None


def _channel_options(state: Mapping[str, str], dataset: Dataset | None, own: Mapping[str, Any]) -> dict[str, Any]:
    """The option `channels`, or none where the transfer function is that of the only channel that shows."""
    fields = [field for field in dataset.fields if field.channel] if dataset is not None else []
    names = [field.name or str(number) for number, field in enumerate(fields)]
    told = channels_of(state)
    if told is None or len(fields) == 1:  # none: the dataset is being loaded, and what the state says holds
        return {}
    if not state.get("channel"):
        told = {name: told.get(name, told.get(str(number), {})) for number, (name, field) in enumerate(zip(names, fields)) if field.shown} or told
    shown = [key for key, look in told.items() if look.get("shown", True)]
    if not shown:
        return {"channels": {names[0] if names else "0": {"opacity": 0}}}
    if len(shown) == 1 and any(name != "opacity_distance" and value != "auto" for name, value in own.items()):
        return {"channels": shown}
    return {"channels": told}


def options_of(state: Mapping[str, str], dataset: Dataset | None = None) -> dict[str, Any]:
    """Of the picture that the page shows, as it makes them (web/src/options.ts): what the renderer cannot show is left out. `dataset`: what is
    known of it. Marks that the page draws over the picture are not among them."""
    renderers = {each["name"]: each for each in COMMANDS["render"]["renderer"].renderers}
    chosen = renderers.get(state.get("renderer", ""))
    found: dict[str, Any] = {}
    for option in COMMANDS["render"].values():
        text, parameter = state.get(option.text_name), option.path.startswith("parameters.")
        if not text or not (option.name in _SHOWN or parameter) or option.name in _FLAGS:
            continue
        wanted = option.path.partition(".")[2] if parameter else option.ability
        if chosen is None or not wanted or wanted in chosen["abilities"] or wanted in chosen["parameters"]:
            found[option.name] = text.split(";") if option.name in _LISTS else text
    if "shape" in found:
        found["shape"] = [_shape_of(each) for each in found["shape"] if ",shown=0" not in each]
    if chosen is not None and "perspective" not in chosen["abilities"]:
        found.pop("projection", None)
    if state.get("function"):
        found["transfer"] = function_of(state["function"])
    if "isovalue" in found and state.get("surfaces-alone") != "0":
        for name in _TRANSFER[:-1]:
            found.pop(name, None)
    elif "isovalue" in found:
        found.setdefault("transfer", "auto")
    if found.get("label_mode", "off") != "off":
        found.setdefault("label_tint", _FIRST["label-tint"])  # it is another one than the service's
    else:
        for name in _LABELS:
            found.pop(name, None)
    own = {name: found[name] for name in _TRANSFER if name in found}
    found.update(_channel_options(state, dataset, own))
    if isinstance(found.get("channels"), Mapping):
        for name in own:
            found.pop(name)
    if state.get("overlay") == "1":
        look = looks_of(state).get("overlay", {})
        found.update({"overlay": True, "overlay_weight": look.get("opacity", 1)})
        found.update({f"overlay_{name}": look[name] for name in ("transfer", "range") if name in look})
    if "look_at" not in found:
        found["fit"] = True
    return {"background": BACKGROUND, **found}


#: What a state says of each property of a widget.
READ: dict[str, Callable[[Mapping[str, str]], Any]] = {
    "camera": camera_of, "transfer": transfer_of, "scalar_range": lambda state: range_of(state.get("scalar-range")), "channels": channels_of,
    "time": time_of, "dataset": lambda state: state.get("dataset", ""), "state": dict,
}


def with_part(state: Mapping[str, str], part: str, texts: Mapping[str, str]) -> Texts:
    """The state with what `texts` say of a part. Of the camera's direction and of the overlay's look, which it may say nothing of, the state's."""
    kept = {name: text for name, text in state.items() if name not in PARTS[part] or name in ("azimuth", "elevation")}
    for name in _LOOKS if part == "channels" else ():
        overlay = [item for item in state.get(name, "").split(",") if item.startswith("overlay=")]
        texts = {**texts, name: ",".join(overlay + [texts[name]] if name in texts else overlay)}
    return kept | {name: texts[name] for name in PARTS[part] if texts.get(name)}
