"""Where the programs are that this package starts, and how they end with it."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess

from .errors import NotFound

# A shell script that starts "$@" and ends it when this process is gone, however it ended: then nobody holds the other end of the pipe.
KEEPER = '"$@" </dev/null & program=$!; exec >&- 2>&-; read -r _; kill "$program"; wait "$program"'


def end_keeper(keeper: subprocess.Popen[bytes], seconds: float) -> bool:
    """Ends what a KEEPER with pipes for input and output keeps. False: it took longer, so the keeper was killed."""
    assert keeper.stdin is not None and keeper.stdout is not None
    keeper.stdin.close()
    try:
        keeper.wait(seconds)
        ended = True
    except subprocess.TimeoutExpired:
        keeper.kill()
        keeper.wait()
        ended = False
    keeper.stdout.close()
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
