"""Writes arrays of bytes as an OME-Zarr: what the other scripts of this folder share."""
import json
import pathlib
import zlib

import numpy

CHUNK = 64


def write(path, times, spacing, unit, channels, seconds=1.0):
    """`times`: for each time an array (channel, z, y, x) of uint8. `spacing`: of z, y, x. `channels`: name, colour "rrggbb", low and high value."""
    root = pathlib.Path(path)
    (root / "0").mkdir(parents=True, exist_ok=True)
    for t, volume in enumerate(times):
        volume = numpy.ascontiguousarray(volume, numpy.uint8)
        if t == 0:
            shape = volume.shape
        for at in numpy.ndindex(shape[0], *(-(-n // CHUNK) for n in shape[1:])):
            part = volume[at[0]][tuple(slice(CHUNK * i, CHUNK * (i + 1)) for i in at[1:])]
            whole = numpy.zeros((CHUNK,) * 3, numpy.uint8)
            whole[tuple(map(slice, part.shape))] = part
            (root / "0" / ".".join(map(str, (t, *at)))).write_bytes(zlib.compress(whole.tobytes()))
    names = [("t", "time", "second"), ("c", "channel", None)] + [(axis, "space", unit) for axis in "zyx"]
    axes = [{"name": name, "type": kind, **({"unit": of} if of else {})} for name, kind, of in names]
    scale = [{"type": "scale", "scale": [seconds, 1, *spacing]}]
    omero = [{"label": name, "color": color, "window": {"start": low, "end": high}} for name, color, low, high in channels]
    attributes = {"multiscales": [{"version": "0.4", "axes": axes, "datasets": [{"path": "0", "coordinateTransformations": scale}]}],
                  "omero": {"channels": omero}}
    array = {"zarr_format": 2, "shape": [t + 1, *shape], "chunks": [1, 1, CHUNK, CHUNK, CHUNK], "dtype": "|u1", "order": "C",
             "compressor": {"id": "zlib", "level": 6}, "fill_value": 0, "filters": None}
    for name, value in ((".zgroup", {"zarr_format": 2}), (".zattrs", attributes), ("0/.zarray", array)):
        (root / name).write_text(json.dumps(value, indent=1))


def blurred(volume, sigma):
    """By a Gaussian of `sigma` voxels along each axis; the volume's ends are joined."""
    filtered = numpy.fft.rfftn(volume)
    for axis, n in enumerate(volume.shape):
        f = numpy.fft.rfftfreq(n) if axis == volume.ndim - 1 else numpy.fft.fftfreq(n)
        filtered *= numpy.exp(-2 * (numpy.pi * sigma * f) ** 2).reshape([-1 if a == axis else 1 for a in range(volume.ndim)])
    return numpy.fft.irfftn(filtered, volume.shape)


def noise(random, shape, sigma):
    """Smooth noise of mean 0 and deviation 1, with grains of about `sigma` voxels."""
    made = blurred(random.standard_normal(shape), sigma)
    return (made - made.mean()) / made.std()
