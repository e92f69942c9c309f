"""slabstream-lab: the page of an experiment."""
from __future__ import annotations

import argparse
import os
import pathlib
import sys

from . import page
from .experiments import PAGES
from .results import ResultsError, read


def main(arguments: list[str] | None = None) -> int:
    try:
        try:
            return draw(arguments)
        finally:
            if sys.stdout:
                sys.stdout.flush()
    except OSError as error:
        print(f"slabstream-lab: standard output cannot be written: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python writes what is left once more when it ends
        return 1


def draw(arguments: list[str] | None) -> int:
    parser = argparse.ArgumentParser(
        prog="slabstream-lab",
        description="Draw the page of an experiment: FOLDER/report.html and FOLDER/plots, from its results.",
    )
    parser.add_argument("folders", metavar="FOLDER", nargs="+", type=pathlib.Path, help="the folder that -o of `slabstream experiment` named")
    options = parser.parse_args(arguments)
    for folder in options.folders:
        try:
            run = read(folder)
            name = run.info["experiment"]
            if name not in PAGES:
                raise ResultsError(f"'{folder}' holds experiment '{name}', for which there is no page (there is one for {', '.join(PAGES)})")
            drawn = PAGES[name](run)
            path = page.write(drawn, run, folder)
        except (ResultsError, OSError) as error:
            print(f"slabstream-lab: {error}", file=sys.stderr)
            return 1
        for doubt in page.doubts(run):
            print(f"Doubt: {doubt}")
        for section in drawn.sections:
            if section.answer:
                print(f"{section.title}: {section.answer}")
        print(f"wrote {path}")
    return 0
