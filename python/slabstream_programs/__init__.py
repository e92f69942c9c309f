"""The programs, for wheels that hold them (deploy/wheels): the package's folder has them, with the libraries that they load.

A package of its own, since importing `slabstream` takes longer than most commands.
"""
from __future__ import annotations

import os
import pathlib
import sys


def run(name: str) -> None:
    """Becomes the program, with the arguments of this process."""
    program = str(pathlib.Path(__file__).with_name(name))
    os.execv(program, [program, *sys.argv[1:]])


def slabstream() -> None:
    run("slabstream")


def coordinator() -> None:
    run("slabstream-coordinator")


def worker() -> None:
    run("slabstream-worker")


def gateway() -> None:
    run("slabstream-gateway")
