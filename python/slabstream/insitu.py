"""A field that this process computes and a service draws meanwhile: Owner, over the in situ interface of libslabstream."""
from __future__ import annotations

import contextlib
import ctypes
import functools
import os
from typing import Any, Callable, Iterator, Mapping, Sequence

import numpy
import numpy.typing

from .errors import InvalidArgument, NotFound, SlabstreamError, code_of, error_of
from .programs import find_library

Array = numpy.typing.NDArray[Any]
Box = Sequence[tuple[int, int]]  # (begin, end) along z, y and x


class _Maker(ctypes.Structure):
    """slabstream_insitu_maker"""

    MAKE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint64, ctypes.POINTER(ctypes.c_void_p),
                            ctypes.POINTER(ctypes.c_char), ctypes.c_uint32)
    DROP = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint64, ctypes.c_void_p)
    _fields_ = [("make", MAKE), ("drop", DROP), ("context", ctypes.c_void_p), ("most_bytes", ctypes.c_uint64)]


class _Field(ctypes.Structure):
    """slabstream_insitu_field"""

    _fields_ = [
        ("dataset", ctypes.c_char_p), ("samples", ctypes.c_char_p), ("size", ctypes.c_int32 * 3), ("spacing", ctypes.c_double * 3),
        ("origin", ctypes.c_double * 3), ("owner", ctypes.c_uint32), ("owners", ctypes.c_uint32), ("slots", ctypes.c_uint32),
        ("service", ctypes.c_char_p), ("fields", ctypes.c_char_p), ("field", ctypes.c_uint32),
    ]  # fmt: skip


@functools.cache
def _library() -> ctypes.CDLL:
    path = find_library()
    try:
        library = ctypes.CDLL(path)
        library.slabstream_insitu_error.restype = ctypes.c_char_p
    except (OSError, AttributeError) as error:
        raise NotFound(f"the library {path} cannot be loaded: {error}") from None
    return library


def _call(name: str, *arguments: Any) -> None:
    code: int = getattr(_library(), f"slabstream_insitu_{name}")(*arguments)
    if code != 0:
        raise error_of(code, _library().slabstream_insitu_error().decode(errors="replace"))


def _xyz(kind: Any, zyx: Sequence[Any], what: str) -> Any:
    if len(zyx) != 3:
        raise InvalidArgument(f"{what} {zyx!r} is not of three axes")
    return (kind * 3)(*reversed(zyx))


