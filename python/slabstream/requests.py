"""The client's side of the client plane (docs/wire.md, section 7): which requests are open, what to send, and what an answer means.

Pure: no sockets, threads or clocks. `now` is in seconds, of any clock that does not go back.
"""
from __future__ import annotations

import concurrent.futures
import dataclasses
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
_UNKNOWN_PONGS = 2     # in a row, before a request is submitted again
_MOST_RESUBMITS = 3    # before it fails
_TELL_BYTES = 1 << 20  # of payloads, until the next ping tells of them

_ANSWERS = ("client_pong", "status_reply", "shut_down_reply", "keys_reply", "data_reply", "order_refused", "summary_reply",
            "sample_reply", "joint_histogram_reply", "pick_reply", "view_reply", "statistics_reply")
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
    unknown_pongs: int = 0  # in a row
    resubmits: int = 0
    cancelled: bool = False  # by the caller; the service has not answered yet


@dataclasses.dataclass
class _Upload:
    answer: concurrent.futures.Future[Any]  # DataReply
    credited: Callable[[int], None]         # told how many bytes may be sent in all
    epoch: int | None = None                # of the coordinator, once a pong has told it


class Requests:
    def __init__(self, endpoint: str, send: Callable[..., None]):
        """`send` takes an Envelope and, of some, a payload."""
        self._endpoint = endpoint
        self._send = send
        self._open: dict[int, _Open] = {}
        self._questions: dict[int, concurrent.futures.Future[Any]] = {}  # by nonce
        self._uploads: dict[int, _Upload] = {}  # by nonce
        self._pinged: dict[int, list[int]] = {}  # requests of each unanswered ping, by nonce
        self._last_request = self._last_nonce = 0
        self._received_bytes = self._told_bytes = 0
        self._next_ping = 0.0
        self._unanswered_since: float | None = None  # time of the first ping since the last message
        self._gone: str = ""  # why nothing more will be answered

    def submit(self, frame: Any, deadline_seconds: float, observer: Observer, now: float) -> int:
        """Opens a request and returns its number. The deadline counts from its arrival at the service."""
        self._last_request += 1
        request = self._last_request
        seconds = min(max(deadline_seconds, 0.001), MOST_DEADLINE_SECONDS)
        message = schema.SubmitFrame(request=request, deadline_ms=int(seconds * 1000), frame=frame)
        if self._gone:
            observer.failed(Unavailable(self._gone))
        elif len(self._open) >= MOST_OPEN:
            observer.failed(ResourceExhausted(f"at most {MOST_OPEN} requests may be open at once"))
        else:
            if not self._open and not self._uploads:
                self._next_ping = now + PING_SECONDS
            self._open[request] = _Open(message, now + seconds, observer)
            self._send_message(submit_frame=message)
        return request

    def cancel(self, request: int) -> None:
        if request in self._open:
            self._open[request].cancelled = True
            self._send_message(cancel_frame=schema.CancelFrame(request=request))

    def ask(self, kind: str, message: Any, answer: concurrent.futures.Future[Any]) -> int:
        """Sends a question or an order. The answer is the reply's message. Returns what forget() takes."""
        self._last_nonce += 1
        message.nonce = self._last_nonce
        if self._gone:
            answer.set_exception(Unavailable(self._gone))
        else:
            self._questions[self._last_nonce] = answer
            self._send_message(**{kind: message})
        return self._last_nonce

    def forget(self, nonce: int) -> None:
        """Nobody waits for that answer now."""
        self._questions.pop(nonce, None)

    def begin_upload(self, order: Any, answer: concurrent.futures.Future[Any], credited: Callable[[int], None], now: float) -> int:
        """Sends an AddVolume. Returns what send_part() and drop_upload() take."""
        self._last_nonce += 1
        order.nonce = self._last_nonce
        if self._gone:
            answer.set_exception(Unavailable(self._gone))
        else:
            if not self._open and not self._uploads:
                self._next_ping = now + PING_SECONDS
            self._uploads[self._last_nonce] = _Upload(answer, credited)
            self._send_message(add_volume=order)
        return self._last_nonce

    def send_part(self, nonce: int, begin: int, part: memoryview) -> None:
        if nonce in self._uploads:
            message = schema.VolumePart(nonce=nonce, begin=begin, bytes=part.nbytes)
            self._send(schema.Envelope(version=schema.WIRE_VERSION, volume_part=message), part)

    def drop_upload(self, nonce: int) -> None:
        if self._uploads.pop(nonce, None) is not None:
            self._send_message(drop_volume=schema.DropVolume(nonce=nonce))

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
            if message.nonce in self._uploads:
                self._uploads[message.nonce].credited(message.allowed)
        elif kind in _ANSWERS:
            self._answered(kind, message, now)
        else:
            _log.warning("dropped %s, which services do not send to clients", kind)
        if self._received_bytes - self._told_bytes >= _TELL_BYTES:
            self._ping(now)  # else the service takes this client for one that does not read

    def tick(self, now: float) -> float:
        """Pings if it is time, and fails everything if the service is silent. Returns when to call it again."""
        if not self._open and not self._uploads:
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
            for answer in self._questions.values():
                answer.set_exception(Unavailable(why))
            self._questions.clear()
        for request in list(self._open):
            self._end(request, Unavailable(why))
        self._fail_uploads(why)
        self._pinged.clear()
        self._unanswered_since = None

    def _fail_uploads(self, why: str, unless_epoch: int | None = None) -> None:
        for nonce, upload in list(self._uploads.items()):
            if unless_epoch is None or upload.epoch not in (None, unless_epoch):
                del self._uploads[nonce]
                upload.answer.set_exception(Unavailable(why))
            else:
                upload.epoch = unless_epoch

    def close(self) -> None:
        """Cancels what is open."""
        for request in list(self._open):
            self._send_message(cancel_frame=schema.CancelFrame(request=request))
            self._end(request, Cancelled("the connection to the service was closed"))
        self.fail_all("the connection to the service was closed", for_good=True)

    def _send_message(self, **message: Any) -> None:
        self._send(schema.Envelope(version=schema.WIRE_VERSION, **message))

    def _end(self, request: int, error: SlabstreamError) -> None:
        ended = self._open.pop(request, None)
        if ended is not None:
            ended.observer.failed(error)

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
        upload = self._uploads.pop(message.nonce, None) if kind in ("data_reply", "order_refused") else None
        answer: concurrent.futures.Future[Any] | None
        answer = self._questions.pop(message.nonce, None) if upload is None else upload.answer
        if answer is None:
            if kind == "client_pong":
                self._ponged(message, now)
        elif kind == "order_refused":
            answer.set_exception(error_of(message.status.code, message.status.message))
        else:
            answer.set_result(message)

    def _ping(self, now: float) -> None:
        self._last_nonce += 1
        ping = schema.ClientPing(nonce=self._last_nonce, received_bytes=self._received_bytes, open=list(self._open))
        self._told_bytes = self._received_bytes
        self._pinged[ping.nonce] = list(ping.open)
        self._send_message(client_ping=ping)
        if self._unanswered_since is None:
            self._unanswered_since = now
        self._next_ping = now + PING_SECONDS

    def _ponged(self, pong: Any, now: float) -> None:
        if pong.nonce not in self._pinged:
            return
        asked = self._pinged[pong.nonce]
        self._fail_uploads(f"the service at {self._endpoint} was restarted, and the part of the volume that was sent is lost", pong.epoch)
        self._pinged = {nonce: requests for nonce, requests in self._pinged.items() if nonce > pong.nonce}
        known = set(pong.known)
        for request in asked:
            state = self._open.get(request)
            if state is None:
                continue
            state.unknown_pongs = 0 if request in known else state.unknown_pongs + 1
            if state.unknown_pongs >= _UNKNOWN_PONGS:
                state.unknown_pongs = 0
                self._submit_again(state, now)

    def _submit_again(self, lost: _Open, now: float) -> None:
        """The service was restarted and lost the request. The deadline is still that of the first time."""
        request = lost.message.request
        left_ms = int((lost.deadline - now) * 1000)
        if lost.cancelled:
            self._end(request, Cancelled("the client cancelled the frame"))
        elif left_ms < 1:
            self._end(request, DeadlineExceeded(f"the service at {self._endpoint} lost the request, and its time is over"))
        elif lost.resubmits < _MOST_RESUBMITS:
            lost.resubmits += 1
            again = schema.SubmitFrame()
            again.CopyFrom(lost.message)
            again.deadline_ms = left_ms
            self._send_message(submit_frame=again)
        else:
            self._end(request, Unavailable(f"the service at {self._endpoint} lost the request {_MOST_RESUBMITS + 1} times"))
