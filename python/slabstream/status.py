"""What a service says of itself."""
from __future__ import annotations

import dataclasses
from typing import Any

from . import schema

_STATES = {schema.DATASET_STATE_UNLOADED: "unloaded", schema.DATASET_STATE_LOADING: "loading", schema.DATASET_STATE_READY: "ready",
           schema.DATASET_STATE_FAILED: "failed"}
_TYPES = {schema.SCALAR_TYPE_UINT8: "uint8", schema.SCALAR_TYPE_UINT16: "uint16", schema.SCALAR_TYPE_FLOAT32: "float32"}


@dataclasses.dataclass(frozen=True)
class DatasetLevel:
    shape: tuple[int, int, int]             # voxels along z, y, x
    spacing: tuple[float, float, float]     # along z, y, x


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
    labels: int = 0                                 # different ones
    overlay: bool = False
    cells: int = 0                                  # tetrahedra of an unstructured grid; 0: it is a volume
    levels: tuple[DatasetLevel, ...] = ()           # finest first, at least one


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


def _level_of(about: Any) -> DatasetLevel:
    return DatasetLevel((about.size.z, about.size.y, about.size.x), (about.spacing.z, about.spacing.y, about.spacing.x))


def dataset_of(message: Any) -> Dataset:
    state = _STATES.get(message.state, "failed")
    if state != "ready":
        return Dataset(message.name, state, message.error)
    about = message.description
    return Dataset(
        name=message.name,
        state=state,
        shape=(about.size.z, about.size.y, about.size.x),
        spacing=(about.spacing.z, about.spacing.y, about.spacing.x),
        dtype=_TYPES.get(about.type),
        value_range=(message.range.min, message.range.max),
        memory_bytes=message.memory_bytes,
        labels=message.labels,
        overlay=message.overlay,
        cells=message.cells,
        levels=tuple(map(_level_of, message.levels or [about])),
    )


def status_of(message: Any, endpoint: str) -> Status:
    refused = message.refused
    return Status(
        endpoint=endpoint,
        pid=message.pid,
        uptime_seconds=message.uptime_ms / 1000,
        clients=message.clients,
        queued=message.queued,
        running=message.running,
        frames_done=message.frames_done,
        frames_failed=message.frames_failed,
        refused=refused.bad_request + refused.unknown_dataset + refused.too_large + refused.over_quota,
        workers_lost=message.workers_lost,
        workers=tuple(
            Worker(w.worker, w.pid, w.host, w.threads, w.cached_bytes, w.fetched_bytes, w.rendered_ranks, w.silent_ms / 1000, w.leaving)
            for w in message.workers
        ),
        datasets=tuple(map(dataset_of, message.datasets)),
        web=tuple(
            WebTraffic(t.server, t.requests, t.retries, t.failures, t.unchanged, t.bytes, t.milliseconds / 1000) for t in message.web
        ),
    )
