"""Where the programs are that this package starts, and how they end with it."""
from __future__ import annotations

import os
import pathlib
import select
import shutil
import subprocess
import time
from typing import Any, Sequence

from .errors import InvalidArgument, NotFound, Unavailable
from .options import in_keywords

class Kept:
    """A program that ends with this process, however it ends: a shell starts it, and ends it when nobody holds the other end of its pipe."""

    def __init__(self, arguments: Sequence[str], then: str = "", **more: Any):
        """`then`: commands of the shell after the end. `more`: of subprocess.Popen."""
        script = '"$@" </dev/null & program=$!; exec >&- 2>&-; read -r _; kill "$program"; wait "$program"; ' + then
        self._process = os.getpid()
        self._shell = subprocess.Popen(["/bin/sh", "-c", script, "slabstream", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                       start_new_session=True, **more)  # Ctrl-C is for this process

    def is_ours(self) -> bool:
        """False: of a forked child, which has a copy alone."""
        return self._process == os.getpid()

    def runs(self) -> bool:
        return self.is_ours() and self._shell.poll() is None

    def first_line(self, seconds: float) -> str:
        """What it says first; empty: it ended, or said nothing for so long."""
        assert self._shell.stdout is not None
        said, deadline = b"", time.monotonic() + seconds
        while b"\n" not in said and select.select([self._shell.stdout], [], [], max(deadline - time.monotonic(), 0.0))[0]:
            part = os.read(self._shell.stdout.fileno(), 4096)
            if not part:
                break
            said += part
        return said.decode(errors="replace").partition("\n")[0] if b"\n" in said else ""

    def end(self, seconds: float) -> bool:
        """False: it took longer, so it was killed."""
        if not self.is_ours():
            return True
        assert self._shell.stdin is not None and self._shell.stdout is not None
        self._shell.stdin.close()
        try:
            self._shell.wait(seconds)
            ended = True
        except subprocess.TimeoutExpired:
            self._shell.kill()
            self._shell.wait()
            ended = False
        self._shell.stdout.close()
        return ended


def find_program() -> str:
    """`slabstream`: in the folder $SLABSTREAM_PROGRAMS, in the wheel that this package came with, on the path, or in the build of the
    sources that this package is part of."""
    folder = os.environ.get("SLABSTREAM_PROGRAMS")
    if folder:
        program = shutil.which("slabstream", path=folder)
        if program is None:
            raise NotFound(f"$SLABSTREAM_PROGRAMS is '{folder}', which has no program slabstream")
        return program
    packages = pathlib.Path(__file__).resolve().parents[1]
    places = (str(packages / "slabstream_programs"), None, str(packages.parent / "build" / "bin"))
    found = next(filter(None, (shutil.which("slabstream", path=place) for place in places)), None)
    if found is None:
        raise NotFound("there is no program slabstream to start a service with: put it on the path, name its folder in $SLABSTREAM_PROGRAMS, "
                       "or connect() to a service that runs")
    return found


def find_library() -> str:
    """`libslabstream.so.0`: beside the program, or in a folder of libraries there; else its name, for the loader to find."""
    name = "libslabstream.so.0"
    try:
        folder = pathlib.Path(find_program()).resolve().parent
    except NotFound:
        return name
    places = [folder, folder / "lib", folder.parent / "lib", *folder.parent.glob("lib/*-linux-gnu")]
    return next((str(place / name) for place in places if (place / name).exists()), name)


def run_program(program: str, command: str, *arguments: str, given: bytes = b"") -> bytes:
    """What a command of `slabstream` prints, which reads `given`. InvalidArgument, Unavailable: it failed, and says why."""
    done = subprocess.run([program, command, *arguments], input=given, capture_output=True)
    if done.returncode != 0:
        lines = done.stderr.decode(errors="replace").strip().splitlines() or [f"slabstream {command} failed"]
        raise (InvalidArgument if done.returncode == 2 else Unavailable)(in_keywords(lines[-1].removeprefix(f"slabstream {command}: ")))
    return done.stdout
