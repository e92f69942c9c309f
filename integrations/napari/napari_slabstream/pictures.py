"""A thread that asks for pictures of views and blends them: the newest view wins; a coarse picture first, then a sharp one."""
from __future__ import annotations

import dataclasses
import os
import threading
from typing import Any, Callable

import numpy as np
import slabstream as ss

from .layers import Camera, NotShown, Place, Source, address_of, blend, by_address, by_value, camera_options

_COARSE = 0.5    # pixels of a coarse picture, as a share of the canvas' along each axis
_STILL = 0.15    # seconds that a view stands still before its sharp picture is asked for
_MOST_SOURCES = 32  # volumes that are kept at the service, those that were shown last


@dataclasses.dataclass(frozen=True)
class Shown:
    """A layer in a view."""

    layer: Any           # its data, name and source are read on the thread
    data: Any = dataclasses.field(compare=False)  # layer.data, as it was
    data_id: int
    siblings: list[Any]  # layers of the same store, in order
    place: Place
    look: dict[str, Any]
    opacity: float
    blending: str


@dataclasses.dataclass(frozen=True)
class View:
    layers: tuple[Shown, ...]
    camera: Camera
    background: tuple[float, float, float]
    ratio: float  # pixels of the screen a pixel of the canvas


class Pictures:
    """`tell(view, rgb, sharp, notes)` is called on the thread: height, width, 3 of float32 from 0 to 1, and by layer why the picture lacks
    it."""

    def __init__(self, tell: Callable[[View, Any, bool, dict[Any, str]], None]):
        self._tell = tell
        self._changed = threading.Condition()
        self._wanted: View | None = None
        self._ended = False
        self._sources: dict[Any, tuple[Any, Source | NotShown]] = {}  # what was shown last comes last
        self._done: dict[Any, Any] = {}  # sharp pictures of the last view, by what they show
        stated = any(os.environ.get(name) for name in ("SLABSTREAM_SERVICE", "SLABSTREAM_ENDPOINT"))
        self._connect: Callable[[], ss.Service | None] = ss.connect if stated else lambda: None
        self._service: ss.Service | None = None
        threading.Thread(target=self._run, name="slabstream-napari", daemon=True).start()

    def want(self, view: View | None) -> None:
        """None: nothing more. Any thread."""
        with self._changed:
            self._wanted = view
            self._changed.notify_all()

    def forget(self) -> None:
        """Data are sent anew for the next view."""
        with self._changed:
            self._sources.clear()
            self._done.clear()

    def end(self) -> None:
        """Does not wait for what is on its way. Volumes are taken away from the service."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _run(self) -> None:
        view: View | None = None
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or self._wanted is not view)
                view = self._wanted
                if self._ended:
                    break
            if view is not None:
                self._show(view, sharp=False)
                if not self._newer(view, _STILL):
                    self._show(view, sharp=True)
        self._sources.clear()

    def _newer(self, view: View, seconds: float = 0) -> bool:
        with self._changed:
            return self._changed.wait_for(lambda: self._ended or self._wanted is not view, seconds)

    def _source(self, shown: Shown) -> Source:
        key = (id(shown.layer), shown.data_id, shown.place.index, shown.place.spacing)
        data, found = self._sources.pop(key, None) or (shown.data, self._bring(shown))
        self._sources[key] = data, found  # with the data, so that no others get their id; a layer that is not shown keeps its reason
        for old in list(self._sources)[:-_MOST_SOURCES]:
            self._sources.pop(old, None)
        if isinstance(found, NotShown):
            raise found
        return found

    def _bring(self, shown: Shown) -> Source | NotShown:
        try:
            if self._service is None:
                self._service = self._connect()
            address = address_of(shown.layer)
            there = address is not None and (self._service is None or "://" in address)  # paths mean nothing on other machines
            source = by_address(shown.layer, shown.siblings, address, shown.place, self._service) if there else None
            return source or by_value(shown.layer, shown.place, self._service)
        except ss.Unavailable:
            raise  # of the whole service: the next view tries again
        except Exception as error:  # of the data: of any package
            return NotShown(str(error).splitlines()[0] if str(error) else type(error).__name__)

    def _show(self, view: View, sharp: bool) -> None:
        frames, notes = [], {}
        scale = view.ratio if sharp else _COARSE
        for shown in view.layers:
            if sharp and self._newer(view):
                self._cancel(frames)
                return
            try:
                source = self._source(shown)
                camera, mirrored = camera_options(view.camera, shown.place, source, scale)
                options = {**source.options, **shown.look, **camera, "detail": 1 if sharp else 2}
                key = (source.volume.name, repr(options))
                frame = self._done.get(key) or source.volume.submit(**options)
                if isinstance(frame, ss.Frame):
                    frame.add_done_callback(self._wake)
                frames.append((shown, key, mirrored, frame))
            except (ss.SlabstreamError, NotShown) as error:
                notes[shown.layer] = str(error)
        below, done = np.array(view.background, np.float32), {}
        below = np.broadcast_to(below, (max(round(view.camera.height * scale), 1), max(round(view.camera.width * scale), 1), 3))
        for number, (shown, key, mirrored, frame) in enumerate(frames):
            try:
                image = self._result(view, frame, sharp)
                if image is None:
                    self._cancel(frames)
                    return
                done[key] = image
                rgba = image.rgba[:, ::-1] if mirrored else image.rgba
                below = blend(below, rgba, shown.opacity, shown.blending, number == 0)
            except ss.SlabstreamError as error:
                notes[shown.layer] = str(error)
        if sharp:
            self._done = done
        if not self._ended:
            self._tell(view, np.ascontiguousarray(below, np.float32), sharp, notes)

    def _wake(self, _: ss.Frame) -> None:
        with self._changed:
            self._changed.notify_all()

    def _result(self, view: View, frame: Any, sharp: bool) -> Any:
        """None: the picture is sharp, and a newer view is wanted. Coarse ones are shown even then, else nothing would move."""
        if not isinstance(frame, ss.Frame):
            return frame
        with self._changed:
            self._changed.wait_for(lambda: frame.done() or self._ended or (sharp and self._wanted is not view))
        return frame.result() if frame.done() else None

    @staticmethod
    def _cancel(frames: list[Any]) -> None:
        for *_, frame in frames:
            if isinstance(frame, ss.Frame):
                frame.cancel()
