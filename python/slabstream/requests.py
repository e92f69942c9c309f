"""The client's side of the client plane (docs/wire.md, section 7): which requests are open, what to send, and what an answer means.

Pure: no sockets, threads or clocks. `now` is in seconds, of any clock that does not go back.
"""
from __future__ import annotations

import concurrent.futures
import dataclasses
import itertools
import logging
import math
from typing import Any, Callable, Protocol

from google.protobuf.message import DecodeError

from . import schema
from .errors import Cancelled, DeadlineExceeded, ResourceExhausted, SlabstreamError, Unavailable, error_of

PING_SECONDS = 1.0     # between pings while requests are open
SILENCE_SECONDS = 5.0  # without an answer to a ping, the service counts as gone
MOST_OPEN = 256
MOST_DEADLINE_SECONDS = 86400.0
_MOST_RESUBMITS = 3    # before it fails
_TELL_BYTES = 1 << 20  # of payloads, until the next ping tells of them

MOST_PART_BYTES = 1 << 19  # of a volume that is sent

_log = logging.getLogger("slabstream")


class Observer(Protocol):
    """Whoever waits for a request. Called until replied() with the picture, or failed()."""

    def progressed(self, progress: Any) -> None: ...
    def replied(self, reply: Any, payload: memoryview) -> None: ...
    def failed(self, error: SlabstreamError) -> None: ...


@dataclasses.dataclass
class _Open:
    message: Any  # SubmitFrame
    deadline: float
    observer: Observer
    resubmits: int = 0
    cancelled: bool = False  # by the caller; the service has not answered yet


@dataclasses.dataclass
class _Question:
    answer: concurrent.futures.Future[Any]          # the reply's message
    credited: Callable[[int], None] | None = None   # of a volume that is sent: told how many bytes may be sent in all
    keeps: bool = False                             # an AddVolume of a file, which stays as long as this client pings
    again: Any = None                               # the message, by its kind, if it may be sent twice
    pinged: bool = True                             # fails if the service does not answer pings; False: a ping of its own
    resubmits: int = 0


