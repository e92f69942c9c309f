"""The viewer in a notebook: show() starts a gateway beside this process and embeds its page; where that cannot work, it shows a picture."""
from __future__ import annotations

import atexit
import base64
import html
import os
import pathlib
import socket
import subprocess
import threading
import urllib.parse
from typing import Any

from .address import Address
from .errors import InvalidArgument, SlabstreamError, Unavailable
from .programs import Kept, find_program

_START_SECONDS = 20.0
_END_SECONDS = 10.0
_PICTURE_SIDE = 512  # of the picture in its place
_PORT = "{port}"

VIEWER_OPTIONS = ("width", "height", "embed", "behind_proxy", "keep")  # of show(), beside those of pictures


def _free_port() -> int:
    """Another process may take it meanwhile: then the gateway does not start."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _checked_proxy(behind_proxy: str) -> str:
    parts = urllib.parse.urlsplit(behind_proxy)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise InvalidArgument(f"behind_proxy {behind_proxy!r} is no address such as https://hub.example.org/user/anna/proxy/{_PORT}")
    return behind_proxy


class _Gateway:
    """A gateway of this process, for one service. `behind_proxy`: the address of a proxy that leads to it; {port} in it becomes its port."""

    def __init__(self, address: Address, behind_proxy: str = ""):
        program = pathlib.Path(find_program()).with_name("slabstream-gateway")
        if not program.exists():
            raise Unavailable(f"there is no program '{program}' to view with")
        arguments = ["--endpoint", address.endpoint] + ([] if address.file is None else ["--service", str(address.file)])
        if behind_proxy:
            port = _free_port()
            parts = urllib.parse.urlsplit(behind_proxy.replace(_PORT, str(port)))
            arguments += ["--listen", f"127.0.0.1:{port}", "--behind-proxy", f"{parts.scheme}://{parts.netloc}"]
        self.program = Kept([str(program), *arguments], stderr=subprocess.DEVNULL)
        words = self.program.first_line(_START_SECONDS).split()
        if len(words) != 2 or words[0] != "ready":
            self.program.end(_END_SECONDS)
            raise Unavailable("slabstream-gateway did not start")
        self.url = words[1]
        if behind_proxy:
            self.url = f"{parts.geturl().rstrip('/')}/#{urllib.parse.urlsplit(words[1]).fragment}"


_lock = threading.Lock()
_gateways: dict[tuple[str, str], _Gateway] = {}  # by the service's endpoint and the proxy


def _gateway_of(address: Address, behind_proxy: str) -> _Gateway:
    with _lock:
        key = address.endpoint, behind_proxy
        gateway = _gateways.get(key)
        if gateway is None or not gateway.program.runs():
            gateway = _gateways[key] = _Gateway(address, behind_proxy)
        return gateway


def _end_all() -> None:
    with _lock:
        for gateway in _gateways.values():
            gateway.program.end(_END_SECONDS)
        _gateways.clear()


atexit.register(_end_all)


def _reaches_this_machine() -> bool:
    """Whether the browser can, as far as one can tell: not through JupyterHub, nor in a notebook that runs elsewhere."""
    return not any(os.environ.get(name) for name in ("JUPYTERHUB_SERVICE_PREFIX", "COLAB_RELEASE_TAG", "BINDER_SERVICE_HOST"))


def _takes_frames() -> bool:
    """Whether the notebook's page may have a frame with a page of this machine: those of Visual Studio Code are of another scheme, which
    the gateway admits only if --frame-in names it."""
    return not any(os.environ.get(name) for name in ("VSCODE_PID", "VSCODE_CWD"))


class Viewer:
    """A viewer of a dataset, which a notebook shows where it is the value of a cell. `url`: its address, None if there is none; whoever has it
    may use the service through it."""

    def __init__(self, service: Any, name: str, keep: Any, width: int | str, height: int, embed: bool | None, behind_proxy: str | None,
                 options: dict[str, Any]):
        self._service, self._name, self._keep = service, name, keep
        self._width, self._height, self._options = width, height, options
        self._framed = bool(embed) or _takes_frames()
        self.url: str | None = None
        proxy = "" if behind_proxy is None else _checked_proxy(behind_proxy)
        if embed or (embed is None and (proxy or _reaches_this_machine())):
            try:
                self.url = f"{_gateway_of(service.address, proxy).url}&dataset={urllib.parse.quote(name)}"
            except SlabstreamError:
                if embed:
                    raise

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        if self.url is None or not self._framed:
            png = self._service.render(self._name, **{"size": _PICTURE_SIDE} | self._options).png()
            if self.url is None:
                return {"image/png": png, "text/plain": repr(self)}
            link = f'<a href="{html.escape(self.url)}" target="_blank">Open the viewer of {html.escape(self._name)}</a>'
            picture = f'<img alt="{html.escape(self._name)}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
            return {"text/html": f"<div>{picture}</div><div>{link}: {html.escape(self.url.partition('#')[0])}</div>", "text/plain": repr(self)}
        width = f"{self._width}px" if isinstance(self._width, int) else self._width
        frame = (f'<iframe src="{html.escape(self.url)}" style="width: {html.escape(width)}; height: {self._height}px; border: 0" '
                 f'title="Slabstream viewer of {html.escape(self._name)}"></iframe>')
        return {"text/html": frame, "text/plain": repr(self)}

    def __repr__(self) -> str:
        return f"<slabstream.Viewer of {self._name}{'' if self.url is None else ' at ' + self.url}>"
