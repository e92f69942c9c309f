"""Widget: the viewer in a notebook, by anywidget. What it shows is in step with the page: it may be read, set and observed.

The page is the module that the gateway serves as assets/widget.js. It asks the gateway itself where it reaches it, and else over the kernel's
channel (relay.py), so no second port is needed.
"""
from __future__ import annotations

import base64
import contextlib
import dataclasses
import functools
import html
import uuid
import weakref
from typing import Any, Callable, Mapping, Sequence

import anywidget
import traitlets
from IPython import get_ipython
from IPython.display import display
from ipywidgets import CallbackDispatcher

from .errors import InvalidArgument, SlabstreamError, warn
from .frame import Frame
from .gateway import Gateway
from .image import Image
from .page_state import PARTS, READ, Camera, Texts, with_part
from .probe import Sample
from .relay import Relay
from .viewer import Viewer

STILL = "A still picture of {}. Run the cell to turn it."
_STILL_SECONDS = 10.0  # that a cell waits for its still picture
_CAMERA_FIELDS = [field.name for field in dataclasses.fields(Camera)]


_open: weakref.WeakSet[Widget] = weakref.WeakSet()


def _running_cell() -> str | None:
    """The cell of the notebook that runs. None: the page does not name it."""
    shell: Any = get_ipython()
    parent: Mapping[str, Any] = shell.get_parent() if hasattr(shell, "get_parent") else {}
    return (parent.get("metadata") or {}).get("cellId")


def _close_gone(run: Any = None) -> None:
    """Closes widgets that no page shows any more: those whose cell runs again, and those whose comm was closed, as marimo does. ipywidgets would
    keep them, and they their volumes. `run`: of a cell, which is about to begin."""
    cell = getattr(run, "cell_id", None)
    for widget in list(_open):
        if getattr(widget.comm, "_closed", False) or (cell is not None and widget._cell == cell):
            widget.close()


if (_shell := get_ipython()) is not None:
    _shell.events.register("pre_run_cell", _close_gone)


@functools.lru_cache(1)
def _module_of(gateway: Gateway) -> str:
    return gateway.asset("widget.js")


def _sample_of(picked: Mapping[str, Any]) -> Sample | None:
    """The answer of api/v1/pick."""
    if not picked.get("hit"):
        return None
    label = picked.get("label") or {}
    (x, y, z), voxel = picked["at"], picked.get("voxel")
    return Sample(at=(x, y, z), index=(voxel[2], voxel[1], voxel[0]) if voxel else None, value=picked.get("value"), label=label.get("value"),
                  label_name=label.get("name", ""), fields=tuple((each["name"], each["value"]) for each in picked.get("fields", ())),
                  depth=picked.get("depth"), shape=picked.get("shape"), shape_number=picked.get("shape_number"),
                  shape_value=picked.get("shape_value"))


