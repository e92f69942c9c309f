"""The gateways beside this process: one for each service that it views, which ends with this process."""
from __future__ import annotations

import atexit
import http.client
import os
import pathlib
import socket
import subprocess
import threading
import time
import urllib.parse

from .address import Address
from .errors import InvalidArgument, Unavailable
from .programs import Kept, find_program

_START_SECONDS = 20.0
_END_SECONDS = 10.0
_ANSWER_SECONDS = 10.0
_READY_SECONDS = 2.0
_LOOK_SECONDS = 0.01
_PORT = "{port}"


def _free_port() -> int:
    """Another process may take it meanwhile: then the gateway does not start."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def check_proxy(behind_proxy: str) -> None:
    parts = urllib.parse.urlsplit(behind_proxy)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise InvalidArgument(f"behind_proxy {behind_proxy!r} is no address such as https://hub.example.org/user/anna/proxy/{_PORT}")


def reaches_this_machine() -> bool:
    """Whether the browser can, as far as one can tell: not through JupyterHub, nor in a notebook that runs elsewhere."""
    return not any(os.environ.get(name) for name in ("JUPYTERHUB_SERVICE_PREFIX", "COLAB_RELEASE_TAG", "BINDER_SERVICE_HOST"))


class Gateway:
    """A gateway of this process, for one service. `behind_proxy`: the address of a proxy that leads to it; {port} in it becomes its port."""

    def __init__(self, address: Address, behind_proxy: str = ""):
        program = pathlib.Path(find_program()).with_name("slabstream-gateway")
        if not program.exists():
            raise Unavailable(f"there is no program '{program}' to view with")
        arguments = ["--endpoint", address.endpoint] + ([] if address.file is None else ["--service", str(address.file)])
        if behind_proxy:
            port = _free_port()
            public = behind_proxy.replace(_PORT, str(port)).rstrip("/") + "/"
            arguments += ["--listen", f"127.0.0.1:{port}", "--behind-proxy", public]
        self.program = Kept([str(program), *arguments], stderr=subprocess.DEVNULL)
        words = self.program.first_line(_START_SECONDS).split()
        if len(words) != 2 or words[0] != "ready":
            self.program.end(_END_SECONDS)
            raise Unavailable("slabstream-gateway did not start")
        said = urllib.parse.urlsplit(words[1])
        self.host, self.port = ("127.0.0.1", port) if behind_proxy else (str(said.hostname), int(said.port or 0))
        self.token = said.fragment.partition("=")[2]
        self.url = f"{public}#{said.fragment}" if behind_proxy else words[1]  #: for browsers, with the token
        deadline = time.monotonic() + _READY_SECONDS
        while self._get("/readyz")[0] != 200 and time.monotonic() < deadline:
            time.sleep(_LOOK_SECONDS)  # until it has found its service

    def asset(self, name: str) -> str:
        """A file of the gateway's page."""
        status, content = self._get(f"/assets/{name}")
        if status != 200:
            raise Unavailable(f"slabstream-gateway has no assets/{name}: it is older than this package")
        return content.decode()

    def _get(self, path: str) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(self.host, self.port, timeout=_ANSWER_SECONDS)
        try:
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.status, answer.read()
        except (OSError, http.client.HTTPException) as error:
            raise Unavailable(f"slabstream-gateway does not answer: {error}") from None
        finally:
            connection.close()


_lock = threading.Lock()
_gateways: dict[tuple[str, str], Gateway] = {}  # by the service's endpoint and the proxy


def gateway_of(address: Address, behind_proxy: str = "", gone: Gateway | None = None) -> Gateway:
    """The gateway for a service; it is started if there is none. Any thread; waits for the start. `gone`: one that does not answer any more."""
    with _lock:
        key = address.endpoint, behind_proxy
        gateway = _gateways.get(key)
        if gateway is not None and gateway is gone:
            gateway.program.end(_END_SECONDS)
        if gateway is None or not gateway.program.runs():
            gateway = _gateways[key] = Gateway(address, behind_proxy)
        return gateway


def _end_all() -> None:
    with _lock:
        for gateway in _gateways.values():
            gateway.program.end(_END_SECONDS)
        _gateways.clear()


atexit.register(_end_all)
