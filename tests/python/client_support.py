"""For the tests of the Python client: a service of two workers, a volume with layers, and pictures of the command line."""
from __future__ import annotations

import contextlib
import json
import os
import pathlib
import select
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
if "SLABSTREAM_INSTALLED" not in os.environ:  # else the package that this Python has (pythons.py)
    sys.path.insert(0, str(ROOT / "python"))

PROGRAMS = pathlib.Path(os.environ.get("SLABSTREAM_PROGRAMS", ROOT / "build" / "bin"))
os.environ["SLABSTREAM_PROGRAMS"] = str(PROGRAMS)
PROGRAM = str(PROGRAMS / "slabstream")

from slabstream import volumes  # noqa: E402

signal.signal(signal.SIGINT, signal.default_int_handler)  # where this runs in a shell's background, it and its children would ignore it

START_SECONDS = 60
HEAVY = dict(renderer="raycast", sampling_rate=16, size=2000, opacity_distance=1000, termination=0)  # options of a frame that takes seconds


def volume_arrays() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A head that has no symmetry, its labels 1 to 3 and a map of values; z, y, x."""
    z, y, x = np.meshgrid(np.linspace(-1, 1, 20), np.linspace(-1, 1, 24), np.linspace(-1, 1, 28), indexing="ij")
    radius = np.sqrt(x**2 + (1.2 * y) ** 2 + z**2)
    bump = np.exp(-8 * ((x - 0.6) ** 2 + (y + 0.4) ** 2 + (z - 0.3) ** 2))
    values = np.clip(220 * (1 - radius) + 150 * bump, 0, 255).astype(np.uint8)
    labels = np.where(values > 20, 1 + (x > 0) + (z > 0), 0).astype(np.uint8)
    return values, labels, np.where(values > 20, bump, np.nan).astype(np.float32)


def write_volumes(folder: pathlib.Path) -> str:
    """Argument of --data: a patient's volume with layers, named head."""
    grid = dict(spacing=(2, 1.5, 1.25), origin=(-10, 5, 20), direction=((1, 0, 0), (0, 1, 0), (0, 0, 1)), world="patient")
    for name, array in zip(("head", "labels", "overlay"), volume_arrays()):
        volumes.write_nrrd(volumes.volume_of(array, **grid), folder / f"{name}.nrrd")
    (folder / "names.txt").write_text("1 left_1 200 60 40 0\n2 left_2 60 190 130 0\n3 right_2 50 100 255 0\n")
    return f"head={folder}/head.nrrd,labels={folder}/labels.nrrd:{folder}/names.txt,overlay={folder}/overlay.nrrd"


def write_cells(folder: pathlib.Path) -> pathlib.Path:
    """An OME-Zarr of two channels, "DAPI" and "Actin", at three times, 2.5 s apart: a ball in each, which moves."""
    path, size = folder / "cells.ome.zarr", 16
    (path / "0").mkdir(parents=True)
    axes = [{"name": "t", "type": "time", "unit": "second"}, {"name": "c", "type": "channel"}]
    axes += [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]
    places = [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [2.5, 1, 1, 1, 1]}]}]
    looks = [{"label": "DAPI", "color": "0000FF", "active": True, "window": {"start": 0, "end": 200, "min": 0, "max": 65535}},
             {"label": "Actin", "color": "FF8000", "active": True, "window": {"start": 0, "end": 1000, "min": 0, "max": 65535}}]
    about = {"multiscales": [{"version": "0.4", "axes": axes, "datasets": places}], "omero": {"channels": looks}}
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    (path / ".zattrs").write_text(json.dumps(about))
    array = {"zarr_format": 2, "shape": [3, 2, size, size, size], "chunks": [1, 1, size, size, size], "dtype": "<u2", "compressor": None,
             "fill_value": 0, "order": "C", "filters": None, "dimension_separator": "."}
    (path / "0" / ".zarray").write_text(json.dumps(array))
    z, y, x = np.mgrid[:size, :size, :size]
    for time in range(3):
        for channel, (strongest, centre) in enumerate([(200, 4), (1000, 9)]):
            ball = strongest * np.exp(-((x - centre - time) ** 2 + (y - 8) ** 2 + (z - 8) ** 2) / 20)
            (path / "0" / f"{time}.{channel}.0.0.0").write_bytes(ball.astype("<u2").tobytes())
    return path


