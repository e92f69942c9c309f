"""Arrays and files as volumes of a service on this machine: load() and render()."""
from __future__ import annotations

import contextlib
import itertools
import os
import pathlib
import re
import secrets
import tempfile
import weakref
from typing import TYPE_CHECKING, Any, Callable, Iterator

from .address import is_address
from .drafts import draft_of
from .errors import InvalidArgument, NotFound, SlabstreamError, Unavailable
from .frame import Frame
from .image import Image
from .local import lock, running
from .options import takes_options_of
from .service import Service
from .viewer import VIEWER_OPTIONS, Viewer
from .volumes import Grid, check_spacing, is_xarray, labels_of, on_grid, volume_of, write_nrrd
from .volumes import Volume as VolumeData

if TYPE_CHECKING:
    from .widget import Widget

_TAKE_AWAY_SECONDS = 5.0


class Volume(contextlib.AbstractContextManager["Volume"]):
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
    def turntable(self, frames: int | None = None, **options: Any) -> Iterator[Image]:
        """As Service.turntable."""
        return self.service.turntable(self.name, frames, **self._shows | options)

    @takes_options_of("render")
    def view(self, **options: Any) -> Widget | Viewer:
        """As Service.view."""
        return self.service.view(self.name, keep=self, **self._shows | options)

    @takes_options_of("slice")
    def slice(self, **options: Any) -> Image:
        """As Service.slice."""
        return self.service.slice(self.name, **self._shows | options)

    def __exit__(self, *error: object) -> None:
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


def path_text(path: Any, what: str) -> str:
    """Absolute; options for reading may stand behind a question mark. Addresses ("https://host/scan.ome.zarr") are as they are."""
    text = str(os.fspath(path))
    if is_address(text):
        return text
    file = text if os.path.exists(text) else text.partition("?")[0]
    if what == "labels" and not os.path.exists(file):
        file = file.rpartition(":")[0] or file  # FILE:COLOURS
    if not os.path.exists(file):
        raise NotFound(f"{what} '{file}' does not exist")
    return os.path.abspath(file) + text[len(file):]


_numbers = itertools.count(2)
_given: set[str] = set()  # names


def _name_of(volume: Any, service: Service | None) -> str:
    """A dataset's name, which nothing else has had: that of the file or the xarray, or what it is. `service`: others may use it, too."""
    if _is_path(volume):
        own = os.path.basename(str(os.fspath(volume)).partition("?")[0].rstrip("/"))
    elif is_xarray(volume) and volume.name:
        own = str(volume.name)
    else:
        own = "array" if hasattr(volume, "shape") else type(volume).__name__
    name = given = re.sub("[^a-zA-Z0-9._-]+", "-", own)[:64] or "volume"
    if service is not None:
        return f"{name}-{secrets.token_hex(3)}"
    with lock:
        while given in _given:
            given = f"{name}-{next(_numbers)}"
        _given.add(given)
    return given


def load(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None, labels: Any = None,
         overlay: Any = None, service: Service | None = None) -> Volume:
    """Brings a volume to a service, for any number of pictures.

    `volume` is a path or an address of any format that slabstream reads, or an array of z, y, x: numpy, dask, zarr, h5py, torch, jax,
    xarray.DataArray, an image of nibabel, ITK, SimpleITK or VTK, a list of pydicom datasets. `spacing` and `origin` are z, y, x too, or
    `spacing` one number for all axes; row i of `direction` is where the array's axis i points to, as z, y, x of the world; `world` is
    "scene" or "patient" (x to the right, y to anterior, z to superior; mm). `labels` and `overlay` are volumes on the same grid, or paths.
    `service`: one that takes data: arrays are sent to it, wherever it runs; files are read there;
    None: one of this process' own, which is started if need be and ends with it.
    """
    given = [layer for layer in (labels, overlay) if layer is not None]
    shows = {what: True for what, layer in (("labels", labels), ("overlay", overlay)) if layer is not None}
    name = _name_of(volume, service)
    if service is not None and not any(map(_is_path, (volume, *given))):
        service.add(name, volume, spacing=spacing, origin=origin, direction=direction, world=world, labels=labels, overlay=overlay)
        return Volume(service, name, shows, [])
    own = None if service is not None else running()
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
            text = path_text(volume, "volume")
            for field, value in (("origin", origin), ("direction", direction), ("world", world)):
                if value is not None:
                    raise InvalidArgument(f"{field} is for arrays; files state their own")
            if spacing is not None:
                dz, dy, dx = check_spacing(spacing)
                text += f"{',' if '?' in text else '?'}spacing={dx},{dy},{dz}"
        else:
            checked = volume_of(volume, spacing, origin, direction, world)
            grid = checked.grid
            text = written(checked)
        for what, layer in (("labels", labels), ("overlay", overlay)):
            if layer is not None:
                if _is_path(layer):
                    path = path_text(layer, what)
                else:
                    path = written(on_grid(labels_of(layer) if what == "labels" else volume_of(layer), grid))
                text += f",{what}={path}"
        where.add_data(f"{name}={text}")
    except BaseException:
        for file in files:
            file.unlink(missing_ok=True)
        raise
    return Volume(where, name, shows, files)


def _check(options: dict[str, Any], others: tuple[str, ...]) -> None:
    """A wrong option is refused before a service is started, or anything is written for it. `others`: that are none of pictures."""
    draft_of("volume", {name: value for name, value in options.items() if name not in others})


@takes_options_of("render")
def render(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None, labels: Any = None,
           overlay: Any = None, service: Service | None = None, **options: Any) -> Image:
    """A picture of an array or a file: load() and render() in one. For several pictures of one array, load() it once. Files stay loaded, and
    are read again when they change."""
    _check(options, ("deadline",))
    given: dict[str, Any] = {"spacing": spacing, "origin": origin, "direction": direction, "world": world, "labels": labels,
                             "overlay": overlay, "service": service}
    if service is None and all(layer is None or _is_path(layer) for layer in (volume, labels, overlay)):
        with lock:
            kept = running().kept
            key = repr((os.getcwd(), volume, given))
            if key not in kept:
                kept[key] = load(volume, **given)
            loaded: Volume = kept[key]
        return loaded.render(**options)
    with load(volume, **given) as loaded:
        return loaded.render(**options)


@takes_options_of("render")
def view(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None, world: str | None = None, labels: Any = None,
         overlay: Any = None, service: Service | None = None, **options: Any) -> Widget | Viewer:
    """The viewer of an array or a file, for a notebook: load() and Volume.view() in one, with the arguments of Service.view(). `volume` may also
    be a Volume. It stays loaded until the viewer is closed."""
    _check(options, VIEWER_OPTIONS)
    loaded = volume if isinstance(volume, Volume) else load(volume, spacing=spacing, origin=origin, direction=direction, world=world, labels=labels,
                                                            overlay=overlay, service=service)
    return loaded.view(**options)
