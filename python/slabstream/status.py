"""What a service says of itself."""
from __future__ import annotations

import dataclasses
from typing import Any

from . import schema


@dataclasses.dataclass(frozen=True)
class DatasetLevel:
    shape: tuple[int, int, int]             # voxels along z, y, x
    spacing: tuple[float, float, float]     # along z, y, x


@dataclasses.dataclass(frozen=True)
class Field:
    """A channel of a dataset, or another field of it, such as an overlay. What its author shows is None where the file does not say."""

    name: str = ""                                   # "": it has none, and is called by its number
    channel: bool = True                             # of the volume, on its grid; else it has a grid of its own
    color: tuple[float, float, float] | None = None  # straight red, green, blue, from 0 to 1
    window: tuple[float, float] | None = None        # data values that are dark and bright
    shown: bool = True
    labels: bool = False                             # its values are labels


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A number of a simulation that whoever watches it may change, from `least` to `most`."""

    name: str
    value: float
    least: float
    most: float


@dataclasses.dataclass(frozen=True)
class Simulation:
    """How far a simulation is whose processes hold the voxels of a dataset."""

    time: int         # the number of the latest one that is whole; 0: none
    simulated: float  # the same in the simulation's own unit
    parameters: tuple[Parameter, ...]


@dataclasses.dataclass(frozen=True)
class Dataset:
    name: str
    state: str                                      # "unloaded", "loading", "ready" or "failed"
    error: str = ""                                 # of a failed one
    # None unless it is ready.
    shape: tuple[int, int, int] | None = None       # voxels along z, y, x
    spacing: tuple[float, float, float] | None = None  # along z, y, x
    dtype: str | None = None                        # of a stored sample
    value_range: tuple[float, float] | None = None
    memory_bytes: int = 0                           # of the coordinator
    labels: bool = False                            # it has some
    overlay: bool = False
    cells: int = 0                                  # tetrahedra of an unstructured grid; 0: it is a volume
    levels: tuple[DatasetLevel, ...] = ()           # finest first, at least one
    fields: tuple[Field, ...] = ()                  # by number, channels first; of a ready one at least one
    times: int = 1
    time_step: float | None = None                  # from a time to the next one, in `time_unit`; None: not known
    time_unit: str = ""                             # "s", "ms", "min", "h"; "": not known
    field: int = 0                                  # these are shown if nothing is said
    time: int = 0
    simulation: Simulation | None = None            # None: no processes hold its voxels
    is_shape: bool = False                          # it is a mesh, lines or points, for the option `shape`


@dataclasses.dataclass(frozen=True)
class Worker:
    id: int
    pid: int
    host: str
    threads: int
    cached_bytes: int
    fetched_bytes: int
    rendered_ranks: int
    silent_seconds: float
    leaving: bool


@dataclasses.dataclass(frozen=True)
class WebTraffic:
    """What the coordinator and the present workers have asked a web server for."""

    server: str     # "host:port"
    requests: int   # each try is one
    retries: int    # of these: after one that failed
    failures: int   # after which nothing was tried again
    unchanged: int  # answers without bytes, of objects that the disk has
    bytes: int
    seconds: float  # requests that ran at a time count each


@dataclasses.dataclass(frozen=True)
class Status:
    endpoint: str
    pid: int
    uptime_seconds: float
    clients: int
    queued: int          # frames
    running: int
    frames_done: int
    frames_failed: int
    refused: int         # requests, before any worker had a part in them
    workers_lost: int
    workers: tuple[Worker, ...]
    datasets: tuple[Dataset, ...]
    web: tuple[WebTraffic, ...] = ()


def simulation_of(message: Any) -> Simulation:
    return schema.read(Simulation, message, parameters=tuple(schema.read(Parameter, each) for each in message.steered))


def dataset_of(message: Any) -> Dataset:
    state = schema.word(message, "state", "failed")
    simulation = simulation_of(message.simulation) if message.HasField("simulation") else None
    if state != "ready" or message.is_shape:
        return Dataset(message.name, state, message.error, memory_bytes=message.memory_bytes, simulation=simulation, is_shape=message.is_shape)
    about = message.description
    known = message.fields
    fields = tuple(
        Field(each.name, each.channel, (each.color.r, each.color.g, each.color.b) if each.HasField("color") else None,
              (each.window.min, each.window.max) if each.HasField("window") else None, each.shown, each.labels) for each in known.fields)
    levels = tuple(DatasetLevel(schema.zyx(level.size), schema.zyx(level.spacing)) for level in message.levels or [about])
    apart = [field for field in fields if not field.channel]
    return schema.read(Dataset, message, state=state, labels=any(field.labels for field in apart), overlay=any(not field.labels for field in apart), shape=schema.zyx(about.size), spacing=schema.zyx(about.spacing),
                       dtype=schema.word(about, "type") or None, value_range=(message.range.min, message.range.max), levels=levels,
                       fields=fields or (Field(),), times=max(known.times, 1), time_unit=known.time_unit, field=known.field, time=known.time, simulation=simulation,
                       time_step=known.time_step if known.HasField("time_step") else None)


def status_of(message: Any, endpoint: str) -> Status:
    refused = message.refused
    return schema.read(
        Status, message, endpoint=endpoint, uptime_seconds=message.uptime_ms / 1000,
        refused=refused.bad_request + refused.unknown_dataset + refused.too_large + refused.over_quota,
        workers=tuple(schema.read(Worker, w, id=w.worker, silent_seconds=w.silent_ms / 1000) for w in message.workers),
        datasets=tuple(map(dataset_of, message.datasets)),
        web=tuple(schema.read(WebTraffic, t, seconds=t.milliseconds / 1000) for t in message.web),
    )
