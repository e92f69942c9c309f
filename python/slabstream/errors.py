"""What goes wrong, as exceptions that carry the service's own sentence.

All are SlabstreamError. The class says what kind of failure it is (StatusCode of proto/slabstream/v1/types.proto); each is also the exception
of Python's own that fits, so that `except ValueError` or `except TimeoutError` work as usual.
"""
from __future__ import annotations

import concurrent.futures
import sys
import warnings

from .options import in_keywords


class SlabstreamError(Exception):
    """Any failure of this package. Its text is one line."""


class SlabstreamWarning(UserWarning):
    """What a picture does not show as one may expect. Its text is one line."""


def warn(text: str) -> None:
    """A SlabstreamWarning at the line of the caller's that led here."""
    level, frame = 1, sys._getframe(0)
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, SlabstreamWarning, stacklevel=level)


class InvalidArgument(SlabstreamError, ValueError):
    """A value, name or combination that is not allowed. The text names it, and the limit."""


class UnknownOption(InvalidArgument, TypeError):
    """A keyword that is no option."""


class NotFound(SlabstreamError, LookupError):
    """No such dataset, file or program."""


class Unavailable(SlabstreamError, ConnectionError):
    """The service does not answer, refuses the key, or has gone."""


class ResourceExhausted(SlabstreamError):
    """More memory, or more open requests, than the service has or allows."""


class DataLoss(SlabstreamError):
    """A damaged file or message."""


class Cancelled(SlabstreamError, concurrent.futures.CancelledError):
    """The frame was cancelled."""


class DeadlineExceeded(SlabstreamError, TimeoutError):
    """The frame was not finished within its deadline, or result() waited long enough."""


class Internal(SlabstreamError):
    """A mistake of the service's or of this package's."""


_KINDS = (Internal, InvalidArgument, NotFound, Unavailable, ResourceExhausted, DataLoss, Cancelled, DeadlineExceeded, Internal)  # by code


def code_of(error: BaseException) -> int:
    """The code of a Status that says what a caller's function has raised."""
    return _KINDS.index(type(error), 1) if type(error) in _KINDS else _KINDS.index(InvalidArgument)


def error_of(code: int, message: str) -> SlabstreamError:
    """The exception for a Status of the wire. The service's sentence names fields and options of the command line: here they are keywords."""
    return (_KINDS[code] if 0 <= code < len(_KINDS) else Internal)(in_keywords(message))
