"""HDF5 datasets of no layout by h5py, with the attributes of Fiji, ilastik, CREMI, TomoPy and h5py's dimension scales; NeXus by nexusformat
and by hand, as silx documents it. Axes of NeXus are those of silx."""
import json

import h5py
import nexusformat.nexus as nexus
import numpy as np
from silx.io.nxdata import NXdata

from ablation import Answer, Sample
from documents import JsonDocument
from hdf5_documents import Hdf5Document, Meanings

FOREIGN_READER_CRASHES = True
MEANINGS = Meanings(
    kinds={
        "NeXus_version": "comment", "nexusformat_version": "comment", "HDF5_Version": "comment", "h5py_version": "comment",
        "file_name": "comment", "file_time": "date", "creator": "comment", "start_time": "date", "h5_version": "comment",
        "experiment_identifier": "identifier", "description": "comment", "implements": "comment", "creator_version": "comment",
        "definition": "comment", "file_format": "comment", "display_mode": "comment"
    }, roles={
        "scaling_factor": "scale", "offset": "offset", "intensity_scaling_factor": "scale", "intensity_offset": "offset",
        "depth_scaling_factor": "spacing", "element_size_um": "spacing", "resolution": "spacing", "voxel_size": "spacing", "units": "unit"
    }, names={
        "signal": ("dataset",), "default": ("dataset",), "NX_class": ("dataset",), "axes": ("axis",), "NAME": ("scale",),
        "DIMENSION_LABELS": ("labels of dimensions", "axes"), "units": ("coordinates",), "unit": ("spacing",)
    }, words={
        "units": ("mm", "um", "nm", "m", ["um", "nm", "nm"]), "NX_class": ("NXdata", "NXentry", "NXcollection"),
        "CLASS": ("DIMENSION_SCALE", "IMAGE"), "interpretation": ("image", "spectrum", "rgba-image"), "key": ("x", "y", "z", "t", "c")
    })
METRES = {"m": 1, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}


class Axistags(JsonDocument):
    """The attribute axistags of a dataset, which holds JSON."""

    def __init__(self, path, name, dataset):
        self.path, self.name, self.dataset = path, name, dataset
        with h5py.File(path) as file:
            self.root = json.loads(file[dataset].attrs["axistags"])

    def save(self):
        with h5py.File(self.path, "r+") as file:
            file[self.dataset].attrs["axistags"] = json.dumps(self.root)


def samples_of(shape, dtype):
    return np.random.default_rng(11).integers(1, 120, shape).astype(dtype)


def exchange(path):
    """As TomoPy and DXchange write a reconstruction."""
    with h5py.File(path, "w") as file:
        file["implements"] = "exchange:measurement"
        file["exchange/data"] = samples_of((5, 6, 7), "u2")
        file["exchange/data"].attrs.update({"units": "counts", "description": "reconstruction", "axes": "z:y:x"})
        file["exchange/theta"] = np.linspace(0, 180, 5)
        file["exchange/theta"].attrs["units"] = "deg"
        file["measurement/sample/name"] = "a stone"
        file["measurement/instrument/detector/pixel_size"] = 0.65


def fiji(path):
    """As the HDF5 plugin of Fiji writes a stack with calibration."""
    with h5py.File(path, "w") as file:
        made = file.create_dataset("t0/channel0", data=samples_of((5, 6, 7), "u1"), chunks=(2, 3, 7), compression="gzip")
        made.attrs["element_size_um"] = np.array([2.0, 0.5, 0.25])
        for axis, name in enumerate("zyx"):
            made.dims[axis].label = name


def ilastik(path):
    """As ilastik exports probabilities."""
    with h5py.File(path, "w") as file:
        made = file.create_dataset("exported_data", data=samples_of((3, 5, 6, 7, 2), "f4"), chunks=(1, 5, 6, 7, 2), compression="lzf")
        made.attrs["axistags"] = json.dumps({"axes": [
            {"key": key, "typeFlags": flag, "resolution": step, "description": ""}
            for key, flag, step in (("t", 8, 0), ("z", 2, 3), ("y", 2, 1.5), ("x", 2, 1.5), ("c", 1, 0))]})
        made.attrs["drange"] = np.array([0.0, 120.0])
        made.attrs["display_mode"] = "grayscale"


