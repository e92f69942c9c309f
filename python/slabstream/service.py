"""AsyncService and Service: a connected service, for asyncio and for everybody else. All of it may be used by several threads at once."""
from __future__ import annotations

import collections
import contextlib
import copy
import functools
import os
import sys
from typing import TYPE_CHECKING, Any, AsyncGenerator, Callable, Coroutine, Generator, Iterator, Sequence, TypeVar

from . import probe, schema, values
from .address import Address, find_service, is_address
from .connection import ANSWER_SECONDS, CONNECT_SECONDS, Connection
from .drafts import Draft, camera_draft_of, draft_of, slice_drafts_of
from .errors import InvalidArgument
from .frame import Frame, Progress, picture_of
from .image import Image, side_by_side
from .moves import ball_around, cameras_of, times_of, turned_views
from .options import COMMANDS, takes_options_of
from .probe import Histogram, JointHistogram, Label, LabelStatistics, Sample
from .status import Dataset, Parameter, Simulation, Status, dataset_of, simulation_of, status_of
from .transfer import TransferFunction, mapped
from .uploads import upload_of
from .viewer import Viewer, view
from .volumes import layers_of, on_grid, volume_of
from .waiting import ASYNCIO, BLOCKING, Front, each, run

DEADLINE_SECONDS = 600.0
_ORDER_SECONDS = 30.0
_QUESTION_SECONDS = 120.0  # volumes may have to be loaded first
_MOST_ITEMS = 128
_MOST_FRAMES, _MOST_TURNS, _MOST_IN_FLIGHT = 100000, 1000, 64
_MOST_VIEWS = 1024  # of one question


def _of(field: int | str | None, time: int | str | None) -> dict[str, str]:
    """What a question is about."""
    of = {"field": values.whole_text(field), "time": values.whole_text(time)}
    for name, text in of.items():
        if text is not None and (not isinstance(text, str) or len(text.encode()) > values.MOST_NAME_BYTES):
            raise InvalidArgument(f"{name} {text!r} is neither a number nor a text of at most {values.MOST_NAME_BYTES} bytes")
    return {name: text for name, text in of.items() if text is not None}


def _with_views(draft: Draft, views: Iterator[Any], times: Sequence[str]) -> Iterator[Draft]:
    for view, time in zip(views, times):
        moved = copy.copy(draft)
        moved.frame = schema.FrameRequest()
        moved.frame.CopyFrom(draft.frame)
        moved.frame.view.CopyFrom(view)
        moved.frame.time = time
        yield moved


