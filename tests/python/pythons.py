#!/usr/bin/env python3
"""Runs the tests of the Python client by one Python (deploy/check pythons).

    pythons.py 3.12 build/bin build-pythons [TEST...]

The package is installed into an environment in the folder: the oldest Python has the oldest packages that it may use, others have the newest
of PyPI, but 3.11 numpy 1. That takes 20 s, and the tests 100 s, of which they wait 25 s until services count as gone. The Python is python3.N
on the path, or the one of pyenv. One line tells what was found. Exit status 1: a test failed; 77: there is no such Python here, or
PyPI has no packages for it.
"""
from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = {
    "3.9": ["numpy==1.23.*", "pyzmq==22.*", "protobuf==3.20.*"],  # python/pyproject.toml promises these
    "3.11": ["numpy<2"],
}
LEFT_OUT = ("client_types", "client_notebook")  # are the same for each, and want packages of their own


def find(version: str) -> str | None:
    pyenv = pathlib.Path(os.environ.get("PYENV_ROOT", pathlib.Path.home() / ".pyenv"))
    for python in (shutil.which(f"python{version}"), *map(str, pyenv.glob(f"versions/{version}.*/bin/python{version}"))):
        # A name of pyenv's on the path may lead nowhere.
        if python and subprocess.run([python, "-m", "venv", "--help"], capture_output=True).returncode == 0:
            return python
    return None


def installed(python: str, place: pathlib.Path, packages: list[str]) -> str | None:
    """The environment's Python; None: PyPI has no wheels of these packages for it, or is not reached."""
    shutil.rmtree(place, ignore_errors=True)
    source = place.with_name("source")
    shutil.copytree(ROOT / "python", source, dirs_exist_ok=True)
    subprocess.run([python, "-m", "venv", str(place)], check=True)
    own = str(place / "bin" / "python")
    pip = [own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if subprocess.run([*pip, "--only-binary=:all:", *packages, "pyzmq", "protobuf"], capture_output=True).returncode != 0:
        return None
    subprocess.run([*pip, str(source)], check=True)
    return own


def run(own: str, tests: list[pathlib.Path], environment: dict[str, str], log: pathlib.Path) -> tuple[int, int, list[str]]:
    """Tests that ran, tests that were skipped, and the programs that failed."""
    ran, skipped, failed = 0, 0, []
    with log.open("w") as told:
        for test in tests:
            done = subprocess.run([own, "-B", str(test)], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            told.write(f"== {test.name}\n{done.stdout}")
            ran += sum(map(int, re.findall(r"^Ran (\d+) test", done.stdout, re.MULTILINE)))
            skipped += sum(map(int, re.findall(r"skipped=(\d+)", done.stdout)))
            if done.returncode != 0:
                failed.append(test.stem)
    return ran, skipped, failed


def main() -> int:
    version, programs, folder, *chosen = sys.argv[1:]
    python = find(version)
    if python is None:
        return 77
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(exist_ok=True)
    tests = [test for test in sorted(ROOT.glob("tests/python/*_test.py"))
             if (test.stem.startswith("client_") or test.stem == "documents_test") and test.stem.removesuffix("_test") not in LEFT_OUT
             and (not chosen or test.stem in chosen)]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SLABSTREAM_"))}
    environment |= {"SLABSTREAM_INSTALLED": "1", "SLABSTREAM_PROGRAMS": str(pathlib.Path(programs).resolve())}
    own = installed(python, folder / version, PACKAGES.get(version, ["numpy>=2"]))
    if own is None:
        return 77
    about = "import platform, google.protobuf as protobuf, numpy, zmq, slabstream\n" \
            "print('Python', platform.python_version(), *(f'{one.__name__} {one.__version__}' for one in (numpy, zmq, protobuf)))"
    said = subprocess.run([own, "-c", about], env=environment, check=True, capture_output=True, text=True).stdout.strip()
    begin = time.monotonic()
    log = folder / f"{version}.log"
    ran, skipped, failed = run(own, tests, environment, log)
    verdict = f"FAILED: {', '.join(failed)} ({log})" if failed else "passed"
    print(f"{said}: {ran} tests, {skipped} of them skipped, {time.monotonic() - begin:.0f} s: {verdict}", flush=True)
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
