"""A service of this process' own: it is started when it is first needed, and ends with the process."""
from __future__ import annotations

import atexit
import os
import pathlib
import shlex
import shutil
import tempfile
import threading
from typing import Any

from .address import Address
from .errors import SlabstreamError, Unavailable
from .programs import Kept, find_program
from .service import Service

_START_SECONDS = 60.0
_END_SECONDS = 20.0
_MOST_FOLDER_BYTES = 50  # of temporary files: paths of sockets have at most 107, with names of ours and of workers behind it


class LocalService:
    """A service of this process alone: it listens in a private folder, which also holds its files and its logs."""

    def __init__(self) -> None:
        program = find_program()
        short = len(os.fsencode(tempfile.gettempdir())) <= _MOST_FOLDER_BYTES
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="slabstream-", dir=None if short else "/tmp"))
        endpoint = f"ipc://{self.folder}/s"
        with (self.folder / "errors").open("wb") as errors:
            # `slabstream status` and `render` of this user mean another service than this one.
            self.program = Kept([program, "up", "--listen", endpoint], f"rm -rf -- {shlex.quote(str(self.folder))}", stderr=errors,
                                env={**os.environ, "XDG_RUNTIME_DIR": str(self.folder)})
        try:
            self.service = Service(Address(self._endpoint()))
        except BaseException:
            self.end()
            raise
        self.kept: dict[str, Any] = {}  # what loading.py keeps as long as the service runs

    def _endpoint(self) -> str:
        """What the service says when it is ready."""
        said = self.program.first_line(_START_SECONDS)
        words = said.split()
        if words[:4] == ["slabstream", "is", "up", "at"] and len(words) > 4:
            return words[4]
        why = (self.folder / "errors").read_text(errors="replace").strip().splitlines()
        raise Unavailable(why[-1] if why else f"slabstream up said '{said}' within {_START_SECONDS:g} s instead of its endpoint")

    def end(self) -> None:
        if hasattr(self, "service") and self.program.is_ours():
            self.service.close()
        if not self.program.end(_END_SECONDS):
            shutil.rmtree(self.folder, ignore_errors=True)


lock = threading.RLock()
_local: LocalService | None = None


def running() -> LocalService:
    """The service of this process; it is started if there is none, or if it has gone."""
    global _local
    with lock:
        if _local is not None and _local.program.is_ours():
            try:
                _local.service.status()
            except SlabstreamError:
                _local.end()
                _local = None
        if _local is None or not _local.program.is_ours():
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
