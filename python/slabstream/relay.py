"""What a widget's page asks over the notebook kernel's channel, handed on to the gateway beside the kernel; and the way back.

A page has this channel where it cannot reach the gateway itself. The messages are those of web/src/kernel_connection.ts:

    from the page                                          to the page
    {"ask": id, "method": ..., "path": ...}  [body]        {"answer": id, "status": 200, "type": "image/png"}  [body]
    {"cancel": id}                                         (no answer)
    {"open": id}                                           {"opened": id}, or {"closed": id, "reason": ...}
    {"send": id, "text": ..., "more": [text, ...]}         {"heard": id, "text": ...} or {"heard": id}  [picture]
    {"close": id}                                          {"closed": id, "reason": ...}
    {"alive": [id, ...]}                                   (no answer)

A stream is a WebSocket of docs/http.md; ids are numbers that a page chooses at random. The kernel's threads never wait: each request and each
stream has threads of its own. What waits for the page is bounded: a stream is read no further while the kernel has messages of it to send, and
the gateway sends at most 16 pictures that the page has not acknowledged.
"""
from __future__ import annotations

import asyncio
import contextlib
import contextvars
import http.client
import json
import queue
import socket
import threading
import time
from typing import Any, Callable, Sequence

import websockets.exceptions
import websockets.sync.client
import websockets.typing

from .errors import SlabstreamError
from .gateway import Gateway

_ANSWER_SECONDS = 150.0  # longer than the gateway's own limit, which says why
_OPEN_SECONDS = 10.0
_MOST_ASKS, _MOST_STREAMS = 64, 16  # under way
_MOST_TEXTS = 256   # of a stream, on their way to the gateway
_MOST_MESSAGES = 4  # of a stream, on their way to the page
_SILENT_SECONDS = 10.0  # that a stream's page may be, while the kernel is free
_GAP_SECONDS = 2.0       # between messages of the gateway; what is longer is a kernel that was busy
_LOOK_SECONDS = 5.0

Say = Callable[[dict[str, Any], Sequence[bytes]], None]


class _Here:
    """The thread that a page's message came on, which also sends the answers: the kernel's own, or one of several (subshells). Without an event
    loop, whichever thread has an answer sends it."""

    def __init__(self) -> None:
        self._context = contextvars.copy_context()  # by which kernels know whom they answer
        try:
            self._loop: asyncio.AbstractEventLoop | None = asyncio.get_running_loop()
        except RuntimeError:
            self._loop = None

    def call(self, function: Callable[[], None]) -> None:
        """Any thread."""
        if self._loop is None:
            function()
        elif not self.has_ended():
            self._loop.call_soon_threadsafe(function, context=self._context)

    def has_ended(self) -> bool:
        return self._loop is not None and (self._loop.is_closed() or not self._loop.is_running())


class _Ask:
    """A request under way, until its thread ends."""

    def __init__(self) -> None:
        self.connection: http.client.HTTPConnection | None = None
        self.wanted = True

    def cancel(self) -> None:
        self.wanted = False
        if self.connection is not None and self.connection.sock is not None:
            with contextlib.suppress(OSError):  # the answer has come
                self.connection.sock.shutdown(socket.SHUT_RDWR)


class Relay:
    """`gateway`: as gateway_of(), of one service. `say` sends a message to the pages. `restarted`: the gateway has another address now."""

    def __init__(self, gateway: Callable[[Gateway | None], Gateway], say: Say, restarted: Callable[[], None]):
        self._gateway, self.say, self._restarted = gateway, say, restarted
        self._asks: dict[int, _Ask] = {}
        self._streams: dict[int, _Stream] = {}

    def hear(self, message: dict[str, Any], buffers: Sequence[Any]) -> None:
        """A message of a page. What is none of the above is ignored."""
        if "ask" in message:
            self._ask(message["ask"], str(message.get("method", "GET")), str(message.get("path", "")), bytes(buffers[0]) if buffers else None)
        elif "cancel" in message:
            if message["cancel"] in self._asks:
                self._asks[message["cancel"]].cancel()
        elif "open" in message and message["open"] not in self._streams:
            if len(self._streams) < _MOST_STREAMS:
                self._streams[message["open"]] = _Stream(self, message["open"])
            else:
                self.say({"closed": message["open"], "reason": f"{_MOST_STREAMS} streams of this widget are open, no more are taken"}, [])
        elif "alive" in message:
            for each in message["alive"]:
                if each in self._streams:
                    self._streams[each].silent = 0.0
        elif "send" in message and message["send"] in self._streams:
            for text in (message.get("text", ""), *message.get("more", ())):
                self._streams[message["send"]].send(str(text))
        elif "close" in message and message["close"] in self._streams:
            self._streams[message["close"]].close("")

    def close(self) -> None:
        for stream in list(self._streams.values()):
            stream.close("the widget is closed")
        for ask in list(self._asks.values()):
            ask.cancel()

    def connected(self, here: _Here, connect: Callable[[Gateway], Any]) -> Any:
        """What `connect` makes of the gateway. One that is gone is started again."""
        gateway = self._gateway(None)
        try:
            return connect(gateway)
        except ConnectionRefusedError:
            gateway = self._gateway(gateway)
        here.call(self._restarted)
        return connect(gateway)

    # ---- requests

    def _ask(self, ask: int, method: str, path: str, body: bytes | None) -> None:
        if len(self._asks) >= _MOST_ASKS:
            self.say({"answer": ask, "status": 429, "type": "application/json"}, [_error(f"{_MOST_ASKS} requests are under way, no more are taken")])
        elif ask not in self._asks:
            asked = self._asks[ask] = _Ask()
            threading.Thread(target=self._fetch, args=(_Here(), ask, asked, method, path, body), name="slabstream ask", daemon=True).start()

    def _fetch(self, here: _Here, ask: int, asked: _Ask, method: str, path: str, body: bytes | None) -> None:
        def request(gateway: Gateway) -> http.client.HTTPConnection:
            asked.connection = connection = http.client.HTTPConnection(gateway.host, gateway.port, timeout=_ANSWER_SECONDS)
            connection.connect()
            if asked.wanted:  # else nobody has closed the connection
                connection.request(method, f"/api/v1/{path}", body, {"Authorization": f"Bearer {gateway.token}"})
            return connection

        try:
            response = self.connected(here, request).getresponse()
            status, kind, found = response.status, response.getheader("Content-Type", ""), response.read()
        except (OSError, ValueError, http.client.HTTPException, SlabstreamError) as error:
            status, kind, found = 503, "application/json", _error(str(error) or type(error).__name__)
        finally:
            if asked.connection is not None:
                asked.connection.close()
            del self._asks[ask]
        if asked.wanted:
            here.call(lambda: self.say({"answer": ask, "status": status, "type": kind}, [found]))

    def end(self, stream: int) -> None:
        self._streams.pop(stream, None)


