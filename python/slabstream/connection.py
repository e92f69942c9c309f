"""A connection to a service: a thread that owns the socket and runs Requests. Everybody else's calls are handed to it."""
from __future__ import annotations

import concurrent.futures
import contextlib
import functools
import math
import os
import queue
import secrets
import struct
import threading
import time
import weakref
from typing import Any, Callable, Iterator

import zmq

from . import schema
from .address import Address
from .errors import InvalidArgument, Unavailable
from .requests import MOST_PART_BYTES, Observer, Requests
from .shapes import Shape
from .waiting import Changes, Front

CONNECT_SECONDS = 4.0
ANSWER_SECONDS = 5.0

_MOST_MESSAGES = 4096  # queued, each way
_MOST_FRAME_BYTES = 2 << 30
_BATCH = 256  # messages that are read before anything else is done


def _open_socket(context: zmq.Context[Any], address: Address) -> zmq.Socket[Any]:
    """As common/transport/socket.cpp has it: reconnects every 100 ms, and notices within 3 s that a tcp connection is cut."""
    socket: zmq.Socket[Any] = context.socket(zmq.DEALER)
    for option, value in (
        (zmq.SNDHWM, _MOST_MESSAGES),
        (zmq.RCVHWM, _MOST_MESSAGES),
        (zmq.LINGER, 500),
        (zmq.HANDSHAKE_IVL, 5000),
        (zmq.MAXMSGSIZE, _MOST_FRAME_BYTES),
        (zmq.TCP_MAXRT, 3000),
        (zmq.TCP_KEEPALIVE, 1),
        (zmq.TCP_KEEPALIVE_IDLE, 2),
        (zmq.TCP_KEEPALIVE_INTVL, 1),
        (zmq.CONNECT_TIMEOUT, 2000),
    ):
        socket.setsockopt(option, value)
    if address.endpoint.startswith("tcp://["):
        socket.setsockopt(zmq.IPV6, 1)
    if address.keys is not None and address.endpoint.startswith("tcp://"):
        if not zmq.has("curve"):
            raise InvalidArgument("this ZeroMQ was built without CURVE, which services with keys need")
        socket.curve_serverkey = address.keys.server.encode()
        socket.curve_publickey = address.keys.public.encode()
        socket.curve_secretkey = address.keys.secret.encode()
    return socket


def _milliseconds_until(due: float) -> int | None:
    return None if due == math.inf else math.ceil(1000 * max(due - time.monotonic(), 0.0))


class _Loop:
    """What the thread has. It does not refer to the Connection, so that an unused one is closed."""

    def __init__(self, address: Address):
        self.endpoint = address.endpoint
        self.context: zmq.Context[Any] = zmq.Context()
        try:
            self.socket = _open_socket(self.context, address)
            self.monitor = self.socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_FAILED_AUTH)
            self.socket.connect(address.endpoint)
        except BaseException:
            self.context.destroy(linger=0)
            raise
        self.requests = Requests(address.endpoint, self._send)
        self.calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self.wake_read, self.wake_write = os.pipe()
        os.set_blocking(self.wake_write, False)
        self.ends = False
        self.lock = threading.Lock()  # of `ends` and the pipe's life
        self.process = os.getpid()
        self.thread = threading.Thread(target=self._run, name="slabstream", daemon=True)
        self.thread.start()

    def call(self, function: Callable[[], None]) -> None:
        """Has the thread run `function`."""
        self.check_process()  # before the lock, which a thread of the parent may hold in a forked child for ever
        with self.lock:
            if self.ends:
                raise Unavailable(f"the connection to the service at {self.endpoint} is closed")
            self.calls.put(function)
            self._wake()

    def call_later(self, function: Callable[[], None]) -> None:
        """Has the thread run `function` when it is awake, if it ever is. Destructors may call this at any time."""
        self.calls.put(function)

    def check_process(self) -> None:
        """Unavailable: in a forked child, which has no thread that would answer."""
        if os.getpid() != self.process:
            raise Unavailable(f"process {os.getpid()} was forked, and the connection to the service at {self.endpoint} is that of process "
                              f"{self.process}: connect in each process")

    def stop(self) -> None:
        if os.getpid() != self.process:
            return  # a forked child has neither the thread nor a say
        with self.lock:
            if self.ends:
                return
            self.ends = True
            self._wake()
        if threading.current_thread() is not self.thread:
            self.thread.join()

    def _wake(self) -> None:
        try:
            os.write(self.wake_write, b"!")
        except BlockingIOError:
            pass  # it is full of calls to wake up

    def _send(self, envelope: Any, payload: Any = None) -> None:
        header = envelope.SerializeToString()
        try:
            self.socket.send_multipart([header] if payload is None else [header, payload], zmq.NOBLOCK)
        except zmq.Again:
            pass  # as if it was lost: pings notice, and requests are submitted again

    def _run(self) -> None:
        poller = zmq.Poller()
        poller.register(self.socket, zmq.POLLIN)
        poller.register(self.monitor, zmq.POLLIN)
        poller.register(self.wake_read, zmq.POLLIN)
        try:
            while not self.ends:
                # What has come is read before silence is judged: this thread may have been busy elsewhere for long.
                busy = self._read()
                due = self.requests.tick(time.monotonic())
                for source, _ in poller.poll(0 if busy else _milliseconds_until(due)):
                    if isinstance(source, int):
                        os.read(self.wake_read, 4096)
                    elif source is self.monitor:
                        self._hear_monitor()
                self._run_calls()
        finally:
            with self.lock:
                self.ends = True
            self._run_calls()  # nobody waits for ever
            self.requests.close()
            self.socket.disable_monitor()
            self.context.destroy(linger=500)
            with self.lock:
                os.close(self.wake_read)
                os.close(self.wake_write)

    def _run_calls(self) -> None:
        while True:
            try:
                function = self.calls.get_nowait()
            except queue.Empty:
                return
            function()

    def _read(self) -> bool:
        """Whether there may be more."""
        for _ in range(_BATCH):
            try:
                parts = self.socket.recv_multipart(zmq.NOBLOCK, copy=False)
            except zmq.Again:
                return False
            self.requests.receive([part.buffer for part in parts], time.monotonic())
        return True

    def _hear_monitor(self) -> None:
        event, _ = struct.unpack("=hi", self.monitor.recv_multipart()[0])  # pyzmq's own parser imports asyncio
        if event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:  # ZeroMQ does not try again
            self.requests.fail_all(f"the service at {self.endpoint} refuses the key: it was revoked or is another's", for_good=True)