def cremi(path):
    """As the CREMI challenge and funlib.persistence write volumes."""
    with h5py.File(path, "w") as file:
        file.attrs["file_format"] = "0.2"
        made = file.create_dataset("volumes/raw", data=samples_of((5, 6, 7), "u1"))
        made.attrs.update({"resolution": np.array([40.0, 4.0, 8.0]), "offset": np.array([400.0, 20.0, 16.0]), "units": ["nm", "nm", "nm"],
                           "axis_names": ["z", "y", "x"]})
        labels = file.create_dataset("volumes/labels/neuron_ids", data=samples_of((5, 6, 7), "u8"))
        labels.attrs.update({"resolution": np.array([40.0, 4.0, 8.0]), "offset": np.array([400.0, 20.0, 16.0]), "comment": "none",
                             "background_label": np.uint64(0)})


def voxel_size(path):
    with h5py.File(path, "w") as file:
        made = file.create_dataset("data", data=samples_of((5, 6, 7), ">i4"))
        made.attrs.update({
            "voxel_size": np.array([3, 2, 1]), "unit": "um", "CLASS": "IMAGE", "IMAGE_SUBCLASS": "IMAGE_GRAYSCALE",
            "IMAGE_VERSION": "1.2", "IMAGE_MINMAXRANGE": np.array([1, 119]), "DISPLAY_ORIGIN": "LL", "IMAGE_WHITE_IS_ZERO": np.uint8(0)
        })


def scales(path):
    """With dimension scales of h5py; the last axis runs backwards."""
    with h5py.File(path, "w") as file:
        made = file.create_dataset("density", data=samples_of((3, 5, 6, 7), "f8"), fillvalue=-1)
        for axis, (name, values, unit) in enumerate((("time", 0.5 * np.arange(3), "s"), ("z", 10 + 2.0 * np.arange(5), "mm"),
                                                     ("y", 0.5 * np.arange(6), "mm"), ("x", 9 - 1.0 * np.arange(7), "mm"))):
            file[name] = values
            file[name].attrs["units"] = unit
            file[name].make_scale(name)
            made.dims[axis].attach_scale(file[name])
            made.dims[axis].label = name
        made.attrs["units"] = "kg m-3"


def mask(path):
    with h5py.File(path, "w") as file:
        file["mask"] = samples_of((5, 6, 7), "u1") > 60


def kinds(path):
    """An enumeration: names of numbers."""
    with h5py.File(path, "w") as file:
        kind = h5py.enum_dtype({"air": 0, "bone": 1, "soft": 2}, "u1")
        file.create_dataset("tissue", data=samples_of((5, 6, 7), "u1") % 3, dtype=kind)


def by_nexusformat(path):
    axes = [nexus.NXfield(values, name=name, units="mm", long_name=f"{name} (mm)") for name, values in
            (("z", 1.0 + 2 * np.arange(5)), ("y", 0.5 * np.arange(6)), ("x", 0.25 * np.arange(7)))]
    data = nexus.NXdata(nexus.NXfield(samples_of((5, 6, 7), "i4"), name="counts", units="counts", long_name="Counts"), axes, title="scan")
    detector = nexus.NXdetector(raw=nexus.NXfield(samples_of((5, 6, 7), "i2")))
    entry = nexus.NXentry(data, start_time="2020-01-01T00:00:00", sample=nexus.NXsample(name="crystal"),
                          instrument=nexus.NXinstrument(detector=detector))
    root = nexus.NXroot(entry)
    root.attrs["default"] = "entry"
    entry.attrs["default"] = "data"
    root.save(path, mode="w")


