"""How a request is waited for. Each is written once, as coroutines that wait through a `Front`: BLOCKING has a thread wait, for callers
without an event loop; ASYNCIO has a task wait, so that its loop goes on.
"""
from __future__ import annotations

import concurrent.futures
import threading
from typing import Any, AsyncGenerator, Awaitable, Callable, Iterator, Protocol, TypeVar

Result = TypeVar("Result")
_WAKE_SECONDS = 0.25  # a kernel of Jupyter notices that it is interrupted when its event loop wakes


class Front(Protocol):
    async def wait(self, future: concurrent.futures.Future[Any], timeout: float | None = None) -> bool:
        """Whether the future is done, after at most `timeout` seconds."""

    async def do(self, function: Callable[..., Result], *arguments: Any) -> Result:
        """Calls a function that may take long."""


class _Blocking:
    """Its coroutines never suspend, so run() and each() can run them wherever they are called, beside any event loop."""

    async def wait(self, future: concurrent.futures.Future[Any], timeout: float | None = None) -> bool:
        # Not concurrent.futures.wait(): a KeyboardInterrupt in it may leave the future locked, which the connection's thread then waits for.
        done = threading.Lock()
        done.acquire()
        future.add_done_callback(lambda _: done.release())
        done.acquire(timeout=-1 if timeout is None else max(timeout, 0))
        return future.done()

    async def do(self, function: Callable[..., Result], *arguments: Any) -> Result:
        return function(*arguments)


class _Asyncio:
    async def wait(self, future: concurrent.futures.Future[Any], timeout: float | None = None) -> bool:
        import asyncio  # which callers have imported, and others need not

        loop = asyncio.get_running_loop()
        done = loop.create_future()

        def tell(_: concurrent.futures.Future[Any]) -> None:
            try:
                loop.call_soon_threadsafe(lambda: None if done.done() else done.set_result(None))
            except RuntimeError:
                pass  # the loop was closed, so nobody waits

        future.add_done_callback(tell)
        due = None if timeout is None else loop.time() + timeout
        while not future.done() and (due is None or loop.time() < due):
            await asyncio.wait([done], timeout=_WAKE_SECONDS if due is None else min(_WAKE_SECONDS, due - loop.time()))
        return future.done()

    async def do(self, function: Callable[..., Result], *arguments: Any) -> Result:
        import asyncio

        return await asyncio.to_thread(function, *arguments)


BLOCKING: Front = _Blocking()
ASYNCIO: Front = _Asyncio()


def run(awaited: Awaitable[Result]) -> Result:
    """What a coroutine of the front BLOCKING returns."""
    try:
        next(awaited.__await__())
    except StopIteration as end:
        result: Result = end.value
        return result
    raise AssertionError("a coroutine of the blocking front was suspended")


def each(results: AsyncGenerator[Result, None]) -> Iterator[Result]:
    """What a generator of the front BLOCKING yields."""
    try:
        while True:
            try:
                result = run(results.__anext__())
            except StopAsyncIteration:
                return
            yield result
    finally:
        run(results.aclose())


class Changes:
    """Something that changes, such as what a frame has shown so far. Any thread tells, any front waits."""

    def __init__(self) -> None:
        self._next: concurrent.futures.Future[None] = concurrent.futures.Future()

    def tell(self) -> None:
        """For one thread at a time."""
        told, self._next = self._next, concurrent.futures.Future()
        told.set_result(None)

    async def until(self, front: Front, condition: Callable[[], bool]) -> None:
        while True:
            following = self._next  # before the condition is looked at, so that no change is missed
            if condition():
                return
            await front.wait(following)