def _error(text: str) -> bytes:
    return json.dumps({"error": text}).encode()


class _Stream:
    """A WebSocket to the gateway. One thread reads it, one writes to it."""

    def __init__(self, relay: Relay, number: int):
        self.silent = 0.0  # seconds since the page named it
        self._said_at = time.monotonic()
        self._relay, self._number, self._here = relay, number, _Here()
        self._texts: queue.Queue[str | None] = queue.Queue(_MOST_TEXTS)
        self._room = threading.Semaphore(_MOST_MESSAGES)
        self._reason: str | None = None  # why the page or the kernel has closed it
        threading.Thread(target=self._read, name="slabstream stream", daemon=True).start()

    def send(self, text: str | None) -> None:
        try:
            self._texts.put_nowait(text)
        except queue.Full:  # the gateway takes nothing; the writer looks at the reason
            self._reason = self._reason or f"{_MOST_TEXTS} messages wait for the gateway"

    def close(self, reason: str) -> None:
        """It ends soon after."""
        self._reason = reason
        self._room.release()
        self.send(None)

    def _read(self) -> None:
        try:
            with self._relay.connected(self._here, _open) as opened:
                threading.Thread(target=self._write, args=(opened,), name="slabstream stream out", daemon=True).start()
                self._tell({"opened": self._number})
                for message in opened:
                    text, picture = ({"text": message}, []) if isinstance(message, str) else ({}, [message])
                    self._tell({"heard": self._number, **text}, picture)
                    if self._reason is not None:
                        break
                reason = opened.close_reason or ""
        except Exception as error:  # no gateway, no connection, or a version of websockets that we do not know: the page shows why
            reason = (str(error) or type(error).__name__).splitlines()[0]
        self.send(None)
        self._relay.end(self._number)
        said = reason if self._reason is None else self._reason
        self._here.call(lambda: self._relay.say({"closed": self._number, "reason": said}, []))

    def _tell(self, message: dict[str, Any], buffers: Sequence[bytes] = ()) -> None:
        """Waits while the kernel has several messages to send: it may be busy."""
        while not self._room.acquire(timeout=_LOOK_SECONDS):
            if self._here.has_ended():
                raise ConnectionError("the page has gone")
        self._here.call(lambda: self._say(message, buffers))

    def _say(self, message: dict[str, Any], buffers: Sequence[bytes]) -> None:
        now = time.monotonic()
        self.silent += min(now - self._said_at, _GAP_SECONDS)
        self._said_at = now
        self._room.release()
        if self.silent > _SILENT_SECONDS:
            self.close("the page has gone")
        elif self._reason is None:
            self._relay.say(message, buffers)

    def _write(self, opened: websockets.sync.client.ClientConnection) -> None:
        try:
            while self._reason is None and (text := self._texts.get()) is not None:
                opened.send(text)
        except websockets.exceptions.ConnectionClosed:
            pass  # the reader says so
        opened.close()


def _open(gateway: Gateway) -> websockets.sync.client.ClientConnection:
    protocols = [websockets.typing.Subprotocol(name) for name in ("slabstream.view.v1", f"slabstream.token.{gateway.token}")]
    return websockets.sync.client.connect(f"ws://{gateway.host}:{gateway.port}/api/v1/view", subprotocols=protocols, compression=None,
                                          open_timeout=_OPEN_SECONDS, max_size=None, proxy=None)