def by_silx(path):
    """With all that the definition of NXdata has beside: indices, errors, factors, other signals."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"NX_class": "NXroot", "default": "entry", "creator": "silx", "file_time": "2020-01-01T00:00:00"})
        file.create_group("entry").attrs.update({"NX_class": "NXentry", "default": "data"})
        file["entry/definition"] = "NXtomoproc"
        plot = file.create_group("entry/data")
        plot.attrs.update({
            "NX_class": "NXdata", "signal": "intensity", "axes": ["time", "depth", "row", "col"], "auxiliary_signals": ["other"],
            "time_indices": 0, "depth_indices": 1, "row_indices": 2, "col_indices": 3
        })
        plot["intensity"] = samples_of((3, 5, 6, 7), "i2")
        plot["intensity"].attrs.update({"units": "counts", "long_name": "intensity", "interpretation": "image"})
        plot["intensity_errors"] = np.ones((3, 5, 6, 7), "f4")
        plot["other"] = np.ones((3, 5, 6, 7), "f4")
        for name, value in {"scaling_factor": 0.5, "offset": 10.0, "intensity_scaling_factor": 0.5, "intensity_offset": 10.0,
                            "depth_scaling_factor": 2.0, "depth_offset": 1.0}.items():
            plot[name] = value
        plot["title"] = "a scan"
        for name, values, unit in (("time", 2.0 * np.arange(3), "s"), ("depth", 3.0 * np.arange(5), "um"),
                                   ("row", 2.0 * np.arange(6), "um"), ("col", 5 + 1.0 * np.arange(7), "um")):
            plot[name] = values
            plot[name].attrs.update({"units": unit, "long_name": name})


def fields(values, axes):
    """By time and channel, of an array with axes of these letters."""
    order = [axes.index(letter) for letter in "tczyx" if letter in axes]
    values = np.transpose(values, order).astype(float)
    values = values[(slice(None) if "t" in axes else None, slice(None) if "c" in axes else None)]
    return {(t, c): values[t, c].T for t in range(values.shape[0]) for c in range(values.shape[1])}


def placed(steps, starts=(0, 0, 0)):
    """Steps along z, y, x."""
    affine = np.diag([*list(steps)[::-1], 1.0]).astype(float)
    affine[:3, 3] = list(starts)[::-1]
    return affine


def read_fiji(path):
    with h5py.File(path) as file:
        made = file["t0/channel0"]
        axes = "".join(dimension.label for dimension in made.dims)
        axes = axes if sorted(axes) == ["x", "y", "z"] else "zyx"
        steps = made.attrs.get("element_size_um", np.ones(3))
        return Answer(fields=fields(made[()], axes), affine=placed([steps[axes.index(letter)] for letter in "zyx"]))


def read_ilastik(path):
    with h5py.File(path) as file:
        made = file["exported_data"]
        tags = json.loads(made.attrs["axistags"])["axes"]
        axes = "".join(tag["key"] for tag in tags)
        steps = {tag["key"]: tag.get("resolution", 0) or 1 for tag in tags}
        return Answer(fields=fields(made[()], axes), affine=placed([steps[letter] for letter in "zyx"]))


def read_attributes(path, dataset, step, start):
    with h5py.File(path) as file:
        made = file[dataset]
        return Answer(fields=fields(made[()], "zyx"), affine=placed(made.attrs.get(step, np.ones(3)), made.attrs.get(start, np.zeros(3))))


def read_plain(path, dataset):
    with h5py.File(path) as file:
        return Answer(fields=fields(file[dataset][()], "zyx"))


def converted(axes):
    """Values and units along z, y, x in the unit of x, if all have one."""
    units = [METRES.get(unit) for _, unit in axes]
    return [np.asarray(values, float) * (unit / units[-1] if all(units) else 1) for (values, _), unit in zip(axes, units)]


def read_scales(path):
    with h5py.File(path) as file:
        made = file["density"]
        axes = [dimension[0] for dimension in made.dims]
        return Answer(fields=fields(made[()], "".join({"time": "t"}.get(scale.name[1:], scale.name[1:]) for scale in axes)),
                      places=converted([(scale[()], scale.attrs.get("units")) for scale in axes[-3:]])[::-1])


def read_nexus(path, group, letters):
    with h5py.File(path) as file:
        found = NXdata(file[group])
        if not found.is_valid:
            raise ValueError(str(found.issues))
        axes = [(axis[()] if axis is not None else np.arange(size), axis.attrs.get("units") if axis is not None else None)
                for axis, size in zip(found.axes, found.signal.shape)]
        axes = [(values, unit.decode() if isinstance(unit, bytes) else unit) for values, unit in axes]
        return Answer(fields=fields(found.signal[()], letters), places=converted(axes[-3:])[::-1])


def sample(name, write, read, options="", more=(), document=None):
    file = f"{name}.h5"
    return Sample(
        name, file + options, lambda folder: write(folder / file), lambda folder:
        [Hdf5Document(folder / file, document or name, MEANINGS, numbered=r"^\d+$"), *(make(folder / file) for make in more)],
        lambda folder: read(folder / file))


def samples(_):
    return [
        sample("exchange", exchange, lambda path: read_plain(path, "exchange/data"), "?dataset=/exchange/data"),
        sample("fiji", fiji, read_fiji),
        sample("ilastik", ilastik, read_ilastik, more=[lambda path: Axistags(path, "axistags", "exported_data")]),
        sample("cremi", cremi, lambda path: read_attributes(path, "volumes/raw", "resolution", "offset"), "?dataset=volumes/raw"),
        sample("voxel_size", voxel_size, lambda path: read_attributes(path, "data", "voxel_size", "")),
        sample("scales", scales, read_scales),
        sample("mask", mask, lambda path: read_plain(path, "mask")),
        sample("kinds", kinds, lambda path: read_plain(path, "tissue")),
        sample("nexusformat", by_nexusformat, lambda path: read_nexus(path, "entry/data", "zyx"), document="nexus"),
        sample("silx", by_silx, lambda path: read_nexus(path, "entry/data", "tzyx"), document="nexus"),
    ]