class AsyncService:
    """Made by connect_async(): a service for asyncio. It has the methods of Service, as coroutines, which never block the event loop. Any
    number of tasks, of any loops, may use it. If a task is cancelled, the service gives up what the task waits for. An async context
    manager: leaving it closes the connection."""

    def __init__(self, address: Address, timeout: float, front: Front = ASYNCIO):
        self._connection, self._timeout = Connection(address, front), timeout

    async def __aenter__(self) -> AsyncService:
        await self._connection.greet(self._timeout)
        return self

    async def __aexit__(self, *error: object) -> None:
        await self.close()

    def __await__(self) -> Generator[Any, None, AsyncService]:
        return self.__aenter__().__await__()

    @property
    def endpoint(self) -> str:
        return self._connection.endpoint

    @takes_options_of("render")
    async def render(self, /, dataset: str, *, deadline: float = DEADLINE_SECONDS, **options: Any) -> Image:
        """A picture of a dataset, by its name in the service's catalogue. Waits for it, at most `deadline` seconds.

        Raises InvalidArgument, NotFound, Unavailable, ResourceExhausted or DeadlineExceeded with the service's sentence.
        """
        return await picture_of(await self._frame(dataset, deadline, options), self._connection.front)

    @takes_options_of("render")
    async def submit(self, /, dataset: str, *, deadline: float = DEADLINE_SECONDS, previews: bool = False,
                     on_progress: Callable[[Progress], None] | None = None, on_preview: Callable[[Image], None] | None = None,
                     **options: Any) -> Frame:
        """Asks for a picture and returns at once.

        `previews`, or an `on_preview`: a picture of coarse voxels first, if the others take long to read, then one after each group of
        boxes, nearest first (see `groups`). Callbacks run on the connection's thread: they must be quick and not wait for anything of the
        service. `deadline` is in seconds, up to a day.
        """
        frame = await self._frame(dataset, deadline, options, previews, on_progress, on_preview)
        frame._send()
        return frame

    async def _frame(self, dataset: str, deadline: float, options: dict[str, Any], previews: bool = False,
                     on_progress: Callable[[Progress], None] | None = None, on_preview: Callable[[Image], None] | None = None) -> Frame:
        """One that is not sent yet."""
        draft = draft_of(dataset, options)
        await self._settle([draft])
        draft.frame.previews = previews or on_preview is not None
        return Frame(self._connection, draft, deadline, on_progress, on_preview)

    @takes_options_of("render")
    def turntable(self, /, dataset: str, frames: int | None = None, *, turns: int = 1, path: Any = None, in_flight: int = 2,
                  deadline: float = DEADLINE_SECONDS, **options: Any) -> AsyncGenerator[Image, None]:
        """Pictures of full turns about the volume's z axis, one by one, in order. `path` moves through cameras instead: a list of cameras, or
        the file of one (docs/movies.md). `time` may be several, "FIRST:LAST" or "FIRST:LAST:STEP": frames are spread evenly over them, and there is
        one for each if `frames` is left out. `in_flight` pictures are asked for before they are needed, so that the service never waits. Frames
        that are open when the iterator is closed are cancelled."""
        several = times_of(options.get("time"))
        count = values.integer("frames", len(several) if frames is None and several else frames, 1, _MOST_FRAMES)
        turns = values.integer("turns", turns, 0, _MOST_TURNS)
        in_flight = values.integer("in_flight", in_flight, 1, _MOST_IN_FLIGHT)
        draft = draft_of(dataset, {**options, "time": None} if several else options)
        times = [several[i * len(several) // count] if several else draft.frame.time for i in range(count)]
        stops: list[Draft] = []
        if path is None:
            if draft.frame.view.HasField("eye") and turns > 0:
                raise InvalidArgument(
                    "eye fixes the viewpoint, but a turntable turns by azimuth, about look_at; turns=0 fixes the view"
                )

            async def views() -> Iterator[Any]:
                return turned_views(await self._whole_view(draft, times), count, turns)
        else:
            for name, value in options.items():
                if value is not None and name in COMMANDS["render"]["camera"].excludes + ("camera",):
                    raise InvalidArgument(f"path excludes {name}")
            seconds, cameras = cameras_of(path)
            stops = [camera_draft_of(dataset, {**options, "time": None}, i, camera) for i, camera in enumerate(cameras)]

            async def views() -> Iterator[Any]:
                return await self._views_along(seconds, [await self._whole_view(each, times) for each in stops], draft, count)

        async def drafts() -> Iterator[Draft]:
            await self._settle([draft, *stops])
            moved = await views()
            return _with_views(draft, moved, times)

        return self._pipelined(drafts, in_flight, deadline)

    async def _whole_view(self, draft: Draft, times: Sequence[str]) -> Any:
        """The view of pictures at these times, with what its options leave to the volume: it frames what shows in any of them."""
        query = schema.ViewQuery(frame=draft.frame)
        framed = None
        for time in dict.fromkeys(times):
            query.frame.time = time
            reply = await self._connection.ask("view_query", query, _QUESTION_SECONDS)
            if reply.HasField("framed"):
                framed = reply.framed if framed is None else ball_around(framed, reply.framed)
        if framed is not None and times[0] != times[-1]:
            query.frame.time = times[0]
            query.framed.CopyFrom(framed)
            reply = await self._connection.ask("view_query", query, _QUESTION_SECONDS)
        return reply.view

    async def _views_along(self, seconds: Sequence[float], cameras: Sequence[Any], draft: Draft, frames: int) -> Iterator[Any]:
        """Those of frames that are spread evenly over the path of these cameras, which are complete. `draft`: of the dataset."""
        path = [schema.PathCamera(seconds=at, view=view) for at, view in zip(seconds, cameras)]
        length = seconds[-1] - seconds[0]
        wanted = [seconds[0] + length * (i / (frames - 1) if frames > 1 else 0) for i in range(frames)]
        query = schema.ViewQuery(frame=draft.frame, path=path)
        replies = []
        for begin in range(0, frames, _MOST_VIEWS):
            query.at[:] = wanted[begin:begin + _MOST_VIEWS]
            replies.append(await self._connection.ask("view_query", query, _QUESTION_SECONDS))
        return (view for reply in replies for view in reply.path)

    @property
    def address(self) -> Address:
        return self._connection.address

    @takes_options_of("slice")
    async def slice(self, /, dataset: str, *, deadline: float = DEADLINE_SECONDS, **options: Any) -> Image:
        """Planes or thick slabs of a volume; several are put side by side."""
        drafts = slice_drafts_of(dataset, options)

        async def settled() -> Iterator[Draft]:
            await self._settle(drafts)
            return iter(drafts)

        return side_by_side([image async for image in self._pipelined(settled, 3, deadline)])

    async def histogram(self, dataset: str, *, field: int | str | None = None, time: int | str | None = None,
                        timeout: float = _QUESTION_SECONDS) -> Histogram:
        """How often which value occurs in a dataset. `field`: a channel's number or name (usually the first one that is shown); `time`: as the
        option of that name takes it (usually that of the file)."""
        return probe.histogram_of(await self._summary(dataset, timeout, **_of(field, time)))

    async def joint_histogram(self, dataset: str, *, field: int | str | None = None, time: int | str | None = None,
                              timeout: float = _QUESTION_SECONDS) -> JointHistogram:
        """How often which value occurs together with which slope, for two-dimensional transfer functions. `field`, `time`: as of histogram()."""
        query = schema.JointHistogramQuery(dataset=dataset, **_of(field, time))
        return probe.joint_histogram_of(await self._connection.ask("joint_histogram_query", query, timeout))

    async def labels(self, dataset: str, *, timeout: float = _QUESTION_SECONDS) -> list[Label]:
        """The labels that occur in a dataset, by value; empty: it has no labels."""
        return probe.labels_of(await self._summary(dataset, timeout))

    async def label_statistics(self, dataset: str, *, clip_box: Any = None, field: int | str | None = None, time: int | str | None = None,
                               timeout: float = _QUESTION_SECONDS) -> list[LabelStatistics]:
        """Volume, mean, deviation and extremes of the voxels of each label of a dataset, by the label's value. Labels lie on the voxels of the
        dataset's volume. `clip_box`: only of voxels with their centres in this box, as the option of that name takes it. `field`, `time`: as of
        histogram()."""
        box = values.clip_box("clip_box", ":,:,:" if clip_box is None else clip_box)
        query = schema.StatisticsQuery(dataset=dataset, labels=True, box=box, **_of(field, time))
        return probe.label_statistics_of(await self._connection.ask("statistics_query", query, timeout))

    async def value(self, dataset: str, at: Any, *, field: int | str | Sequence[int | str] | None = None, time: int | str | None = None,
                    timeout: float = _QUESTION_SECONDS) -> Sample | None:
        """The voxel that holds a point: x, y, z of the world, as in all options. None: the point lies outside the volume. `field`, `time`: as of
        histogram(), but there may be several fields; None: the first one that shows, and the overlay."""
        named: Sequence[Any] = field if isinstance(field, (list, tuple)) else [] if field is None else [field]
        query = schema.SampleQuery(dataset=dataset, points=[values.vec3(values.point("at", at))], channels=[_of(each, None)["field"] for each in named],
                                   **_of(None, time))
        return probe.sample_of((await self._connection.ask("sample_query", query, timeout)).samples[0])

    @takes_options_of("render")
    async def pick(self, /, dataset: str, x: float, y: float, *, timeout: float = _QUESTION_SECONDS, **options: Any) -> Sample | None:
        """What the picture with these options shows at (x, y), the volume or a shape: pixels from its upper left corner, with the first pixel's
        centre at 0.5. None: it shows nothing there. docs/rendering.md says which point of the ray that is."""
        draft = draft_of(dataset, options)
        await self._settle([draft])
        frame = draft.frame
        query = schema.PickQuery(frame=frame, x=values.number("x", x, 0, frame.size.width), y=values.number("y", y, 0, frame.size.height))
        return probe.picked_of(await self._connection.ask("pick_query", query, timeout), frame)

    async def status(self, timeout: float = ANSWER_SECONDS) -> Status:
        """Workers, datasets and counts of frames."""
        return status_of(await self._connection.ask("status_query", schema.StatusQuery(), timeout), self.endpoint)

    async def datasets(self, timeout: float = _ORDER_SECONDS) -> list[Dataset]:
        """The service's catalogue."""
        return await self._order(schema.DATA_ACTION_LIST, [], timeout)

    async def add_data(self, /, *items: str, timeout: float = _ORDER_SECONDS, **named: str | os.PathLike[str]) -> list[Dataset]:
        """Adds volumes or folders, for as long as the coordinator runs: add_data(head="/data/head.nii.gz"), or texts as `slabstream data add`
        takes them ("head=/data/head.nii.gz,labels=/data/atlas.nii.gz"). Paths are absolute, on the coordinator's host. Needs the role admin
        where the service has keys. Returns the catalogue."""
        texts = [*items, *(f"{name}={os.fspath(path)}" for name, path in named.items())]
        for text in texts:
            name, equals, path = ("", "=", text) if is_address(text) else text.partition("=")
            where = path if equals else name
            if not (where.startswith("/") or is_address(where)):
                raise InvalidArgument(f"{text}: the path must be absolute, since it is a path on the coordinator's host")
        return await self._order(schema.DATA_ACTION_ADD, texts, timeout)

    async def add(self, name: str, volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None,
                  labels: Any = None, overlay: Any = None) -> Dataset:
        """Sends an array to the service, wherever it runs, as a dataset that every client sees: add("name", array, spacing=(dz, dy, dx)). It stays
        until remove_data(), or until the coordinator ends. Arrays as load() takes them, layers on the same grid; dask and zarr arrays are sent
        chunk by chunk. Needs the role admin where the service has keys."""

        def prepared() -> tuple[Any, Iterator[memoryview]]:
            checked = volume_of(volume, spacing, origin, direction, world)
            layers = [None if layer is None else on_grid(layer, checked.grid) for layer in layers_of(labels, overlay)]
            return upload_of(name, checked, *layers)

        reply = await self._connection.upload(*await self._connection.front.do(prepared))
        return next(dataset_of(dataset) for dataset in reply.datasets if dataset.name == name)

    async def remove_data(self, *names: str, timeout: float = _ORDER_SECONDS) -> list[Dataset]:
        """Removes datasets, or watched folders, from the catalogue. Files stay."""
        return await self._order(schema.DATA_ACTION_REMOVE, names, timeout)

    async def reload_data(self, *names: str, timeout: float = _ORDER_SECONDS) -> list[Dataset]:
        """Makes the next frame read the files again, even if they seem unchanged."""
        return await self._order(schema.DATA_ACTION_RELOAD, names, timeout)

    async def steer(self, dataset: str, /, **changes: float) -> Simulation:
        """Changes parameters of the simulation that holds a dataset: steer("rho", feed=0.03). All of them, or none if one is refused. Its next
        steps have them. Without any: how far it is."""
        most = sys.float_info.max
        steered = [schema.SteeredValue(name=name, value=values.number(name, value, -most, most)) for name, value in changes.items()]
        return simulation_of((await self._connection.ask("steer_dataset", schema.SteerDataset(dataset=dataset, values=steered))).simulation)

    async def parameters(self, dataset: str) -> dict[str, Parameter]:
        """The parameters of the simulation that holds a dataset, by name, as they are now."""
        return {each.name: each for each in (await self.steer(dataset)).parameters}

    async def close(self) -> None:
        """Ends the connection, which cancels what is open."""
        await self._connection.front.do(self._connection.close)

    def __repr__(self) -> str:
        return f"<slabstream.AsyncService at {self.endpoint}>"

    async def _summary(self, dataset: str, timeout: float, **of: str) -> Any:
        transfer = schema.TransferChoice(preset="auto", opacity_distance=1)
        return await self._connection.ask("summary_query", schema.SummaryQuery(dataset=dataset, transfer=transfer, **of), timeout)

    async def _settle(self, drafts: list[Draft]) -> None:
        """What pictures of one dataset need beside their options: shapes at the service, and the values that a colour map of matplotlib spans."""
        for each in drafts:
            for choice, shape in each.shapes:
                each.sent.append(await self._connection.send_shape(shape))
                choice.shape = each.sent[-1].name
        draft = drafts[0]
        if draft.colors is not None:
            preset = (await self._transfer_of(draft)).transfer
            ends = preset.colors[0].value, preset.colors[-1].value
            # Where nothing lies behind, colours are as they are (ResolveLook in the service).
            opacities = TransferFunction(opacities=[(ends[0], 1)]).message().opacities if draft.frame.clipping.HasField("slab") else preset.opacities
            for each in drafts:
                each.frame.transfer.function.CopyFrom(mapped(draft.colors, *ends, opacities))
                each.frame.transfer.ClearField("scalar_range")

    async def _transfer_of(self, draft: Draft) -> Any:
        """The dataset's summary under the transfer function of the draft."""
        frame = draft.frame
        query = schema.SummaryQuery(dataset=frame.dataset, transfer=frame.transfer, field=frame.channels[0] if frame.channels else "", time=frame.time,
                                    looks=frame.fields, flat=frame.clipping.HasField("slab"))
        if query.transfer.WhichOneof("choice") is None:
            query.transfer.preset = "auto"
        if not query.transfer.HasField("opacity_distance"):
            query.transfer.opacity_distance = 1
        return await self._connection.ask("summary_query", query, _QUESTION_SECONDS)

    async def _order(self, action: int, items: Any, timeout: float) -> list[Dataset]:
        if len(items) > _MOST_ITEMS:
            raise InvalidArgument(f"{len(items)} datasets at a time, at most {_MOST_ITEMS} can be named")
        order = schema.DataOrder(action=action, items=[os.fsencode(item) for item in items])
        return [dataset_of(dataset) for dataset in (await self._connection.ask("data_order", order, timeout)).datasets]

    async def _pipelined(self, drafts: Callable[[], Coroutine[Any, Any, Iterator[Draft]]], in_flight: int,
                         deadline: float) -> AsyncGenerator[Image, None]:
        open_frames: collections.deque[Frame] = collections.deque()
        try:
            for draft in await drafts():
                open_frames.append(Frame(self._connection, draft, deadline))
                open_frames[-1]._send()
                if len(open_frames) == in_flight:
                    image = await picture_of(open_frames[0], self._connection.front)
                    open_frames.popleft()
                    yield image
            while open_frames:
                image = await picture_of(open_frames[0], self._connection.front)
                open_frames.popleft()
                yield image
        finally:
            for frame in open_frames:
                frame.cancel()


if TYPE_CHECKING:
    from .widget import Widget
    from typing_extensions import Concatenate, ParamSpec  # in typing from Python 3.10 on

    _Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


def _blocking(method: Callable[Concatenate[AsyncService, _Given], Coroutine[Any, Any, _Result]],
              ) -> Callable[Concatenate[Service, _Given], _Result]:
    @functools.wraps(method)
    def call(service: Service, /, *args: _Given.args, **kwargs: _Given.kwargs) -> _Result:
        return run(method(service._asking, *args, **kwargs))

    return call


def _blocking_each(method: Callable[Concatenate[AsyncService, _Given], AsyncGenerator[_Result, None]],
                   ) -> Callable[Concatenate[Service, _Given], Iterator[_Result]]:
    @functools.wraps(method)
    def call(service: Service, /, *args: _Given.args, **kwargs: _Given.kwargs) -> Iterator[_Result]:
        return each(method(service._asking, *args, **kwargs))

    return call


class Service(contextlib.AbstractContextManager["Service"]):
    """Made by connect(). A context manager: leaving it closes the connection, which cancels what is open. Ctrl-C cancels what is waited
    for. The methods that ask are those of AsyncService."""

    def __init__(self, address: Address, timeout: float = CONNECT_SECONDS):
        self._asking = AsyncService(address, timeout, BLOCKING)
        run(self._asking)

    @property
    def endpoint(self) -> str:
        return self._asking.endpoint

    @property
    def address(self) -> Address:
        return self._asking.address

    render = _blocking(AsyncService.render)
    submit = _blocking(AsyncService.submit)
    turntable = _blocking_each(AsyncService.turntable)
    slice = _blocking(AsyncService.slice)
    histogram = _blocking(AsyncService.histogram)
    joint_histogram = _blocking(AsyncService.joint_histogram)
    labels = _blocking(AsyncService.labels)
    label_statistics = _blocking(AsyncService.label_statistics)
    value = _blocking(AsyncService.value)
    pick = _blocking(AsyncService.pick)
    status = _blocking(AsyncService.status)
    datasets = _blocking(AsyncService.datasets)
    add_data = _blocking(AsyncService.add_data)
    add = _blocking(AsyncService.add)
    remove_data = _blocking(AsyncService.remove_data)
    reload_data = _blocking(AsyncService.reload_data)
    steer = _blocking(AsyncService.steer)
    parameters = _blocking(AsyncService.parameters)
    close = _blocking(AsyncService.close)

    _settle = _blocking(AsyncService._settle)

    @takes_options_of("render")
    def view(self, dataset: str, *, height: int | str = 512, panel: bool = False, behind_proxy: str | None = None, keep: Any = None,
             **options: Any) -> Widget | Viewer:
        """The viewer of a dataset, for a notebook: the value of a cell. It begins with these options. Where anywidget is missing, a still picture
        takes its place. It starts a gateway on this machine, which ends with this process.

        `height`: pixels, or a length of CSS. `panel`: the settings show at first. `behind_proxy`: the address of a proxy through which the
        browser reaches this machine, with {port} for the gateway's port; without one, pictures come over the kernel. `keep` stays as long as
        the viewer."""
        return view(self, dataset, keep, height, panel, behind_proxy, options)

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<slabstream.Service at {self.endpoint}>"


def connect(service: str | os.PathLike[str] | None = None, *, endpoint: str | None = None, timeout: float = CONNECT_SECONDS) -> Service:
    """Connects to a service that runs.

    `service` is the service file of one with keys (docs/security.md), `endpoint` where another one listens, such as
    "tcp://127.0.0.1:7420"; with both, the endpoint is another way to the same service. With neither: $SLABSTREAM_SERVICE,
    $SLABSTREAM_ENDPOINT, or the service that `slabstream up` started here last.

    Raises Unavailable if nobody answers within `timeout` seconds or the service refuses the key; InvalidArgument, NotFound: the file or the
    endpoint is wrong.
    """
    return Service(find_service(service, endpoint), timeout)


def connect_async(service: str | os.PathLike[str] | None = None, *, endpoint: str | None = None,
                  timeout: float = CONNECT_SECONDS) -> AsyncService:
    """As connect(), for asyncio: `async with connect_async(...) as service`, or `service = await connect_async(...)`, which
    `await service.close()` ends."""
    return AsyncService(find_service(service, endpoint), timeout)
