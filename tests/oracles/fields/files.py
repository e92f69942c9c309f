"""Files of several channels and times by ome-zarr and tifffile, and volumes with a turned overlay by SimpleITK."""
import dataclasses
import os

import numpy as np
import SimpleITK
import tifffile
import zarr
from ome_zarr.format import FormatV04, FormatV05
from ome_zarr.writer import write_multiscale

# Names that need a `\`, that are numbers of other channels, or that are no ASCII.
NAMES = ["DAPI", "Actin", "GFP 2", "x,y=1", "back\\slash", "2", "0", "µ-tubulin", "a" * 200]
PLATEAU = 2  # slices of equal values: the largest value of a ray then does not depend on where its samples are


@dataclasses.dataclass
class Case:
    """`voxels`: t, c, z, y, x. `spacing`: x, y, z. What the file does not say of a channel is None or "", and `shown` of all is True."""
    name: str
    path: str
    voxels: np.ndarray
    spacing: list
    time_step: float
    names: list
    colours: list
    windows: list
    shown: list


@dataclasses.dataclass
class Overlay:
    name: str
    path: str
    image: SimpleITK.Image
    overlay_path: str
    overlay: SimpleITK.Image


def some(random, dtype):
    """Voxels of few times and channels; spacing."""
    times, channels, z, y, x = (int(random.integers(*ends)) for ends in ((2, 5), (2, 6), (2, 5), (5, 14), (5, 14)))
    shape = (times, channels, z, y, x)
    array = random.normal(scale=100, size=shape) if np.dtype(dtype).kind == "f" else random.integers(0, np.iinfo(dtype).max, shape, endpoint=True)
    across = float(random.choice([0.25, 0.5, 2]))
    return np.repeat(array.astype(dtype), PLATEAU, axis=2), [across, across, across * float(random.choice([1, 2]))]


def looks(random, voxels):
    """Names, colours and windows, one of each channel."""
    count = voxels.shape[1]
    low, high = float(voxels.min()), float(voxels.max())
    windows = [tuple(sorted(np.round(random.uniform(low, high, 2), 2).tolist())) for _ in range(count)]
    return random.permutation(NAMES)[:count].tolist(), random.integers(0, 256, (count, 3)), windows


def hexadecimal(colour):
    return "#" + bytes(colour.tolist()).hex()


def ome_zarr(random, folder, number):
    voxels, spacing = some(random, random.choice(["uint8", "uint16", "int16", "float32"]))
    names, colours, windows = looks(random, voxels)
    shown = (random.random(len(names)) < 0.6).tolist()
    shown[int(random.integers(len(shown)))] = True
    version, step = ("0.4", "0.5")[number % 2], float(random.choice([0.5, 2.5, 60]))
    path = os.path.join(folder, f"{number}.ome.zarr")
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    axes = [{"name": "t", "type": "time", "unit": "second"}, {"name": "c", "type": "channel"}]
    axes += [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]
    looks_of = [{"label": name, "color": hexadecimal(colour)[1:].upper(), "active": active,
                 "window": {"start": window[0], "end": window[1], "min": -1e5, "max": 1e5}}
                for name, colour, active, window in zip(names, colours, shown, windows)]
    write_multiscale([voxels], group=group, fmt=FormatV04() if version == "0.4" else FormatV05(), axes=axes,
                     coordinate_transformations=[[{"type": "scale", "scale": [step, 1.0, *spacing[::-1]]}]],
                     storage_options={"chunks": (1, int(random.integers(1, 3)), 4, 4, 4)}, metadata={"omero": {"channels": looks_of}})
    return Case(f"ome-zarr {version} {voxels.dtype}", path, voxels, spacing, step, names, [hexadecimal(c) for c in colours], windows, shown)


def ome_tiff(random, folder, number):
    voxels, spacing = some(random, random.choice(["uint8", "uint16", "float32"]))
    names, colours, _ = looks(random, voxels)
    order, step = str(random.choice(["TCZYX", "TZCYX", "CTZYX", "ZTCYX"])), float(random.choice([0.5, 2.5, 60]))
    path = os.path.join(folder, f"{number}.ome.tif")
    packed = [int(np.int32(np.uint32(int.from_bytes(bytes([*colour.tolist(), 255]), "big")).view(np.int32))) for colour in colours]
    metadata = {"axes": order, "TimeIncrement": step, "TimeIncrementUnit": "s", "Channel": {"Name": names, "Color": packed}}
    metadata |= {f"PhysicalSize{axis}": length for axis, length in zip("XYZ", spacing)}
    tifffile.imwrite(path, voxels.transpose(["TCZYX".index(axis) for axis in order]), ome=True, photometric="minisblack", metadata=metadata)
    count = len(names)
    return Case(f"OME-TIFF {order} {voxels.dtype}", path, voxels, spacing, step, names, [hexadecimal(c) for c in colours], [None] * count,
                [True] * count)


def imagej(random, folder, number):
    """A composite hyperstack."""
    voxels, spacing = some(random, random.choice(["uint8", "uint16", "float32"]))
    _, colours, windows = looks(random, voxels)
    colours = [np.where(random.random(3) < 0.5, 255, 0) for _ in colours]  # whose tables are ramps
    colours = [colour if colour.any() else np.array([255, 255, 255]) for colour in colours]
    step = float(random.choice([0.5, 2.5, 60]))
    tables = [np.outer(colour / 255, np.arange(256)).astype(np.uint8) for colour in colours]
    path = os.path.join(folder, f"{number}.tif")
    metadata = {"axes": "TZCYX", "mode": "composite", "spacing": spacing[2], "unit": "um", "finterval": step, "LUTs": tables,
                "Ranges": tuple(end for window in windows for end in window)}
    tifffile.imwrite(path, voxels.transpose(0, 2, 1, 3, 4), imagej=True, resolution=(1 / spacing[0], 1 / spacing[1]), metadata=metadata)
    count = len(windows)
    return Case(f"ImageJ {voxels.dtype}", path, voxels, spacing, step, [""] * count, [hexadecimal(c) for c in colours], windows, [True] * count)


def overlay(random, folder, number):
    """A turned volume, and a volume that is turned, too, or is not: where they lie is SimpleITK's affair."""
    paths, images = [], []
    for name in ("volume", "overlay"):
        image = SimpleITK.GetImageFromArray(random.normal(scale=100, size=tuple(random.integers(4, 12, 3))).astype(np.float32))
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        spacing = random.uniform(0.5, 3, 3)
        if number % 2 == 0 and name == "volume":  # whose slices are pictures without gaps
            turn, spacing[1] = np.eye(3), spacing[0]
        image.SetDirection((turn * np.sign(np.linalg.det(turn))).ravel().tolist())
        image.SetSpacing(spacing.tolist())
        image.SetOrigin(random.normal(scale=20, size=3).tolist())
        centre = image.TransformContinuousIndexToPhysicalPoint([(side - 1) / 2 for side in image.GetSize()])
        image.SetOrigin((np.array(image.GetOrigin()) - centre + random.normal(scale=2, size=3)).tolist())
        paths.append(os.path.join(folder, f"{name}-{number}{random.choice(['.nrrd', '.mha', '.nii.gz'])}"))
        SimpleITK.WriteImage(image, paths[-1])
        images.append(SimpleITK.ReadImage(paths[-1]))  # NIfTI rounds its place
    return Overlay(os.path.basename(paths[0]) + " and " + os.path.basename(paths[1]), paths[0], images[0], paths[1], images[1])


FAMILIES = {"ome-zarr": ome_zarr, "ome-tiff": ome_tiff, "imagej": imagej, "overlay": overlay}
