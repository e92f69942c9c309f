"""The viewer in a notebook: show() starts a gateway beside this process and embeds its page; where that cannot work, it shows a picture."""
from __future__ import annotations

import atexit
import html
import os
import pathlib
import select
import subprocess
import threading
import urllib.parse
from typing import Any

from .address import Address
from .errors import SlabstreamError, Unavailable
from .programs import KEEPER, end_keeper, find_program

_START_SECONDS = 20.0
_END_SECONDS = 10.0
_PICTURE_SIDE = 512  # of the picture in its place


class _Gateway:
    """A gateway of this process, for one service."""

    def __init__(self, address: Address):
        program = pathlib.Path(find_program()).with_name("slabstream-gateway")
        if not program.exists():
            raise Unavailable(f"there is no program '{program}' to view with")
        arguments = ["--endpoint", address.endpoint] + ([] if address.file is None else ["--service", str(address.file)])
        self.process = os.getpid()
        self.keeper = subprocess.Popen(
            ["/bin/sh", "-c", KEEPER, "viewer", str(program), *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
        )
        assert self.keeper.stdout is not None
        ready = select.select([self.keeper.stdout], [], [], _START_SECONDS)[0]
        words = self.keeper.stdout.readline().decode(errors="replace").split() if ready else []
        if len(words) != 2 or words[0] != "ready":
            self.end()
            raise Unavailable("slabstream-gateway did not start")
        self.url = words[1]

    def runs(self) -> bool:
        return self.process == os.getpid() and self.keeper.poll() is None

    def end(self) -> None:
        if self.process != os.getpid():
            return  # a forked child's copy
        end_keeper(self.keeper, _END_SECONDS)


_lock = threading.Lock()
_gateways: dict[str, _Gateway] = {}  # by the service's endpoint


def _gateway_of(address: Address) -> _Gateway:
    with _lock:
        gateway = _gateways.get(address.endpoint)
        if gateway is None or not gateway.runs():
            gateway = _gateways[address.endpoint] = _Gateway(address)
        return gateway


def _end_all() -> None:
    with _lock:
        for gateway in _gateways.values():
            gateway.end()
        _gateways.clear()


atexit.register(_end_all)


def _reaches_this_machine() -> bool:
    """Whether the browser can, as far as one can tell: not through JupyterHub, nor in a notebook that runs elsewhere."""
    return not any(os.environ.get(name) for name in ("JUPYTERHUB_SERVICE_PREFIX", "COLAB_RELEASE_TAG", "BINDER_SERVICE_HOST"))


class Viewer:
    """A viewer of a dataset, which a notebook shows where it is the value of a cell. `url`: its address, None if there is none; whoever has it
    may use the service through it."""

    def __init__(self, service: Any, name: str, keep: Any, width: int | str, height: int, embed: bool | None, options: dict[str, Any]):
        self._service, self._name, self._keep = service, name, keep
        self._width, self._height, self._options = width, height, options
        self.url: str | None = None
        if embed or (embed is None and _reaches_this_machine()):
            try:
                self.url = f"{_gateway_of(service.address).url}&dataset={urllib.parse.quote(name)}"
            except SlabstreamError:
                if embed:
                    raise

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        if self.url is None:
            image = self._service.render(self._name, **{"size": _PICTURE_SIDE} | self._options)
            return {"image/png": image.png(), "text/plain": repr(self)}
        width = f"{self._width}px" if isinstance(self._width, int) else self._width
        frame = (f'<iframe src="{html.escape(self.url)}" style="width: {html.escape(width)}; height: {self._height}px; border: 0" '
                 f'title="Slabstream viewer of {html.escape(self._name)}"></iframe>')
        return {"text/html": frame, "text/plain": repr(self)}

    def __repr__(self) -> str:
        return f"<slabstream.Viewer of {self._name}{'' if self.url is None else ' at ' + self.url}>"