class Requests:
    def __init__(self, endpoint: str, send: Callable[..., None]):
        """`send` takes an Envelope and, of some, a payload."""
        self._endpoint = endpoint
        self._send = send
        self._open: dict[int, _Open] = {}
        self.numbers = itertools.count(1)  # of requests and nonces; any thread may take the next one
        self._questions: dict[int, _Question] = {}  # and orders, by nonce
        self._files: set[int] = set()  # nonces of those that the service has of this client
        self._pinged: dict[int, list[int]] = {}  # requests and nonces of each unanswered ping, by nonce
        self._received_bytes = self._told_bytes = 0
        self._next_ping = 0.0
        self._unanswered_since: float | None = None  # time of the first ping since the last message
        self._gone: str = ""  # why nothing more will be answered

    def submit(self, request: int, frame: Any, deadline_seconds: float, observer: Observer, now: float) -> None:
        """Opens a request of this number. The deadline counts from its arrival at the service."""
        seconds = min(max(deadline_seconds, 0.001), MOST_DEADLINE_SECONDS)
        message = schema.SubmitFrame(request=request, deadline_ms=int(seconds * 1000), frame=frame)
        if self._gone:
            observer.failed(Unavailable(self._gone))
        elif len(self._open) >= MOST_OPEN:
            observer.failed(ResourceExhausted(f"at most {MOST_OPEN} requests may be open at once"))
        else:
            self._begin_pings(now)
            self._open[request] = _Open(message, now + seconds, observer)
            self._send_message(submit_frame=message)

    def cancel(self, request: int) -> None:
        if request in self._open:
            self._open[request].cancelled = True
            self._send_message(cancel_frame=schema.CancelFrame(request=request))

    def ask(self, nonce: int, kind: str, message: Any, answer: concurrent.futures.Future[Any], now: float,
            credited: Callable[[int], None] | None = None) -> None:
        """Sends a question or an order. The answer is the reply's message. `credited`: of an AddVolume, whose bytes follow."""
        message.nonce = nonce
        if self._gone:
            answer.set_exception(Unavailable(self._gone))
            return
        pinged = kind != "client_ping"
        if pinged:
            self._begin_pings(now)
        changes = (kind == "add_volume" or kind == "data_order" and message.action != schema.DATA_ACTION_LIST
                   or kind == "steer_dataset" and len(message.values) > 0)
        keeps = kind == "add_volume" and message.HasField("file")
        self._questions[nonce] = _Question(answer, credited, keeps, None if changes else {kind: message}, pinged)
        self._send_message(**{kind: message})

    def forget(self, nonce: int) -> None:
        """Nobody waits for that answer now. What was sent of a volume is dropped."""
        forgotten = self._questions.pop(nonce, None)
        if forgotten is not None and forgotten.credited is not None:
            self._send_message(drop_volume=schema.DropVolume(nonce=nonce))

    def has_file(self, nonce: int) -> bool:
        """Whether the file of an AddVolume is still at the service, as far as is known. Any thread."""
        return nonce in self._files

    def drop_file(self, nonce: int) -> None:
        if nonce in self._files:
            self._files.remove(nonce)
            self._send_message(drop_volume=schema.DropVolume(nonce=nonce))

    def send_part(self, nonce: int, begin: int, part: memoryview) -> None:
        """Of the volume of an AddVolume."""
        if nonce in self._questions:
            message = schema.VolumePart(nonce=nonce, begin=begin, bytes=part.nbytes)
            self._send(schema.Envelope(version=schema.WIRE_VERSION, volume_part=message), part)

    def receive(self, parts: list[Any], now: float) -> None:
        """A message of one or two frames, as bytes or memoryviews."""
        payload = memoryview(parts[1]) if len(parts) > 1 else memoryview(b"")
        try:
            envelope = schema.Envelope.FromString(bytes(parts[0]))
        except DecodeError:
            envelope = schema.Envelope()
        if envelope.version not in (0, schema.WIRE_VERSION):
            other = f"speaks version {envelope.version} of the wire protocol, this package version {schema.WIRE_VERSION}"
            self.fail_all(f"the service at {self._endpoint} {other}: both must be of the same release", for_good=True)
            return
        kind = envelope.WhichOneof("message")
        expected = sum(share.runs.encoded_bytes for share in envelope.frame_reply.shares) if kind == "frame_reply" else 0
        if len(parts) > 2 or envelope.version != schema.WIRE_VERSION or kind is None or len(payload) != expected:
            _log.warning("dropped a message that is not as docs/wire.md says: %s with a payload of %d bytes", kind, len(payload))
            return
        message = getattr(envelope, kind)
        self._unanswered_since = None
        self._received_bytes += len(payload)
        if kind == "frame_progress":
            if message.request in self._open:
                self._open[message.request].observer.progressed(message)
        elif kind == "frame_reply":
            self._replied(message, payload)
        elif kind == "frame_failed":
            self._end(message.request, error_of(message.status.code, message.status.message))
        elif kind == "volume_credit":
            upload = self._questions.get(message.nonce)
            if upload is not None and upload.credited is not None:
                upload.credited(message.allowed)
        elif "nonce" in message.DESCRIPTOR.fields_by_name:
            self._answered(kind, message, now)
        else:
            _log.warning("dropped %s, which services do not send to clients", kind)
        if self._received_bytes - self._told_bytes >= _TELL_BYTES:
            self._ping(now)  # else the service takes this client for one that does not read

    def tick(self, now: float) -> float:
        """Pings if it is time, and fails everything if the service is silent. Returns when to call it again."""
        if not self._pings():
            self._unanswered_since = None
            return math.inf
        if self._unanswered_since is not None and now - self._unanswered_since >= SILENCE_SECONDS:
            self.fail_all(f"the service at {self._endpoint} has not answered for {round(1000 * (now - self._unanswered_since))} ms")
            return math.inf
        if now >= self._next_ping:
            self._ping(now)
        if self._unanswered_since is None:
            return self._next_ping
        return min(self._next_ping, self._unanswered_since + SILENCE_SECONDS)

    def fail_all(self, why: str, for_good: bool = False) -> None:
        """Ends everything that is open, and if `for_good` everything that comes later."""
        if for_good:
            self._gone = why
        for request in list(self._open):
            self._end(request, Unavailable(why))
        for nonce in [nonce for nonce, question in self._questions.items() if for_good or question.pinged]:
            self._end(nonce, Unavailable(why))
        for nonce in list(self._files):
            self.drop_file(nonce)
        self._pinged.clear()
        self._unanswered_since = None

    def _pings(self) -> bool:
        """Whether anybody waits, or the service keeps anything as long as this client pings."""
        return bool(self._open or self._files) or any(question.pinged for question in self._questions.values())

    def _begin_pings(self, now: float) -> None:
        if not self._pings():
            self._next_ping = now + PING_SECONDS

    def close(self) -> None:
        """Cancels what is open."""
        for request in list(self._open):
            self._send_message(cancel_frame=schema.CancelFrame(request=request))
            self._end(request, Cancelled("the connection to the service was closed"))
        self.fail_all("the connection to the service was closed", for_good=True)

    def _send_message(self, **message: Any) -> None:
        self._send(schema.Envelope(version=schema.WIRE_VERSION, **message))

    def _end(self, request: int, error: SlabstreamError) -> None:
        if request in self._open:
            self._open.pop(request).observer.failed(error)
        elif request in self._questions:
            self._questions.pop(request).answer.set_exception(error)

    def _replied(self, reply: Any, payload: memoryview) -> None:
        found = self._open.get(reply.request)
        if found is None:
            return  # cancelled, or a duplicate
        if reply.groups_done == reply.group_count:
            del self._open[reply.request]
        try:
            found.observer.replied(reply, payload)
        except SlabstreamError as error:  # whoever answers at the endpoint may send anything
            self._open.pop(reply.request, None)
            found.observer.failed(error)

    def _answered(self, kind: str, message: Any, now: float) -> None:
        question = self._questions.pop(message.nonce, None)
        if question is None:
            if kind == "client_pong":
                self._ponged(message, now)
        elif kind == "order_refused":
            question.answer.set_exception(error_of(message.status.code, message.status.message))
        else:
            if question.keeps:
                self._files.add(message.nonce)
            question.answer.set_result(message)

    def _ping(self, now: float) -> None:
        asked = [*(nonce for nonce, question in self._questions.items() if question.pinged), *self._files][:MOST_OPEN]
        ping = schema.ClientPing(nonce=next(self.numbers), received_bytes=self._received_bytes, open=list(self._open), asked=asked)
        self._told_bytes = self._received_bytes
        self._pinged[ping.nonce] = [*ping.open, *asked]
        self._send_message(client_ping=ping)
        if self._unanswered_since is None:
            self._unanswered_since = now
        self._next_ping = now + PING_SECONDS

    def _ponged(self, pong: Any, now: float) -> None:
        if pong.nonce not in self._pinged:
            return
        asked = self._pinged[pong.nonce]
        self._pinged.clear()  # later ones do not ask about what is sent again now
        self._files -= set(pong.lost)
        known = {*pong.known, *self._questions} - set(pong.lost)
        for number in asked:
            state = self._open.get(number) or self._questions.get(number)
            if state is not None and number not in known:
                self._submit_again(number, state, now)

    def _submit_again(self, number: int, lost: _Open | _Question, now: float) -> None:
        """The service was restarted and lost the request or the question, or its connection broke. The deadline is still that of the first time."""
        where = f"the service at {self._endpoint}"
        left_ms = int((lost.deadline - now) * 1000) if isinstance(lost, _Open) else 1
        lost.resubmits += 1
        if isinstance(lost, _Open) and lost.cancelled:
            self._end(number, Cancelled("the client cancelled the frame"))
        elif left_ms < 1:
            self._end(number, DeadlineExceeded(f"{where} lost the request, and its time is over"))
        elif isinstance(lost, _Question) and lost.again is None:
            what = "the part of the volume that was sent is lost" if lost.credited else "the order may have been carried out or not"
            self._end(number, Unavailable(f"{where} was restarted, or its connection broke: {what}"))
        elif lost.resubmits > _MOST_RESUBMITS:
            self._end(number, Unavailable(f"{where} lost the request {_MOST_RESUBMITS + 1} times"))
        elif isinstance(lost, _Question):
            self._send_message(**lost.again)
        else:
            again = schema.SubmitFrame()
            again.CopyFrom(lost.message)
            again.deadline_ms = left_ms
            self._send_message(submit_frame=again)
