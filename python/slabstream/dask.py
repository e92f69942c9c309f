"""Pictures of Dask's arrays, whose chunks stay in the processes that hold them (docs/dask.md).

    import slabstream.dask as sd

    service = sd.start(client)                     # a worker beside each Dask worker, the coordinator beside the scheduler
    image = sd.render(array, transfer="viridis")   # a dask.array.Array or an xarray.DataArray, as slabstream.render takes it
"""
from __future__ import annotations

import asyncio
import collections
import contextlib
import dataclasses
import itertools
import os
import pathlib
import tempfile
import threading
import time as clock
import weakref
from typing import Any, Mapping, Sequence

import dask
import dask.array
import distributed
import numpy
import numpy.typing
from dask.core import flatten
from dask.optimization import cull
from distributed.comm import get_address_host
from distributed.diagnostics.plugin import SchedulerPlugin, WorkerPlugin

from .address import is_loopback
from .errors import InvalidArgument, NotFound, SlabstreamError, Unavailable
from .image import Image
from .insitu import Owner
from .options import takes_options_of
from .programs import Kept, find_program
from .service import DEADLINE_SECONDS, Service, connect
from .volumes import at_time, channels_of, volume_of

_START_SECONDS, _END_SECONDS = 60.0, 20.0
_COME_SECONDS = 20.0       # that the owners of an array have to come
_ASK_AGAIN_SECONDS = 0.02
_MOST_TRIES = 8            # of a picture, if owners go
_TRY_AGAIN_SECONDS = 0.25  # once longer for each try: until Dask knows that a worker of its has gone
_MOST_ARRAYS = 4           # that are kept for further pictures
_MEMORY_PART = 3           # of a Dask worker's memory: for the worker beside it
_KEPT_PART = 4             # of the same: for chunks of a lazy array
_LEAST_MEMORY = 1 << 30
_CLOSE_SECONDS = 1.0       # that an event loop waits for an owner to leave
_MOST_BOXES, _MOST_BOXES_OF_ONE = 65536, 4096  # docs/wire.md, section 8

Box = tuple[tuple[int, int], ...]  # (begin, end) along z, y and x


def _write_private(file: pathlib.Path, content: bytes) -> None:
    file.touch(0o600)
    file.write_bytes(content)


class _Program:
    """A program of ours that ends with this process or before, and a private folder for its files, which goes with it."""

    def __init__(self, name: str, files: Mapping[str, bytes], *arguments: str):
        self.folder = tempfile.mkdtemp(prefix="slabstream-")
        for file, content in files.items():
            _write_private(pathlib.Path(self.folder, file), content)
        program = str(pathlib.Path(find_program()).with_name(name))
        self._kept = Kept([program, *(argument.replace("{folder}", self.folder) for argument in arguments)], f"rm -rf -- '{self.folder}'")
        self.first_line = self._kept.first_line

    def end(self) -> None:
        """Does not wait for it."""
        threading.Thread(target=self._kept.end, args=(_END_SECONDS,), daemon=True).start()


class _Coordinator(SchedulerPlugin):
    """The coordinator, on the scheduler's host. It ends with the client that started it, or with the scheduler."""

    def __init__(self, name: str, client: str):
        self.name, self._client = name, client

    async def start(self, scheduler: Any) -> None:
        host = "127.0.0.1" if scheduler.address.startswith("inproc:") else get_address_host(scheduler.address)
        host = f"[{host}]" if ":" in host else host
        keys = [] if is_loopback(host) else ["--keys", "{folder}/keys"]
        self._program = _Program("slabstream-coordinator", {}, "--listen", f"tcp://{host}:*", *keys)
        said = await asyncio.to_thread(self._program.first_line, _START_SECONDS)
        self.endpoints = dict(word.split("=", 1) for word in said.split() if "=" in word)
        if not self.endpoints:
            self._program.end()
            raise Unavailable(f"slabstream-coordinator beside the scheduler said '{said}' instead of its endpoints; its log is the scheduler's")
        folder = pathlib.Path(self._program.folder, "keys")
        self.files = {file: (folder / file).read_bytes() for file in ("client.json", "worker.json", "owner.json") if keys}

    def remove_client(self, scheduler: Any, client: str) -> None:
        if client == self._client:
            self._program.end()
            scheduler.loop.add_callback(scheduler.unregister_worker_plugin, None, self.name)

    async def close(self) -> None:
        self._program.end()


