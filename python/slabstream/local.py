"""Arrays and files, rendered by a service of this process' own: load(), render() and shutdown()."""
from __future__ import annotations

import atexit
import itertools
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import threading
import time
import types
import weakref
from typing import Any, Callable, Iterator

from .address import Address
from .connection import Connection
from .errors import InvalidArgument, NotFound, SlabstreamError, Unavailable
from .frame import Frame
from .image import Image
from .options import takes_options_of
from .service import Service
from .volumes import Grid, check_spacing, on_grid, volume_of, write_nrrd
from .volumes import Volume as VolumeData

_START_SECONDS = 60.0
_END_SECONDS = 20.0
_TAKE_AWAY_SECONDS = 5.0
_MOST_FOLDER_BYTES = 50  # of temporary files: paths of sockets have at most 107, with names of ours and of workers behind it

# Starts the service in its folder, and ends both when this process is gone, however it ended: then nobody holds the other end of the pipe.
_KEEPER = '"$@" </dev/null & service=$!; exec >&- 2>&-; read -r _; kill "$service"; wait "$service"; rm -rf -- "$0"'


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


class _LocalService:
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
        self.volumes: dict[str, Volume] = {}  # files that render() was given

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
        assert self.keeper.stdin is not None and self.keeper.stdout is not None
        self.keeper.stdin.close()
        try:
            self.keeper.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            self.keeper.kill()
            self.keeper.wait()
            shutil.rmtree(self.folder, ignore_errors=True)
        self.keeper.stdout.close()


_lock = threading.RLock()
_local: _LocalService | None = None


def _running() -> _LocalService:
    """The service of this process; it is started if there is none, or if it has gone."""
    global _local
    with _lock:
        if _local is not None and _local.process == os.getpid():
            try:
                _local.service.status()
            except SlabstreamError:
                _local.end()
                _local = None
        if _local is None or _local.process != os.getpid():
            _local = _LocalService()
        return _local


def shutdown() -> None:
    """Ends the service that load() and render() started, if there is one. The next call starts another. It also ends with the interpreter."""
    global _local
    with _lock:
        ended, _local = _local, None
        if ended is not None:
            ended.end()


atexit.register(shutdown)


class Volume:
    """A volume at a service, made by load(). A context manager: leaving it takes the volume away again."""

    def __init__(self, service: Service, name: str, shows: dict[str, Any], files: list[pathlib.Path]):
        self.service, self.name = service, name
        self._shows = shows  # layers: options that are given unless the caller says otherwise
        self.close: Callable[[], Any] = weakref.finalize(self, _take_away, service, name, files, os.getpid())

    @takes_options_of("render")
    def render(self, **options: Any) -> Image:
        """A picture of the volume."""
        return self.service.render(self.name, **self._shows | options)

    @takes_options_of("render")
    def submit(self, **options: Any) -> Frame:
        """As Service.submit."""
        return self.service.submit(self.name, **self._shows | options)

    @takes_options_of("render")
    def turntable(self, frames: int, **options: Any) -> Iterator[Image]:
        """As Service.turntable."""
        return self.service.turntable(self.name, frames, **self._shows | options)

    @takes_options_of("slice")
    def slice(self, **options: Any) -> Image:
        """As Service.slice."""
        return self.service.slice(self.name, **self._shows | options)

    def __enter__(self) -> Volume:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<slabstream.Volume {self.name} at {self.service.endpoint}>"


def _take_away(service: Service, name: str, files: list[pathlib.Path], process: int) -> None:
    if os.getpid() != process:
        return  # a forked child's copy
    try:
        service.remove_data(name, timeout=_TAKE_AWAY_SECONDS)
    except SlabstreamError:
        pass  # it went with its service
    for file in files:
        file.unlink(missing_ok=True)


def _is_path(volume: Any) -> bool:
    return isinstance(volume, (str, os.PathLike))