class SentShape:
    """A shape that is a dataset of the service, as long as this object lives."""

    def __init__(self, loop: _Loop, name: str, nonce: int):
        self.name = name
        self.is_there = functools.partial(loop.requests.has_file, nonce)
        weakref.finalize(self, loop.call_later, functools.partial(loop.requests.drop_file, nonce)).atexit = False


class Connection:
    """Any thread. Whoever waits does so as `front` has it."""

    def __init__(self, address: Address, front: Front):
        self.address, self.endpoint, self.front = address, address.endpoint, front
        try:
            self._loop = _Loop(address)
        except zmq.ZMQError as error:
            raise Unavailable(f'endpoint "{address.endpoint}": {error.strerror}') from None
        self.close = weakref.finalize(self, self._loop.stop)
        self._shapes: weakref.WeakKeyDictionary[Shape, SentShape] = weakref.WeakKeyDictionary()

    async def greet(self, timeout: float) -> None:
        """Unavailable: nobody answers within `timeout` seconds, or the service refuses the key. The connection is closed then."""
        try:
            await self.ask("client_ping", schema.ClientPing(), timeout)
        except BaseException:
            await self.front.do(self.close)
            raise

    def check_process(self) -> None:
        """Unavailable: in a forked child."""
        self._loop.check_process()

    def number(self) -> int:
        """Of a request that is made next."""
        return next(self._loop.requests.numbers)

    def submit(self, number: int, frame: Any, deadline_seconds: float, observer: Observer) -> None:
        self._loop.call(lambda: self._loop.requests.submit(number, frame, deadline_seconds, observer, time.monotonic()))

    def cancel(self, number: int) -> None:
        self._loop.call(lambda: self._loop.requests.cancel(number))

    async def upload(self, order: Any, parts: Iterator[memoryview]) -> Any:
        """Sends a volume: an AddVolume, then its bytes in parts of at most MOST_PART_BYTES, which are asked for as the service takes them.
        The DataReply."""
        changes = Changes()
        allowed, sent = 0, 0

        def credited(most: int) -> None:
            nonlocal allowed
            allowed = most
            changes.tell()

        with self._asked("add_volume", order, credited) as (nonce, answer):
            answer.add_done_callback(lambda _: changes.tell())
            while (part := await self.front.do(lambda: next(parts, None))) is not None:
                end = sent + part.nbytes
                await changes.until(self.front, lambda: answer.done() or allowed >= end)
                if answer.done():
                    break
                self._loop.call(functools.partial(self._loop.requests.send_part, nonce, sent, part))
                sent = end
            await self.front.wait(answer)
            return answer.result()

    async def send_shape(self, shape: Shape) -> SentShape:
        """Sends it, unless it has been sent and is still there."""
        sent = self._shapes.get(shape)
        if sent is None or not sent.is_there():
            name, content = f"{shape.kind}-{secrets.token_hex(4)}", memoryview(shape._file)
            order = schema.AddVolume(name=name, file=schema.SentFile(name=f"{shape.kind}.vtk", bytes=content.nbytes))
            parts = (content[begin : begin + MOST_PART_BYTES] for begin in range(0, content.nbytes, MOST_PART_BYTES))
            sent = self._shapes[shape] = SentShape(self._loop, name, (await self.upload(order, parts)).nonce)
        return sent

    async def ask(self, kind: str, message: Any, timeout: float = ANSWER_SECONDS) -> Any:
        """The answer to a question or an order, or the service's refusal as an exception."""
        with self._asked(kind, message) as (_, answer):
            if not await self.front.wait(answer, timeout):
                raise Unavailable(f"no service answers at {self.endpoint} within {round(1000 * timeout)} ms")
            return answer.result()

    @contextlib.contextmanager
    def _asked(self, kind: str, message: Any, credited: Callable[[int], None] | None = None,
               ) -> Iterator[tuple[int, concurrent.futures.Future[Any]]]:
        """A question or an order: its number, and its answer. After the block nobody waits for it: the time was over, or whoever waited was
        interrupted."""
        answer: concurrent.futures.Future[Any] = concurrent.futures.Future()
        requests, nonce = self._loop.requests, self.number()
        try:
            self._loop.call(lambda: requests.ask(nonce, kind, message, answer, time.monotonic(), credited))
            yield nonce, answer
        finally:
            if not answer.done():
                with contextlib.suppress(Unavailable):  # closed
                    self._loop.call(lambda: requests.forget(nonce))