class _Beside(WorkerPlugin):
    """The worker beside a Dask worker, and the owners in that: they end with it."""

    def __init__(self, name: str, endpoint: str, files: Mapping[str, bytes], memory: str | None):
        self.name, self._endpoint, self._files, self._memory = name, endpoint, files, memory

    def setup(self, worker: Any) -> None:
        self.owners: dict[str, list[Owner]] = {}  # by dataset: one for each field
        self._lock, self._client = threading.Lock(), None
        memory, of_dask = self._memory, worker.memory_manager.memory_limit
        if memory is None and of_dask:
            memory = f"{max(of_dask // _MEMORY_PART, _LEAST_MEMORY) >> 20}M"
        limit = ["--memory", memory] if memory else []
        service = ["--service", "{folder}/worker.json"] if self._files else ["--coordinator", self._endpoint]
        self._program = _Program("slabstream-worker", self._files, "--threads", str(worker.state.nthreads), *limit, *service)
        self.service = f"{self._program.folder}/owner.json" if self._files else self._endpoint

    def client_of(self, worker: Any) -> Any:
        """A client of the scheduler that computes chunks. Not for the event loop."""
        with self._lock:
            if self._client is None:
                self._client = distributed.Client(worker.scheduler.address, security=worker.security, set_as_default=False)
            return self._client

    def leave(self, dataset: str) -> None:
        """Waits little: an owner ends once the event loop goes on, perhaps."""
        for owner in self.owners.pop(dataset, ()):
            closing = threading.Thread(target=owner.close, daemon=True)
            closing.start()
            closing.join(_CLOSE_SECONDS)

    def teardown(self, worker: Any) -> None:
        for dataset in list(self.owners):
            self.leave(dataset)
        if self._client is not None:
            threading.Thread(target=self._client.close, daemon=True).start()
        self._program.end()


@dataclasses.dataclass(frozen=True)
class _Field:
    """What all owners of an array share, and what each of them holds."""

    plugin: str
    dataset: str
    shape: tuple[int, ...]
    dtype: str
    spacing: tuple[float, ...]
    origin: tuple[float, ...]
    names: tuple[str, ...]  # of all fields of the dataset; none: it has one
    number: int  # of this one
    owners: tuple[str, ...]  # addresses of the Dask workers that own chunks of any field
    chunks: Mapping[str, Sequence[tuple[Any, Box]]]  # of this field, by the address of a Dask worker: keys and boxes

    def owner_at(self, dask_worker: Any, kind: Any = Owner, **options: Any) -> Any:
        boxes = [box for _, box in self.chunks[dask_worker.address]]
        owner = kind(self.dataset, self.shape, self.dtype, boxes, owner=self.owners.index(dask_worker.address),
                     owners=len(self.owners), spacing=self.spacing, origin=self.origin, fields=self.names, field=self.number,
                     service=dask_worker.plugins[self.plugin].service, **options)
        dask_worker.plugins[self.plugin].owners.setdefault(self.dataset, []).append(owner)
        return owner


def _in_place(chunk: Any, dtype: str) -> Any:
    """The chunk, or a copy if its samples cannot be read where they lie."""
    array = numpy.asarray(chunk)
    if array.dtype == bool:
        array = array.view(numpy.uint8)
    steps = [step for length, step in zip(array.shape, array.strides) if length > 1]
    fits = array.dtype == dtype and all(step > 0 and step % array.dtype.itemsize == 0 for step in steps)
    return array if fits else numpy.array(array, dtype, order="C")