class RunningService:
    """`slabstream up` with two workers in a folder of its own; ended by end()."""

    def __init__(self, folder: pathlib.Path, *arguments: str, listen: str | None = None):
        self.folder = folder
        self.environment = {name: value for name, value in os.environ.items() if not name.startswith("SLABSTREAM_")}
        self.environment["XDG_RUNTIME_DIR"] = str(folder)
        with (folder / "up.errors").open("wb") as errors:
            self.process = subprocess.Popen(
                [PROGRAM, "up", "--workers", "2", "--listen", listen or f"ipc://{folder}/s", *arguments],
                stdout=subprocess.PIPE, stderr=errors, stdin=subprocess.DEVNULL, env=self.environment,
            )
        said = b""
        while b"Ctrl-C" not in said:
            ready = select.select([self.process.stdout], [], [], START_SECONDS)[0]
            part = os.read(self.process.stdout.fileno(), 4096) if ready else b""
            if not part:
                raise RuntimeError(f"slabstream up: {(folder / 'up.errors').read_text()}")
            said += part
        words = said.decode().split()
        self.endpoint = words[4]
        self.coordinator = int(words[words.index("(coordinator") + 2].rstrip(","))

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(timeout=START_SECONDS)
        self.process.stdout.close()

    def run(self, *arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, env=self.environment, cwd=self.folder, timeout=300)

    def picture(self, command: str, *arguments: str, dataset: str = "head") -> np.ndarray:
        """The command line's PNG."""
        done = self.run(command, dataset, "-o", "picture.png", "--endpoint", self.endpoint, *arguments)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return read_png((self.folder / "picture.png").read_bytes())


@contextlib.contextmanager
def working_in(folder: pathlib.Path):
    """As contextlib.chdir of Python 3.11."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


class InAFolder(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory(prefix="slabstream-test-")
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)


class WithAService(unittest.TestCase):
    """One service for all tests of a class."""

    @classmethod
    def setUpClass(cls) -> None:
        stack = contextlib.ExitStack()
        cls.addClassCleanup(stack.close)
        cls.folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="slabstream-test-")))
        cls.running = RunningService(cls.folder, "--data", write_volumes(cls.folder))
        stack.callback(cls.running.end)


def read_png(content: bytes) -> np.ndarray:
    """Height, width, 4, of uint8 or uint16: any PNG with RGBA, without interlacing."""
    at, packed = 8, b""
    while at < len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        chunk = content[at + 8 : at + 8 + length]
        if zlib.crc32(kind + chunk) != struct.unpack_from(">I", content, at + 8 + length)[0]:
            raise ValueError(f"chunk {kind!r} is damaged")
        if kind == b"IHDR":
            width, height, bits, color, *rest = struct.unpack(">IIBBBBB", chunk)
            assert color == 6 and rest == [0, 0, 0]
        elif kind == b"IDAT":
            packed += chunk
        at += 12 + length
    step = bits // 2  # bytes of a pixel
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + step * width)
    found = np.zeros((height + 1, step * (width + 1)), np.int64)  # a row above and a pixel to the left, of zeros
    for y, (kind, *row) in enumerate(rows.tolist(), 1):
        line, above = found[y], found[y - 1]
        for x, byte in enumerate(row, step):
            left, up, corner = int(line[x - step]), int(above[x]), int(above[x - step])
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda v: abs(guess - v))
            line[x] = (byte + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
    codes = found[1:, step:].astype(np.uint8).reshape(height, width, step)
    return codes if bits == 8 else np.ascontiguousarray(codes).view(">u2").astype(np.uint16)
