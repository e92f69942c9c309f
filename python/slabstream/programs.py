"""Where the programs are that this package starts."""
from __future__ import annotations

import os
import pathlib
import shutil

from .errors import NotFound


def find_program() -> str:
    """`slabstream`, in the folder $SLABSTREAM_PROGRAMS, on the path, or in the build of the sources that this package is part of."""
    folder = os.environ.get("SLABSTREAM_PROGRAMS")
    if folder:
        program = shutil.which("slabstream", path=folder)
        if program is None:
            raise NotFound(f"$SLABSTREAM_PROGRAMS is '{folder}', which has no program slabstream")
        return program
    built = pathlib.Path(__file__).resolve().parents[2] / "build" / "bin"
    found = shutil.which("slabstream") or shutil.which("slabstream", path=str(built))
    if found is None:
        raise NotFound("there is no program slabstream to start a service with: put it on the path, name its folder in $SLABSTREAM_PROGRAMS, "
                       "or connect() to a service that runs")
    return found