def _own(field: _Field, dask_worker: Any) -> None:
    """On a Dask worker: becomes the owner of its chunks."""
    chunks = field.chunks[dask_worker.address]
    missing = [key for key, _ in chunks if key not in dask_worker.data]
    if missing:
        raise Unavailable(f"chunk {missing[0]} is not at {dask_worker.address} any more")
    arrays = [_in_place(dask_worker.data[key], field.dtype) for key, _ in chunks]
    item = numpy.dtype(field.dtype).itemsize
    strides = [[step if length > 1 else item for length, step in zip(array.shape, array.strides)] for array in arrays]
    field.owner_at(dask_worker, strides=strides).publish(1, arrays, copy=False)


class _Chunks:
    """Has Dask compute the chunks of a lazy array that a Dask worker owns, when they are asked for. It keeps what Dask computes as long as
    the arrays of make()."""

    def __init__(self, field: _Field, graph: Mapping[Any, Any], dask_worker: Any):
        self._field, self._graph, self._dask_worker = field, graph, dask_worker
        self._keys = [key for key, _ in field.chunks[dask_worker.address]]
        self.computed: collections.Counter[Any] = collections.Counter()  # by key; for tests
        self._ended, self._happened = False, threading.Event()

    def end(self) -> None:
        """From any thread: make() returns soon, and fails."""
        self._ended = True
        self._happened.set()

    def _wait(self, holds: Any) -> None:
        while not holds() and not self._ended:
            self._happened.wait()
            self._happened.clear()
        if self._ended:
            raise Unavailable(f"{self._dask_worker.address} does not own the array any more")

    def make(self, box: int, _: int) -> numpy.typing.NDArray[Any]:
        key, worker = self._keys[box], self._dask_worker
        self.computed[key] += 1
        graph, _ = cull(self._graph, [key])
        (future,) = worker.plugins[self._field.plugin].client_of(worker).get(
            graph, [key], sync=False, workers=[worker.address], allow_other_workers=True)
        future.add_done_callback(lambda _: self._happened.set())
        self._wait(future.done)
        if future.status == "error":
            error = future.exception()
            kind = Unavailable if isinstance(error, (distributed.KilledWorker, OSError)) else InvalidArgument
            raise kind(f"chunk {key}: {type(error).__name__}: {error}")
        if future.status != "finished":
            raise Unavailable(f"chunk {key} was {future.status} while it was computed")
        found: list[Any] = []

        def look() -> None:  # on the event loop, whose data it is
            found.append(worker.data.get(key))
            self._happened.set()

        worker.loop.add_callback(look)
        self._wait(lambda: found)
        chunk = future.result() if found[0] is None else found[0]
        array = numpy.ascontiguousarray(_in_place(chunk, self._field.dtype))
        kept = array.view(_KeptArray)
        kept.future = future
        return kept


class _KeptArray(numpy.ndarray[Any, Any]):
    """An array that keeps what Dask has computed for it."""

    future: Any = None


class _LazyOwner(Owner):
    """An owner that ends while a chunk is being computed."""

    chunks: _Chunks | None = None

    def close(self) -> None:
        if self.chunks is not None:
            self.chunks.end()
        super().close()


