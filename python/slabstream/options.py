"""The options of pictures: those of `slabstream render` and `slice`, by the same names with underscores.

options.json is what `slabstream options COMMAND` prints (python/update-options writes it, a test compares). Names, defaults, limits, choices,
help texts, signatures and what an option changes in a request are made from it.
"""
from __future__ import annotations

import dataclasses
import inspect
import json
import math
import pathlib
import re
import textwrap
from typing import Any, Callable, Iterable, TypeVar


@dataclasses.dataclass(frozen=True)
class Option:
    """As slabstream describes it (client/cli/option_description.h)."""

    name: str               # as a keyword
    text_name: str          # as on the command line, without dashes
    group: str
    help: str
    least: float
    most: float
    above: bool             # values must exceed `least`
    excludes: tuple[str, ...]
    needs: tuple[str, ...]
    windows: dict[str, tuple[float, float]]  # of the option window: width and level by name
    type: str | None = None         # None: a flag
    path: str = ""                  # of the field in a FrameRequest, "view.zoom", or of a parameter, "parameters.kernel"; empty: it is no field
    default: str | None = None
    choices: tuple[str, ...] = ()
    ability: str = ""               # that a renderer must have
    same_picture: bool = False      # it never changes the finished picture
    negatable: bool = False         # a flag that may be on by itself: False turns it off
    renderers: tuple[dict[str, Any], ...] = ()  # of the option renderer: name, title, purpose, abilities, and the default of each parameter


def _keyword(name: str) -> str:
    return name.replace("-", "_")


def _option(entry: dict[str, Any]) -> Option:
    given: dict[str, Any] = {
        "name": _keyword(entry["name"]), "text_name": entry["name"], "least": entry.get("above", entry.get("min", -math.inf)),
        "most": entry.get("max", math.inf), "above": "above" in entry,
        "windows": {window["name"]: (window["width"], window["level"]) for window in entry.get("windows", ())},
        **{others: tuple(map(_keyword, entry.get(others, ()))) for others in ("excludes", "needs")},
    }
    for name in (field.name for field in dataclasses.fields(Option) if field.name in entry and field.name not in given):
        given[name] = tuple(entry[name]) if isinstance(entry[name], list) else entry[name]
    return Option(**given)


#: In place of --channel and of the options of single channels.
_CHANNELS = {"name": "channels", "type": "CHANNELS", "help": (
    "Channels that are shown, by their numbers or names, [0, \"Actin\"]; or with their looks, {\"Actin\": {\"color\": \"magenta\", "
    "\"range\": (100, 4000), \"gamma\": 0.7, \"opacity\": 0.5}}, with \"transfer\" in place of colour and gamma, and with \"shown\": False for "
    "one that is not shown (default: those that the file shows)")}


_SHAPE = {"path": "", "type": "SHAPE", "help": (
    "Shows a mesh, lines or points beside the volume: the name of a dataset, a Mesh, Lines or Points, or a mesh of PyVista or trimesh; with a look, "
    "{\"shape\": \"lung\", \"color\": \"pink\", \"opacity\": 0.4, \"width\": \"3px\", \"map\": \"viridis\", \"range\": (0, 1), \"time\": 3}, or \"lung,color=pink\"; or a list of these")}


_PLANE = {"type": "PLANE", "help": (
    "Shows the volume's values on a plane in space: a Plane, or a text such as \"axial:z=12,opacity=0.5\", as the command line takes it; or a list of "
    "these")}


#: Paths of short forms: the field, and what is said of it (drafts.py).
_OF_OVERLAY = {"overlay-transfer": "overlay.preset", "overlay-range": "overlay.scalar_range", "overlay-weight": "overlay.weight"}
_OF_LABELS = "fields.labels."


def _in_python(entry: dict[str, Any]) -> dict[str, Any] | None:
    """The option as it is here; None: it is part of another one."""
    entry = {"path": _OF_OVERLAY.get(entry["name"], ""), **entry}
    if entry["path"].startswith(_OF_LABELS):
        entry["path"] = entry["path"].removeprefix("fields.")
    if entry["name"] == "shape":
        entry |= _SHAPE
    if entry["path"] == "planes":
        entry |= _PLANE
    path = entry["path"]
    return None if path.startswith("fields.") else {"group": entry["group"], **_CHANNELS} if path == "channels" else entry


def _load() -> dict[str, dict[str, Option]]:
    commands = json.loads(pathlib.Path(__file__).with_name("options.json").read_text(encoding="utf-8"))
    kept = {command: [each for each in map(_in_python, entries) if each is not None] for command, entries in commands.items()}
    return {command: {option.name: option for option in map(_option, entries)} for command, entries in kept.items()}


#: By command and keyword.
COMMANDS = _load()


# What layers are here, where the command line names files.
_LAYER_HELP = {"labels": "Shows the dataset's labels as usual", "overlay": "Shows the dataset's overlay as usual"}


_BY_PATH = {option.path: option.name for options in COMMANDS.values() for option in options.values() if "." in option.path}


def in_keywords(text: str, command: str | None = None) -> str:
    """Options of this command, or of all, as one writes them here, in place of --options and of the fields of a request."""
    commands = COMMANDS.values() if command is None else [COMMANDS[command]]

    def keyword(found: re.Match[str]) -> str:
        name = _keyword(found[1])
        return name if any(name in known for known in commands) else found[0]

    text = re.sub(r"--([a-z]+(?:-[a-z]+)*)(?![a-z-]*[/.])", keyword, text)
    return re.sub(r"\b[a-z_]+(?:\.[a-z_]+)+\b", lambda found: _BY_PATH.get(found[0], found[0]), text)


def _limits_of(option: Option) -> list[str]:
    limits = [] if option.default is None else [f"default: {option.default}"]
    return limits if math.inf == option.most else [*limits, f"{'above' if option.above else 'from'} {option.least:g} to {option.most:g}"]


def _help_of(command: str, names: Iterable[str]) -> str:
    lines, group = [], ""
    for name in names:
        option = COMMANDS[command][name]
        if option.group != group:
            group = option.group
            lines += ["", f"{group.partition(' (')[0]}:"]
        head, *rest = in_keywords(_LAYER_HELP.get(name, option.help), command).split("\n")
        limits = _limits_of(option)
        head += f" ({'; '.join(limits)})" if limits else ""
        lines.append(f"  {name}: {option.type if option.type and name not in _LAYER_HELP else 'bool'}")
        for part, indent in [(head, "      "), *((line.strip(), "        ") for line in rest)]:
            lines += textwrap.wrap(part, 100, initial_indent=indent, subsequent_indent=indent)
    return "\n".join(lines)


Function = TypeVar("Function", bound=Callable[..., Any])


def takes_options_of(command: str) -> Callable[[Function], Function]:
    """Gives a function whose last parameter is **options the signature and the help text of its options, for help() and completion."""

    def describe(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        named = {p.name for p in own}
        options = [option for option in COMMANDS[command].values() if option.name not in named]
        off = {o.name for o in options if o.type is None and not o.negatable}
        more = [inspect.Parameter(o.name, inspect.Parameter.KEYWORD_ONLY, default=False if o.name in off else o.default) for o in options]
        function.__signature__ = signature.replace(parameters=own + more)  # type: ignore[attr-defined]
        about = inspect.cleandoc(function.__doc__ or "")
        function.__doc__ = f"{about}\n\nOptions, as of `slabstream {command}`:\n{_help_of(command, (o.name for o in options))}\n"
        return function

    return describe