class Widget(anywidget.AnyWidget):
    """Made by view(). A notebook shows it where it is the value of a cell.

    These may be read, set, observed (`widget.observe(function, "camera")`) and linked (`traitlets.link((a, "camera"), (b, "camera"))`): `camera`,
    `transfer`, `scalar_range`, `channels`, `time` and `dataset`, which have the values of the options of these names, and `state`, which has all
    of it in the texts of the page's link. Any thread may set them; what is observed is called on the kernel's thread.
    """

    _esm = traitlets.Unicode().tag(sync=True)
    _css = traitlets.Unicode().tag(sync=True)
    _address = traitlets.Unicode().tag(sync=True)
    _state = traitlets.Dict().tag(sync=True)
    _height = traitlets.Unicode().tag(sync=True)
    _panel = traitlets.Bool().tag(sync=True)
    channel = traitlets.Unicode(help='By what the page gets its pictures: "gateway" or "kernel"; empty: no page shows it yet').tag(sync=True)

    camera = traitlets.Any(help="Where one looks from: a slabstream.Camera. A dict changes some of its fields")
    transfer = traitlets.Any(help="A preset's name, or a TransferFunction")
    scalar_range = traitlets.Any(help="(low, high); None: that of the transfer function")
    channels = traitlets.Any(help="Looks by channel, as the option has them; None: as the dataset says")
    time = traitlets.Any(help="A number, or a text as 3.5s or last; None: as the dataset says")
    dataset = traitlets.Unicode(help="The dataset's name")
    state = traitlets.Dict(help="Texts by the names of the page's link")

    def __init__(self, viewer: Viewer, height: int | str = 512, panel: bool = False):
        _close_gone()
        self._viewer, self._cell = viewer, _running_cell()
        self._picked, self._failed = CallbackDispatcher(), CallbackDispatcher()
        self._relay = Relay(viewer.gateway, self._say, self._find_address)
        self._still = dict(viewer.first), self._begin_still(viewer.first)  # it is drawn while the gateway starts
        super().__init__(_anywidget_id=f"slabstream.{uuid.uuid4()}",  # whose style is the widget's own
                         _esm=_module_of(viewer.gateway()), _address=viewer.address, _state=dict(viewer.first), _panel=panel,
                         _height=f"{height}px" if isinstance(height, int) else height)
        self.on_msg(self._hear)
        _open.add(self)

    @property
    def url(self) -> str | None:
        """The address of the viewer's page; None: a browser does not reach this machine."""
        return self._viewer.url

    def picture(self, **options: Any) -> Image:
        """The picture that it shows, by the service; `options` are those of render(), such as size=1024, and take precedence."""
        viewer = self._viewer
        return viewer.service.render(**viewer.asked(self._state, options))  # type: ignore[no-any-return]

    def on_pick(self, callback: Callable[[Sample | None], Any], remove: bool = False) -> None:
        """Calls `callback` with the Sample that the user points at and clicks; None: nothing is there."""
        self._picked.register_callback(callback, remove=remove)

    def on_error(self, callback: Callable[[str], Any], remove: bool = False) -> None:
        """Calls `callback` with the line that the page shows when something fails."""
        self._failed.register_callback(callback, remove=remove)

    def close(self) -> None:
        """Takes it from the page, and lets go of the volume that was loaded for it. So does running its cell again."""
        _open.discard(self)
        self._relay.close()
        self._viewer.close()
        super().close()

    # ---- its properties, which are views of the state

    @traitlets.validate(*READ)
    def _check(self, proposal: Any) -> Any:
        name, value = proposal["trait"].name, proposal["value"]
        present = READ[name](self._state)
        return present if type(value) is type(present) and value == present else READ[name](self._with(name, value))

    @traitlets.observe(*READ)
    def _take(self, change: Any) -> None:
        if READ[change["name"]](self._state) != change["new"]:
            self._state = self._with(change["name"], change["new"])

    @traitlets.observe("_state")
    def _follow(self, change: Any) -> None:
        for name, read in READ.items():
            setattr(self, name, read(change["new"]))

    def _with(self, name: str, value: Any) -> Texts:
        """The state with this value of a property. InvalidArgument: it is wrong."""
        if name == "state":
            return _checked_state(value)
        if name == "camera":
            options = _camera_options(self.camera, value)
        else:
            options = {} if name == "dataset" or value is None else {name: value}
        return with_part(self._state, name, self._viewer.texts(value if name == "dataset" else self.dataset, options))

    # ---- the page

    def _hear(self, _: Any, message: Any, buffers: Sequence[Any]) -> None:
        if not isinstance(message, dict):
            return
        if "picked" in message:
            self._picked(_sample_of(message["picked"]))
        elif "error" in message:
            self._failed(str(message["error"]))
        else:
            self._relay.hear(message, buffers)

    def _say(self, message: dict[str, Any], buffers: Sequence[bytes]) -> None:
        self.send(message, list(buffers))

    def _find_address(self) -> None:
        self._address = self._viewer.address

    # ---- the still picture

    def _begin_still(self, state: Mapping[str, str]) -> Frame:
        viewer = self._viewer
        return viewer.service.submit(**viewer.asked(state, {}) | {"deadline": _STILL_SECONDS})  # type: ignore[no-any-return]

    def _png(self) -> str:
        """In base 64, of what it shows now."""
        if self._still[0] != self._state:
            self._still = dict(self._state), self._begin_still(self._state)
        return base64.b64encode(self._still[1].result().png()).decode()

    def _repr_mimebundle_(self, **kwargs: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """The view, and beside it a picture for documents."""
        data, more = super()._repr_mimebundle_(**kwargs)
        with contextlib.suppress(SlabstreamError):
            data = {**data, "image/png": self._png()}
        return data, more

    def _ipython_display_(self, **kwargs: Any) -> None:
        """The view, and then a picture as an output of its own: JupyterLab shows nothing else of an output whose widget is gone. Pages that are
        alive hide it."""
        data, more = super()._repr_mimebundle_(**kwargs)
        display(data, metadata=more, raw=True)
        try:
            png = self._png()
        except SlabstreamError as error:
            warn(f"there is no still picture of {self.dataset}: {error}")
            return
        name = html.escape(self.dataset)
        shown = f'<div class="{self._still_class}"><img alt="{name}" src="data:image/png;base64,{png}"><div>{STILL.format(name)}</div></div>'
        display({"text/html": shown, "image/png": png, "text/plain": repr(self)}, raw=True)

    @property
    def _still_class(self) -> str:
        return f"slabstream-still-{self.model_id}"

    @traitlets.observe("channel")
    def _hide_still(self, change: Any) -> None:
        self._css = f".{self._still_class} {{ display: none; }}"

    def __repr__(self) -> str:
        return f"<slabstream.Widget of {self.dataset}>"


def _camera_options(present: Camera, value: Any) -> dict[str, Any]:
    if isinstance(value, Camera):
        return dataclasses.asdict(value)
    if not isinstance(value, Mapping):
        raise InvalidArgument(f"camera {value!r} is neither a slabstream.Camera nor a dict of some of its fields")
    for field in value:
        if field not in _CAMERA_FIELDS:
            raise InvalidArgument(f"camera has the field {field!r}, must be one of: {', '.join(_CAMERA_FIELDS)}")
    return {**dataclasses.asdict(present), **value}


def _checked_state(value: Any) -> Texts:
    if not isinstance(value, Mapping) or not all(isinstance(each, str) for item in value.items() for each in item):
        raise InvalidArgument(f"state {value!r} is not texts by names")
    for name, read in READ.items():
        try:
            read(value)
        except (ValueError, TypeError) as error:
            raise InvalidArgument(f"state has no {name} that can be read: {error}") from None
    return dict(value)