def _own_lazy(field: _Field, graph: Mapping[Any, Any], dask_worker: Any) -> None:
    """On a Dask worker: becomes the owner of chunks that it has computed when they are asked for."""
    chunks = _Chunks(field, graph, dask_worker)
    limit = dask_worker.memory_manager.memory_limit
    owner = field.owner_at(dask_worker, _LazyOwner, make=chunks.make, budget=limit // _KEPT_PART if limit else _LEAST_MEMORY)
    owner.chunks = chunks
    owner.publish(1)


def _leave(plugin: str, dataset: str, dask_worker: Any) -> None:
    dask_worker.plugins[plugin].leave(dataset)


def _told(plugin: str, dask_scheduler: Any) -> Any:
    coordinator = dask_scheduler.plugins[plugin]
    return coordinator.endpoints, coordinator.files


def _is_view(samples: Any) -> bool:
    """Of a persisted array: numpy makes views of its chunks."""
    layers = getattr(samples.__dask_graph__(), "layers", {})
    kept = [name for name, layer in layers.items() if all(isinstance(task, distributed.Future) for task in layer.values())]
    return bool(kept) and all(name in kept or name.startswith(("getitem-", "transpose-")) for name in layers)


def _boxes(chunks: Sequence[Sequence[int]]) -> Any:
    """Those of chunks, in the order of their keys."""
    ends = [list(itertools.accumulate(along)) for along in chunks]
    return itertools.product(*([(end - length, end) for end, length in zip(*along)] for along in zip(ends, chunks)))


def _upright(volume: Any) -> tuple[Any, tuple[float, ...], tuple[float, ...]]:
    """Samples with axes that run as those of the world, their distances, and the place of the first one: along z, y, x."""
    samples, steps, origin = volume.samples, [], []
    if volume.masked:
        samples = dask.array.ma.filled(samples.astype(numpy.float32), numpy.nan)
    for axis, length in enumerate(samples.shape):
        step, begin = volume.grid.steps[2 - axis][2 - axis], volume.grid.origin[2 - axis]
        if step < 0:
            samples, begin, step = numpy.flip(samples, axis), begin + (length - 1) * step, -step
        steps.append(step)
        origin.append(begin)
    return samples, tuple(steps), tuple(origin)


class DaskService(contextlib.AbstractContextManager["DaskService"]):
    """Made by start(). A context manager: leaving it ends the service. It also ends with its Dask client."""

    #: The connected service: its status(), and pictures of other datasets.
    service: Service

    def __init__(self, client: Any, memory: str | None = None):
        self._client, self._plugin = client, f"slabstream-{client.id}"
        self._lock, self._numbers = threading.RLock(), itertools.count(1)
        self._held: collections.OrderedDict[str, tuple[str, Any]] = collections.OrderedDict()  # by names of arrays: dataset, what keeps the chunks
        client.register_plugin(_Coordinator(self._plugin, client.id), name=self._plugin)
        try:
            self._start(memory)
        except BaseException:
            self._end()
            raise

    def _start(self, memory: str | None) -> None:
        client = self._client
        endpoints, files = client.run_on_scheduler(_told, self._plugin)
        ours = files.pop("client.json", None)
        client.register_plugin(_Beside(self._plugin, endpoints["workers"], files, memory), name=self._plugin)
        if ours is None:
            self.service = connect(endpoint=endpoints["client"])
        else:
            with tempfile.TemporaryDirectory(prefix="slabstream-") as folder:
                file = pathlib.Path(folder, "client.json")
                _write_private(file, ours)
                self.service = connect(file)
        wanted, deadline = len(client.scheduler_info(n_workers=-1)["workers"]), clock.monotonic() + _START_SECONDS
        while (there := len(self.service.status().workers)) < wanted:
            if clock.monotonic() > deadline:
                raise Unavailable(f"{there} of {wanted} workers have come to the coordinator within {_START_SECONDS:g} s")
            clock.sleep(_ASK_AGAIN_SECONDS)

    @takes_options_of("render")
    def render(self, array: Any, *, spacing: Any = None, origin: Any = None, time: int | None = None, channel_axis: int | None = None,
               deadline: float = DEADLINE_SECONDS, **options: Any) -> Image:
        """A picture of a dask.array.Array, or of an xarray.DataArray of one. Axes, `spacing`, `origin` and coordinates are as of
        slabstream.load(). `time`: a number, of an array with four axes. `channel_axis`: the axis of what is left along which the array has
        channels, which are fields of one picture (`channels`); None: a dimension of the DataArray that is called channel, c, band or
        variable, with its coordinates as names.

        Chunks of a persisted array stay where they are. Of any other array, Dask computes the chunks that pictures need, and drops them
        when others need their memory. The array stays known until nobody has it any more, or until three others have been shown. If chunks
        go meanwhile, the picture comes once Dask has computed them again; it fails if Dask cannot."""
        channels = channels_of(array if time is None else at_time(array, time), channel_axis)
        volumes = {name: volume_of(channel, spacing, origin) for name, channel in channels.items()}
        if not all(isinstance(volume.samples, dask.array.Array) for volume in volumes.values()):
            raise InvalidArgument(f"a {type(array).__name__} is not an array of Dask: slabstream.render() takes it")
        key = " ".join(volume.samples.name for volume in volumes.values())
        for number in range(1, _MOST_TRIES + 1):
            try:
                return self.service.render(self._dataset_of(key, volumes, array), deadline=deadline, **options)
            except (NotFound, Unavailable) as error:
                refused = isinstance(error, NotFound) and self._is_there(key)  # of an option, not of the array
                if refused or number == _MOST_TRIES or self._client.status != "running":
                    raise
                self._forget(key)
                clock.sleep(number * _TRY_AGAIN_SECONDS)
        raise AssertionError("unreachable")

    def _dataset_of(self, name: str, volumes: Mapping[str, Any], kept_with: Any) -> str:
        """The name of the array's dataset, which is there."""
        with self._lock:
            if name not in self._held:
                self._hold(name, volumes)
                # In a thread: nothing may wait where Python collects what is gone.
                weakref.finalize(kept_with, lambda: threading.Thread(target=self._forget, args=(name,), daemon=True).start()).atexit = False
            self._held.move_to_end(name)
            while len(self._held) > _MOST_ARRAYS:
                self._forget(next(iter(self._held)))
            return self._held[name][0]

    def _hold(self, name: str, volumes: Mapping[str, Any]) -> None:
        """Makes Dask workers owners of the chunks that they hold, or may be asked for."""
        upright = [_upright(volume) for volume in volumes.values()]
        samples, spacing, origin = upright[0]
        all_samples = [each for each, _, _ in upright]
        if not all(length > 0 for along in samples.chunks for length in along):  # or NaN
            raise InvalidArgument("the array has chunks without voxels or of unknown sizes: rechunk() or compute_chunk_sizes() helps")

        def check_chunks(at_one: int) -> None:
            if samples.npartitions > _MOST_BOXES or at_one > _MOST_BOXES_OF_ONE:
                raise InvalidArgument(f"the array has {samples.npartitions} chunks, {at_one} of them at one Dask worker: "
                                      f"at most {_MOST_BOXES}, and {_MOST_BOXES_OF_ONE} at one, can be shown; rechunk() makes larger ones")

        check_chunks(samples.npartitions // max(len(self._client.nthreads()), 1))  # at least; before anything is computed
        keys = [list(flatten(each.__dask_keys__())) for each in all_samples]
        futures = {future.key: future for future in distributed.futures_of(all_samples)}
        lazy = not all(key in futures for key in itertools.chain(*keys))
        if lazy and all(map(_is_view, all_samples)):
            futures = {future.key: future for future in distributed.futures_of(self._client.persist(all_samples))}
            lazy = False
        boxes = [list(zip(of_one, _boxes(each.chunks))) for of_one, each in zip(keys, all_samples)]
        chunks = [self._deal(each) if lazy else self._find(each, futures) for each in boxes]
        check_chunks(max(len(each) for of_one in chunks for each in of_one.values()))
        owners = tuple(sorted(set().union(*chunks)))
        chunks = [{owner: of_one.get(owner, []) for owner in owners} for of_one in chunks]
        dtype = "uint8" if samples.dtype == bool else samples.dtype.newbyteorder("=").name
        names = tuple(volumes) if len(volumes) > 1 else ()
        dataset = f"dask-{os.getpid()}-{next(self._numbers)}"
        self._held[name] = dataset, list(futures.values())  # not the array: it may be the caller's, which would never go
        try:
            for number, (each, of_one) in enumerate(zip(all_samples, chunks)):
                field = _Field(self._plugin, dataset, each.shape, dtype, spacing, origin, names, number, owners, of_one)
                self._own_on_demand(field, each) if lazy else self._run(_own, field, workers=owners)
            self._wait_for(name)
        except BaseException:
            self._forget(name)
            raise

    def _own_on_demand(self, field: _Field, samples: Any) -> None:
        graph = dict(dask.optimize(samples)[0].__dask_graph__())
        for worker, of_worker in field.chunks.items():
            needed, _ = cull(graph, [key for key, _ in of_worker])
            # What is persisted of it stays known to the scheduler by its keys.
            needed = {key: task for key, task in needed.items() if not isinstance(task, distributed.Future)}
            self._run(_own_lazy, field, needed, workers=[worker])

    def _deal(self, boxes: Sequence[tuple[Any, Box]]) -> dict[str, list[tuple[Any, Box]]]:
        """Chunks that nobody has yet, in contiguous ranges, to all Dask workers."""
        workers = sorted(self._client.nthreads())[: len(boxes)]
        if not workers:
            raise Unavailable("there is no Dask worker")
        ends = [len(boxes) * i // len(workers) for i in range(len(workers) + 1)]
        return {worker: list(boxes[begin:end]) for worker, begin, end in zip(workers, ends, ends[1:])}

    def _find(self, boxes: Sequence[tuple[Any, Box]], futures: Mapping[Any, Any]) -> dict[str, list[tuple[Any, Box]]]:
        """Chunks of a persisted array, where they are."""
        distributed.wait(list(futures.values()))
        who = self._client.who_has(list(futures.values()))
        chunks: dict[str, list[tuple[Any, Box]]] = {}
        for key, box in boxes:
            if futures[key].status == "error":
                futures[key].result()  # raises what the computation has raised
            if not who.get(key):
                raise Unavailable(f"chunk {key} is on no Dask worker")
            worker = min(who[key], key=lambda address: len(chunks.get(address, ())))
            chunks.setdefault(worker, []).append((key, box))
        return chunks

    def _run(self, function: Any, *arguments: Any, workers: Sequence[str]) -> None:
        for answer in self._client.run(function, *arguments, workers=workers, on_error="return").values():
            if isinstance(answer, SlabstreamError):
                raise answer
            if isinstance(answer, Exception):
                raise Unavailable(f"a Dask worker does not answer: {answer}")

    def _is_there(self, name: str) -> bool:
        """The coordinator has the dataset of a held array."""
        dataset, _ = self._held.get(name, (None, None))
        return dataset is not None and any(there.name == dataset for there in self.service.datasets())

    def _wait_for(self, name: str) -> None:
        deadline = clock.monotonic() + _COME_SECONDS
        while not self._is_there(name):
            if clock.monotonic() > deadline:
                raise Unavailable(f"the owners of the array have not come to the coordinator within {_COME_SECONDS:g} s")
            clock.sleep(_ASK_AGAIN_SECONDS)

    def _forget(self, name: str) -> None:
        with self._lock:
            dataset, _ = self._held.pop(name, (None, None))
            if dataset is not None and self._client.status == "running":
                self._client.run(_leave, self._plugin, dataset, on_error="ignore")  # all that there are: its owners may have gone

    def close(self) -> None:
        """Ends the service's programs; chunks stay where they are."""
        with self._lock:
            for name in list(self._held):
                self._forget(name)
        self.service.close()
        _services.pop(self._client.id, None)
        if self._client.status == "running":
            self._end()

    def _end(self) -> None:
        self._client.run_on_scheduler(_end_programs, self._plugin)

    def __exit__(self, *_: object) -> None:
        self.close()


async def _end_programs(plugin: str, dask_scheduler: Any) -> None:
    if plugin in dask_scheduler.worker_plugins:
        await dask_scheduler.unregister_worker_plugin(None, plugin)
    await dask_scheduler.plugins[plugin].close()
    dask_scheduler.remove_plugin(plugin)


_services: dict[str, DaskService] = {}  # by the id of the client


def start(client: Any = None, *, memory: str | None = None) -> DaskService:
    """The service of a Dask client (None: the present one): it is started if there is none. Slabstream is installed where the scheduler and
    the workers run. Workers that come later get a worker beside them, too.

    `memory`: the limit of each worker beside a Dask worker, as "4G"; None: a third of the Dask worker's. Pictures that follow one another
    are quick if the voxels that it draws fit."""
    client = distributed.get_client() if client is None else client
    if client.id not in _services:
        _services[client.id] = DaskService(client, memory)
    return _services[client.id]


@takes_options_of("render")
def render(array: Any, **options: Any) -> Image:
    """As DaskService.render, of the service of the present Dask client."""
    return start().render(array, **options)