def _path_text(path: Any, what: str) -> str:
    """Absolute; options for reading may stand behind a question mark."""
    text = str(os.fspath(path))
    file = text if os.path.exists(text) else text.partition("?")[0]
    if what == "labels" and not os.path.exists(file):
        file = file.rpartition(":")[0] or file  # FILE:COLOURS
    if not os.path.exists(file):
        raise NotFound(f"{what} '{file}' does not exist")
    return os.path.abspath(file) + text[len(file):]


def load(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None, labels: Any = None,
         overlay: Any = None, service: Service | None = None) -> Volume:
    """Brings a volume to a service on this machine, for any number of pictures.

    `volume` is a path of any format that slabstream reads, or an array of z, y, x: numpy, dask, zarr, h5py, xarray.DataArray, an image of
    nibabel, a list of pydicom datasets. `spacing` and `origin` are z, y, x too; row i of `direction` is where the array's axis i points to,
    as z, y, x of the world; `world` is "scene" or "patient" (x to the right, y to anterior, z to superior; mm). `labels` and `overlay` are
    volumes on the same grid, or paths. `service`: one on this machine that takes data; None: one of this process' own, which is started if
    need be and ends with it.
    """
    own = None if service is not None else _running()
    where = service if service is not None else own.service  # type: ignore[union-attr]
    grid: Grid | None = None  # of a volume that is no file: that of its layers too, unless they state their own
    folder = own.folder if own is not None else pathlib.Path(tempfile.gettempdir())
    files: list[pathlib.Path] = []

    def written(checked: VolumeData) -> str:
        handle, name = tempfile.mkstemp(prefix=".slabstream-", suffix=".nrrd", dir=folder)
        os.close(handle)
        files.append(pathlib.Path(name))
        try:
            write_nrrd(checked, name)
        except OSError as error:
            raise Unavailable(f"cannot write '{name}': {error.strerror}") from None
        return name

    try:
        if _is_path(volume):
            text = _path_text(volume, "volume")
            for name, value in (("origin", origin), ("direction", direction), ("world", world)):
                if value is not None:
                    raise InvalidArgument(f"{name} is for arrays; files state their own")
            if spacing is not None:
                dz, dy, dx = check_spacing(spacing)
                text += f"{',' if '?' in text else '?'}spacing={dx},{dy},{dz}"
        else:
            checked = volume_of(volume, spacing, origin, direction, world)
            grid = checked.grid
            text = written(checked)
        for what, layer in (("labels", labels), ("overlay", overlay)):
            if layer is not None:
                path = _path_text(layer, what) if _is_path(layer) else written(on_grid(volume_of(layer), grid))
                text += f",{what}={path}"
        name = f"python-{os.getpid()}-{next(_numbers)}"
        where.add_data(f"{name}={text}")
    except BaseException:
        for file in files:
            file.unlink(missing_ok=True)
        raise
    shows = {what: True for what, layer in (("labels", labels), ("overlay", overlay)) if layer is not None}
    return Volume(where, name, shows, files)


_numbers = itertools.count(1)  # of volumes, for their names


@takes_options_of("render")
def render(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None, labels: Any = None,
           overlay: Any = None, service: Service | None = None, **options: Any) -> Image:
    """A picture of an array or a file: load() and render() in one. For several pictures of one array, load() it once. Files stay loaded, and
    are read again when they change."""
    given: dict[str, Any] = {"spacing": spacing, "origin": origin, "direction": direction, "world": world, "labels": labels,
                             "overlay": overlay, "service": service}
    if service is None and all(layer is None or _is_path(layer) for layer in (volume, labels, overlay)):
        with _lock:
            kept = _running().volumes
            key = repr((os.getcwd(), volume, given))
            if key not in kept:
                kept[key] = load(volume, **given)
            loaded = kept[key]
        return loaded.render(**options)
    with load(volume, **given) as loaded:
        return loaded.render(**options)