class Owner:
    """This process's part of a field, in memory that a service draws from while the process goes on.

        owner = ss.Owner("rho", (512, 512, 512), "float32", [((0, 512), (0, 512), (64 * rank, 64 * (rank + 1)))], owner=rank, owners=8)
        for step in range(1, steps):
            with owner.begin(step) as (rho,):   # numpy.ndarray, z, y, x
                advance(rho)

    `shape`, of the whole field, and boxes are along z, y, x. The boxes of all owners tile the field; none: this is the only owner, with one
    box. `strides`: for each box those of its array, as numpy has them, all positive; None: C order. `held`: for each box the voxels of its
    array, if that has ghosts, too: inside the field they have their owners' values. `parameters`: name, and (least, most, value), of numbers
    that whoever looks may change. `make`: boxes are made on demand, in all owners alike: when a picture needs the box with this number at
    this time, `make(box, time)` returns its array, on a thread of its own. At most `budget` bytes of arrays are kept, those that were asked
    for last, and one in any case; `publish(time)` begins a time. If `make` raises, pictures that need the box fail with its line, and
    with its class if that is a SlabstreamError, else as InvalidArgument. `service`: owner.json of a service with keys, or the endpoint of
    a service for workers; None: what $SLABSTREAM_OWNER_SERVICE names, else the service that `slabstream up` started last on this host.
    `fields`: the names of all fields of the dataset, if it has several, on one grid and of one type, without commas; `field`: the number of
    the one that this owner holds boxes of.

    The process goes on whether the service is there or not. For one thread at a time.
    """

    def __init__(self, dataset: str, shape: Sequence[int], dtype: numpy.typing.DTypeLike, boxes: Sequence[Box] | None = None, *,
                 held: Sequence[Box] | None = None, strides: Sequence[Sequence[int]] | None = None, owner: int = 0, owners: int = 1,
                 spacing: Sequence[float] = (1, 1, 1), origin: Sequence[float] = (0, 0, 0), slots: int = 3,
                 parameters: Mapping[str, tuple[float, float, float]] | None = None,
                 make: Callable[[int, int], Array] | None = None, budget: int = 0, service: str | None = None,
                 fields: Sequence[str] = (), field: int = 0):
        self.dtype = numpy.dtype(dtype).newbyteorder("=")
        self.waited = 0.0  # seconds, in the last begin() or publish()
        self._handle, self._process = ctypes.c_void_p(), os.getpid()
        self._maker: _Maker | None = None
        boxes = [[(0, side) for side in shape]] if boxes is None else boxes
        for what, given in (("held", held), ("strides", strides)):
            if given is not None and len(given) != len(boxes):
                raise InvalidArgument(f"{what} has {len(given)} boxes, must be {len(boxes)}")
        held = boxes if held is None else held
        self._held = [tuple(end - begin for begin, end in box) for box in held]
        if strides is None:
            item = self.dtype.itemsize
            strides = [(y * x * item, x * item, item) for _, y, x in self._held]
        self._strides = [tuple(steps) for steps in strides]
        last = [sum((side - 1) * step for side, step in zip(*each)) for each in zip(self._held, self._strides)]  # sample, in bytes
        self._memory = [ctypes.c_char * (byte + self.dtype.itemsize) for byte in last]  # types: they take longer to make than begin()
        self._kept: dict[int, Sequence[Array]] = {}  # by time: arrays that may still be read
        self._made: dict[tuple[int, int], Array] = {}  # by box and time: what make() has returned
        self._parameters = tuple(parameters or ())
        about = _Field(dataset.encode(), self.dtype.name.encode(), _xyz(ctypes.c_int32, shape, "shape"),
                       _xyz(ctypes.c_double, spacing, "spacing"), _xyz(ctypes.c_double, origin, "origin"), owner, owners, slots,
                       service.encode() if service else None, ",".join(fields).encode() or None, field)
        _call("open", ctypes.byref(self._handle), ctypes.byref(about))
        try:
            for owned, around, steps in zip(boxes, held, self._strides):
                ends = [_xyz(ctypes.c_int32, [pair[i] for pair in box], "box") for box in (owned, around) for i in (0, 1)]
                _call("add_box", self._handle, *ends, _xyz(ctypes.c_int64, [step // self.dtype.itemsize for step in steps], "strides"))
            for name, (least, most, value) in (parameters or {}).items():
                _call("parameter", self._handle, name.encode(), *map(ctypes.c_double, (least, most, value)))
            if make is not None:
                self._maker = _Maker(_Maker.MAKE(functools.partial(self._make, make)), _Maker.DROP(self._drop), None, budget)
                _call("on_demand", self._handle, ctypes.byref(self._maker))
            _call("start", self._handle)
        except BaseException:
            self.close()
            raise

    def _make(self, make: Callable[[int, int], Array], _: Any, box: int, time: int, samples: Any, error: Any, error_bytes: int) -> int:
        try:
            array = make(box, time)
            if array.shape != self._held[box]:
                raise InvalidArgument(f"make: box {box} has an array of shape {array.shape}, must be {self._held[box]}")
            self._check_fits("make", array, self._strides[box])
            samples[0] = array.ctypes.data
            self._made[box, time] = array
            return 0
        except BaseException as failure:  # nothing goes through C
            line = str(failure) if isinstance(failure, SlabstreamError) else f"{type(failure).__name__}: {failure}"
            text = line.encode()[: error_bytes - 1] + b"\0"
            ctypes.memmove(error, text, len(text))
            return code_of(failure)

    def _drop(self, _: Any, box: int, time: int, samples: int) -> None:
        del self._made[box, time]

    def _begin(self, timeout: float) -> list[Array]:
        pointers, waited = (ctypes.c_void_p * len(self._held))(), ctypes.c_double()
        _call("begin", self._handle, ctypes.c_double(timeout), pointers, ctypes.byref(waited))
        self.waited = waited.value
        arrays: list[Array] = []
        for pointer, memory, shape, strides in zip(pointers, self._memory, self._held, self._strides):
            arrays.append(numpy.ndarray(shape, self.dtype, memoryview(memory.from_address(pointer)), strides=strides))
        return arrays

    def _commit(self, time: int, simulated: float | None) -> None:
        _call("commit", self._handle, ctypes.c_uint64(time), ctypes.c_double(time if simulated is None else simulated))

    @contextlib.contextmanager
    def begin(self, time: int, simulated: float | None = None, timeout: float = 60) -> Iterator[list[Array]]:
        """The arrays of the next time, one a box, in the memory that is drawn from: nothing is copied. Write all of it. After the with
        statement they are whole and read-only; if it ends with an exception, they are not drawn. They end with close().

        `time`: a whole number above the last one, and the same one in all owners. `simulated`: the simulation's own time; None: `time`.
        Unavailable: pictures used all slots for `timeout` seconds."""
        arrays = self._begin(timeout)
        yield arrays
        self._commit(time, simulated)
        for array in arrays:
            array.flags.writeable = False

    def publish(self, time: int, arrays: Array | Sequence[Array] = (), simulated: float | None = None, timeout: float = 60, *,
                copy: bool = True) -> None:
        """Copies the arrays of all boxes, or the one of the only box, and shows them as begin() does. They are converted as numpy does.
        `copy=False` shows them where they lie, and keeps them as long as they may be read: they must not change meanwhile, nor differ in
        type or strides from what the owner was made with. If boxes are made on demand, there are no arrays."""
        if self._maker is not None:
            if len(arrays) > 0:
                raise InvalidArgument("publish: boxes are made on demand, so there are no arrays")
            return self._adopt(time, (), simulated, timeout)
        arrays = [arrays] if isinstance(arrays, numpy.ndarray) else arrays
        shapes = [array.shape for array in arrays]
        if shapes != self._held:
            raise InvalidArgument(f"publish: arrays of shapes {shapes}, must be {self._held}")
        if not copy:
            return self._adopt(time, arrays, simulated, timeout)
        for to, array in zip(self._begin(timeout), arrays):
            to[...] = array
        self._commit(time, simulated)

    def _adopt(self, time: int, arrays: Sequence[Array], simulated: float | None, timeout: float) -> None:
        for array, strides in zip(arrays, self._strides):
            self._check_fits("publish", array, strides)
        pointers, freed = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays)), ctypes.c_uint64()
        _call("adopt", self._handle, ctypes.c_uint64(time), ctypes.c_double(time if simulated is None else simulated), pointers,
              ctypes.c_double(timeout), ctypes.byref(freed))
        self._kept.pop(freed.value, None)
        self._kept[time] = arrays

    def _check_fits(self, function: str, array: Array, strides: Sequence[int]) -> None:
        if array.dtype != self.dtype or any(n > 1 and a != b for n, a, b in zip(array.shape, array.strides, strides)):
            raise InvalidArgument(f"{function}: an array of {array.dtype} with strides {array.strides}, must be {self.dtype} with {strides}")

    @property
    def looked_at(self) -> bool:
        """Somebody has asked for a picture within the last seconds."""
        looked_at = ctypes.c_int()
        _call("poll", self._handle, ctypes.byref(looked_at), None)
        return looked_at.value != 0

    @property
    def parameters(self) -> dict[str, float]:
        """The present values. Owner 0 alone hears of new ones: let it tell the others, so that all use them from the same step on."""
        values = (ctypes.c_double * len(self._parameters))()
        _call("poll", self._handle, None, values)
        return dict(zip(self._parameters, values))

    def close(self) -> None:
        """Leaves the service, and frees the memory: arrays of begin() must not be used any more."""
        handle, self._handle = self._handle, ctypes.c_void_p()
        _library().slabstream_insitu_close(handle)
        self._kept.clear()

    def __enter__(self) -> Owner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", None) and self._process == os.getpid():  # a forked child has a copy alone
            self.close()
