"""A service of this process' own: it is started when it is first needed, and ends with the process."""
from __future__ import annotations

import atexit
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import threading
import time
from typing import Any

from .address import Address
from .connection import Connection
from .errors import SlabstreamError, Unavailable
from .programs import KEEPER, end_keeper, find_program
from .service import Service

_START_SECONDS = 60.0
_END_SECONDS = 20.0
_MOST_FOLDER_BYTES = 50  # of temporary files: paths of sockets have at most 107, with names of ours and of workers behind it

_KEEPER = KEEPER + '; rm -rf -- "$0"'  # of the service, in its folder


class LocalService:
    """A service of this process alone: it listens in a private folder, which also holds its files and its logs."""

    def __init__(self) -> None:
        self.process = os.getpid()
        program = find_program()
        short = len(os.fsencode(tempfile.gettempdir())) <= _MOST_FOLDER_BYTES
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slabstream-", dir=None if short else "/tmp"))
        endpoint = f"ipc://{self.folder}/s"
        with (self.folder / "errors").open("wb") as errors:
            self.keeper = subprocess.Popen(
                ["/bin/sh", "-c", _KEEPER, str(self.folder), program, "up", "--listen", endpoint],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                # `slabstream status` and `render` of this user mean another service than this one.
                env={**os.environ, "XDG_RUNTIME_DIR": str(self.folder)},
                start_new_session=True,  # Ctrl-C is for this process
            )
        try:
            self.service = Service(Connection(Address(self._endpoint())))
        except BaseException:
            self.end()
            raise
        self.kept: dict[str, Any] = {}  # what loading.py keeps as long as the service runs

    def _endpoint(self) -> str:
        """What the service says when it is ready."""
        assert self.keeper.stdout is not None
        said = b""
        deadline = time.monotonic() + _START_SECONDS
        while b"\n" not in said:
            if not select.select([self.keeper.stdout], [], [], max(deadline - time.monotonic(), 0.0))[0]:
                raise Unavailable(f"slabstream up is not ready after {_START_SECONDS:g} s")
            part = os.read(self.keeper.stdout.fileno(), 4096)
            if not part:
                why = (self.folder / "errors").read_text(errors="replace").strip().splitlines()
                raise Unavailable(why[-1] if why else "slabstream up ended and said nothing")
            said += part
        words = said.decode(errors="replace").split()
        if words[:4] != ["slabstream", "is", "up", "at"] or len(words) < 5:
            raise Unavailable(f"slabstream up said '{said.decode(errors='replace').splitlines()[0]}' instead of its endpoint")
        return words[4]

    def end(self) -> None:
        if os.getpid() != self.process:
            return  # a forked child's copy
        if hasattr(self, "service"):
            self.service.close()
        if not end_keeper(self.keeper, _END_SECONDS):
            shutil.rmtree(self.folder, ignore_errors=True)


lock = threading.RLock()
_local: LocalService | None = None


def running() -> LocalService:
    """The service of this process; it is started if there is none, or if it has gone."""
    global _local
    with lock:
        if _local is not None and _local.process == os.getpid():
            try:
                _local.service.status()
            except SlabstreamError:
                _local.end()
                _local = None
        if _local is None or _local.process != os.getpid():
            _local = LocalService()
        return _local


def shutdown() -> None:
    """Ends the service that load() and render() started, if there is one. The next call starts another. It also ends with the interpreter."""
    global _local
    with lock:
        ended, _local = _local, None
        if ended is not None:
            ended.end()


atexit.register(shutdown)
