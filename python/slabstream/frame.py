"""Frame: a picture that has been asked for."""
from __future__ import annotations

import concurrent.futures
import dataclasses
import logging
import threading
import time
from typing import Any, Callable, Iterator

from . import schema
from .annotations import key_of
from .connection import Connection
from .drafts import Draft
from .errors import DataLoss, DeadlineExceeded, SlabstreamError
from .image import Image, compose, geometry_of, statistics_of
from .runs import read_runs

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
        self.changed = threading.Condition()
        self.progress: Progress | None = None
        self.preview: Image | None = None
        self.submitted = time.monotonic()

    def progressed(self, progress: Any) -> None:
        with self.changed:
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
        rgba, depth = compose(read_runs(reply.shares[0].runs, payload, width, height), width, height, self.draft.format)
        preview = reply.groups_done != reply.group_count
        format = dataclasses.replace(self.draft.format, key=key_of(reply.key))
        image = Image(rgba, depth, format=format, geometry=geometry_of(reply.geometry),
                      statistics=None if preview else statistics_of(reply.statistics, latency), preview=preview)
        if preview:
            with self.changed:
                self.preview = image
                self.changed.notify_all()
            if self.on_preview is not None:
                _tell(self.on_preview, image)
        else:
            self._finish(lambda: self.end.set_result(image))

    def failed(self, error: SlabstreamError) -> None:
        self._finish(lambda: self.end.set_exception(error))

    def _finish(self, finish: Callable[[], None]) -> None:
        finish()
        with self.changed:
            self.changed.notify_all()


def _tell(callback: Callable[[Any], None], value: Any) -> None:
    try:
        callback(value)
    except Exception:  # the user's; the connection goes on
        _log.exception("a callback of a frame failed")


class Frame:
    """Made by submit(). Like a concurrent.futures.Future; any thread."""

    def __init__(self, connection: Connection, draft: Draft, deadline: float, on_progress: Callable[[Progress], None] | None,
                 on_preview: Callable[[Image], None] | None):
        self._connection = connection
        self._waiting = _Waiting(draft, on_progress, on_preview)
        self._number = connection.submit(draft.frame, deadline, self._waiting)

    def result(self, timeout: float | None = None) -> Image:
        """The picture. Raises why there is none; DeadlineExceeded, which is a TimeoutError, if it is not there after `timeout` seconds."""
        error = self.exception(timeout)
        if error is not None:
            raise error
        return self._waiting.end.result()

    def exception(self, timeout: float | None = None) -> SlabstreamError | None:
        """Why there is no picture, or None. Waits as result() does."""
        try:
            error = self._waiting.end.exception(timeout)
        except concurrent.futures.TimeoutError:
            raise DeadlineExceeded(f"the frame is not finished after {timeout:g} s") from None
        assert error is None or isinstance(error, SlabstreamError)
        return error

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
        """For concurrent.futures.wait and asyncio.wrap_future. Its cancel() does nothing here: use Frame's."""
        return self._waiting.end

    @property
    def progress(self) -> Progress | None:
        """As it was told last; None: nothing yet."""
        return self._waiting.progress

    def previews(self) -> Iterator[Image]:
        """Previews while they come, then the picture: always the newest, each once. Needs submit(previews=True)."""
        seen: Image | None = None
        while True:
            with self._waiting.changed:
                self._waiting.changed.wait_for(lambda: self.done() or self._waiting.preview is not seen)
                newest = self._waiting.preview
            if self.done():
                yield self.result()
                return
            assert newest is not None
            yield newest
            seen = newest

    def __repr__(self) -> str:
        return f"<slabstream.Frame of '{self._waiting.draft.frame.dataset}', {'done' if self.done() else 'open'}>"
