"""The programs, for wheels that hold them (deploy/wheels): the package's folder has them, with the libraries that they load.

A package of its own, since importing `slabstream` takes longer than most commands.
"""
from __future__ import annotations

import functools
import os
import pathlib
import sys


def run(name: str) -> None:
    """Becomes the program, with the arguments of this process."""
    program = str(pathlib.Path(__file__).with_name(name))
    os.execv(program, [program, *sys.argv[1:]])


slabstream = functools.partial(run, "slabstream")
coordinator = functools.partial(run, "slabstream-coordinator")
worker = functools.partial(run, "slabstream-worker")
gateway = functools.partial(run, "slabstream-gateway")
