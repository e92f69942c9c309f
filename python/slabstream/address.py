"""Where a service is, and the keys to it: endpoints, service files (docs/security.md), and the service that one means by naming none. And where a
store is."""
from __future__ import annotations

import dataclasses
import ipaddress
import json
import os
import pathlib
import re
from typing import Any

from .errors import InvalidArgument, Unavailable
from .values import json_of

_SHAPES = "tcp://HOST:PORT or ipc:///PATH"
_MOST_IPC_PATH_BYTES = 107
_KEYS, _KEY_CHARACTERS = ("server_key", "public_key", "secret_key"), 40  # Z85


@dataclasses.dataclass(frozen=True)
class Keys:
    """CURVE keys as text of 40 characters (Z85). `secret` is not shown."""

    server: str
    public: str
    secret: str = dataclasses.field(repr=False)


@dataclasses.dataclass(frozen=True)
class Address:
    endpoint: str
    keys: Keys | None = None
    file: pathlib.Path | None = None  # the service file that has the keys


def is_address(path: str) -> bool:
    """Of a store behind a web server or in a bucket."""
    return re.match(r"[a-z][a-z0-9+]*://", path) is not None


def is_loopback(host: str) -> bool:
    if host in ("localhost", "[::1]"):
        return True
    try:
        return ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


def check_endpoint(text: str, with_keys: bool) -> None:
    """InvalidArgument unless one can connect there. Without keys a service stays on its machine."""

    def refuse(why: str) -> InvalidArgument:
        return InvalidArgument(f"endpoint {json.dumps(text[:128])}: {why}")

    if text.startswith("ipc:///"):
        if len(os.fsencode(text[6:])) > _MOST_IPC_PATH_BYTES:
            raise refuse(f"a path of {len(os.fsencode(text[6:]))} bytes, at most {_MOST_IPC_PATH_BYTES} fit a socket address")
        return
    host, _, port = text[6:].rpartition(":")
    if not text.startswith("tcp://") or not host or " " in text:
        raise refuse(f"expected {_SHAPES}")
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise refuse(f'port "{port}" is not a number of [1, 65535]')
    if not with_keys and not is_loopback(host):
        raise refuse(
            f'host "{host}" is not loopback (127.0.0.0/8, [::1] or localhost): without keys the service stays on this machine '
            "(a service file has those of one that does not)"
        )


def read_service_file(path: str | os.PathLike[str]) -> Address:
    """The address in a file of role client or admin. Messages contain no secret."""
    file = pathlib.Path(path)
    if file.exists() and file.stat().st_mode & 0o077:
        raise InvalidArgument(f"others can use '{file}', which holds a secret (chmod 600)")
    fields = json_of("service file", file)
    if not isinstance(fields, dict):
        raise InvalidArgument(f"'{file}' is no service file: it is not one JSON object")
    for name in ("role", "endpoint", *_KEYS):
        value = fields.get(name)
        if not isinstance(value, str):
            raise InvalidArgument(f"service file '{file}': {name} is missing or no text")
        if name in _KEYS and (len(value) != _KEY_CHARACTERS or not value.isascii()):
            raise InvalidArgument(f"service file '{file}': {name} is no key")
    if fields["role"] in ("worker", "owner"):
        raise InvalidArgument(f"service file '{file}' is of role {fields['role']}, but client or admin is needed here")
    if fields["role"] not in ("client", "admin"):
        raise InvalidArgument(f"service file '{file}': role is not client, worker, admin or owner")
    return Address(fields["endpoint"], Keys(*(fields[name] for name in _KEYS)), file.resolve())


def _state_folder() -> pathlib.Path:
    """Where `slabstream up` records what it started (client/cli/service_state.h)."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    try:
        own = runtime.startswith("/") and os.stat(runtime).st_uid == os.getuid()
    except OSError:
        own = False
    return pathlib.Path(runtime, "slabstream") if own else pathlib.Path(f"/tmp/slabstream-{os.getuid()}")


def _runs(pid: int) -> bool:
    try:
        text = pathlib.Path(f"/proc/{pid}/stat").read_text(errors="replace")
    except OSError:
        return False
    name, _, rest = text.partition("(")[2].rpartition(")")
    return name == "slabstream-coordinator"[:15] and rest[1:2] not in ("Z", "X")


def _started_here(endpoint: str | None) -> dict[str, Any] | None:
    """The newest service that `slabstream up` started here and that runs, at this endpoint or at any."""
    folder = _state_folder()
    try:
        if folder.lstat().st_uid != os.getuid():
            return None
        files = sorted(folder.glob("*.json"))
    except OSError:
        return None
    newest: dict[str, Any] | None = None
    for file in files:
        try:
            state = json.loads(file.read_text())
            meant = not state.get("unlisted") if endpoint is None else state["endpoint"] == endpoint
            found = meant and _runs(int(state["coordinator"]))
            if found and (newest is None or state["started_unix"] > newest["started_unix"]):
                newest = state
        except (OSError, ValueError, KeyError, TypeError):
            continue  # damaged
    return newest


def find_service(service: str | os.PathLike[str] | None = None, endpoint: str | None = None) -> Address:
    """The service that is meant: the named one; else $SLABSTREAM_SERVICE; else $SLABSTREAM_ENDPOINT; else the one that `slabstream up`
    started here last. Unavailable: it has started none that runs. An endpoint beside a service file is another way to the same service, such
    as the near end of a tunnel."""
    if service is None and endpoint is None:
        service = os.environ.get("SLABSTREAM_SERVICE") or None
        endpoint = None if service else os.environ.get("SLABSTREAM_ENDPOINT") or None
    if service is not None:
        address = read_service_file(service)
        if endpoint is not None:
            address = dataclasses.replace(address, endpoint=endpoint)
    else:
        state = _started_here(endpoint)
        if state is not None and state.get("keys_folder"):
            address = read_service_file(pathlib.Path(state["keys_folder"], "admin.json"))
        elif endpoint is not None:
            address = Address(endpoint)
        elif state is not None:
            address = Address(state["endpoint"])
        else:
            raise Unavailable("no service is named, and `slabstream up` of this user has started none here that runs")
    check_endpoint(address.endpoint, address.keys is not None)
    return address
