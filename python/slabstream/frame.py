"""Frame: a picture that has been asked for."""
from __future__ import annotations

import concurrent.futures
import contextlib
import dataclasses
import logging
import time
from typing import Any, AsyncGenerator, AsyncIterator, Callable, Generator, Iterator

from . import schema
from .annotations import key_of
from .connection import Connection
from .drafts import Draft
from .errors import DataLoss, DeadlineExceeded, SlabstreamError
from .image import Image, PictureFormat, compose, geometry_of, statistics_of
from .runs import read_runs
from .waiting import ASYNCIO, BLOCKING, Changes, Front, each, run

_log = logging.getLogger("slabstream")


@dataclasses.dataclass(frozen=True)
class Progress:
    phase: str           # "queued", "loading" (the dataset is being read) or "running"
    queue_position: int  # frames before this one, while queued
    groups_done: int
    group_count: int     # 0: not planned yet
    attempt: int         # above 1: workers were lost
    workers: int


class _Waiting:
    """What the connection's thread tells. It does not refer to the Frame's connection."""

    def __init__(self, draft: Draft, on_progress: Callable[[Progress], None] | None, on_preview: Callable[[Image], None] | None):
        self.draft = draft
        self.on_progress, self.on_preview = on_progress, on_preview
        self.end: concurrent.futures.Future[Image] = concurrent.futures.Future()
        self.end.set_running_or_notify_cancel()  # from now on nobody but the service ends it
        self.changed = Changes()
        self.progress: Progress | None = None
        self.preview: Image | None = None
        self.submitted = time.monotonic()

    def progressed(self, progress: Any) -> None:
        self.progress = schema.read(Progress, progress, phase=schema.word(progress, "phase", "running"))
        if self.on_progress is not None:
            _tell(self.on_progress, self.progress)

    def replied(self, reply: Any, payload: memoryview) -> None:
        latency = time.monotonic() - self.submitted
        width, height = self.draft.frame.size.width, self.draft.frame.size.height
        if (reply.size.width, reply.size.height) != (width, height):
            raise DataLoss(f"FrameReply.size is {reply.size.width}x{reply.size.height}, asked for was {width}x{height}")
        if len(reply.shares) != 1:  # several come straight from workers alone
            raise DataLoss(f"FrameReply.shares are {len(reply.shares)}, asked for was 1")
        part = read_runs(reply.shares[0].runs, payload, width, height)
        rgba, depth = compose(part, width, height, self.draft.format)
        bare = compose(part, width, height, PictureFormat())[0] if self.draft.format.annotations.any() else None
        preview = reply.groups_done != reply.group_count
        format = dataclasses.replace(self.draft.format, key=key_of(reply.key))
        image = Image(rgba, depth, format=format, geometry=geometry_of(reply.geometry),
                      statistics=None if preview else statistics_of(reply.statistics, latency), preview=preview, bare=bare)
        if preview:
            self.preview = image
            self.changed.tell()
            if self.on_preview is not None:
                _tell(self.on_preview, image)
        else:
            self.end.set_result(image)
            self.changed.tell()

    def failed(self, error: SlabstreamError) -> None:
        self.end.set_exception(error)
        self.changed.tell()


def _tell(callback: Callable[[Any], None], value: Any) -> None:
    try:
        callback(value)
    except Exception:  # the user's; the connection goes on
        _log.exception("a callback of a frame failed")


class Frame:
    """Made by submit(). Like a concurrent.futures.Future; any thread. With asyncio, `await frame` is the picture, and
    `async for image in frame` has what previews() has. If whoever waits is interrupted, by Ctrl-C or as a task that is cancelled, so is the
    frame."""

    def __init__(self, connection: Connection, draft: Draft, deadline: float, on_progress: Callable[[Progress], None] | None = None,
                 on_preview: Callable[[Image], None] | None = None):
        self._connection, self._deadline = connection, deadline
        self._waiting = _Waiting(draft, on_progress, on_preview)
        self._number = connection.number()
        self._sent = False

    def _send(self) -> None:
        """Asks for it, unless that is done. Until then there is nothing that an interrupt may leave behind at the service."""
        if not self._sent:
            self._sent = True
            self._connection.submit(self._number, self._waiting.draft.frame, self._deadline, self._waiting)

    def result(self, timeout: float | None = None) -> Image:
        """The picture. Raises why there is none; DeadlineExceeded, which is a TimeoutError, if it is not there after `timeout` seconds."""
        return run(picture_of(self, BLOCKING, timeout))

    def __await__(self) -> Generator[Any, None, Image]:
        return picture_of(self, ASYNCIO).__await__()

    def exception(self, timeout: float | None = None) -> SlabstreamError | None:
        """Why there is no picture, or None. Waits as result() does."""
        run(self._until_done(BLOCKING, timeout))
        error = self._waiting.end.exception()
        assert error is None or isinstance(error, SlabstreamError)
        return error

    async def _until_done(self, front: Front, timeout: float | None = None) -> None:
        with self._cancelled_if_interrupted():
            self._send()
            done = await front.wait(self._waiting.end, timeout)
        if not done:
            raise DeadlineExceeded(f"the frame is not finished after {timeout:g} s")

    @contextlib.contextmanager
    def _cancelled_if_interrupted(self) -> Iterator[None]:
        if not self.done():
            self._connection.check_process()
        try:
            yield
        except BaseException:
            self.cancel()
            raise

    def done(self) -> bool:
        return self._waiting.end.done()

    def cancel(self) -> None:
        """Asks the service to give the frame up: result() then raises Cancelled, unless the picture is finished before."""
        if not self.done():
            self._connection.cancel(self._number)

    def add_done_callback(self, function: Callable[[Frame], None]) -> None:
        """Called once, with this frame, on the connection's thread: it must not wait for anything of the service."""
        self._waiting.end.add_done_callback(lambda _: function(self))

    @property
    def future(self) -> concurrent.futures.Future[Image]:
        """For concurrent.futures.wait. Its cancel() does nothing here: use Frame's."""
        return self._waiting.end

    @property
    def progress(self) -> Progress | None:
        """As it was told last; None: nothing yet."""
        return self._waiting.progress

    def previews(self) -> Iterator[Image]:
        """Previews while they come, then the picture: always the newest, each once. Needs submit(previews=True)."""
        return each(self._shown(BLOCKING))

    def __aiter__(self) -> AsyncIterator[Image]:
        return self._shown(ASYNCIO)

    async def _shown(self, front: Front) -> AsyncGenerator[Image, None]:
        seen: Image | None = None
        while True:
            with self._cancelled_if_interrupted():
                await self._waiting.changed.until(front, lambda: self.done() or self._waiting.preview is not seen)
            if self.done():
                yield self._waiting.end.result()
                return
            seen = self._waiting.preview
            assert seen is not None
            yield seen

    def __repr__(self) -> str:
        return f"<slabstream.Frame of '{self._waiting.draft.frame.dataset}', {'done' if self.done() else 'open'}>"


async def picture_of(frame: Frame, front: Front, timeout: float | None = None) -> Image:
    """As Frame.result(), but waits as `front` has it."""
    await frame._until_done(front, timeout)
    return frame.future.result()
