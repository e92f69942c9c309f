"""Images of OME-Zarr 0.4 to 0.6 by ome-zarr-py and ngff-zarr, with what bioformats2raw, OMERO and plates say beside them."""
import contextlib
import io
import json

import ngff_zarr
import numpy as np
import zarr
from ome_zarr import format as ome_format
from ome_zarr import writer

from ablation import Change, Sample
from array_documents import Metadata, affine, answer, numbers

TIMES = {"second": "s", "millisecond": "ms"}
METRES = {"micrometer": 1e-6, "nanometer": 1e-9, "millimeter": 1e-3, "meter": 1.0, "angstrom": 1e-10, "centimeter": 1e-2}
UNITS = {"t": "second", "z": "micrometer", "y": "micrometer", "x": "micrometer"}
SCALE = {"t": 3.0, "c": 1.0, "z": 2.5, "y": 0.5, "x": 0.25}
SHIFT = {"t": 0.0, "c": 0.0, "z": 10.0, "y": -3.0, "x": 1.0}
CHANNELS = [{"label": "DAPI", "color": "0000FF", "active": True, "coefficient": 1.0, "family": "linear", "inverted": False,
             "window": {"min": 0.0, "max": 255.0, "start": 5.0, "end": 90.0}},
            {"label": "GFP", "color": "00FF00", "active": False, "coefficient": 1.0, "family": "linear", "inverted": False,
             "window": {"min": 0.0, "max": 255.0, "start": 10.0, "end": 100.0}}]
OMERO = {"id": 1, "name": "cells", "version": "0.4", "channels": CHANNELS,
         "rdefs": {"defaultT": 0, "defaultZ": 2, "model": "color", "projection": "normal"}}
COLORS = [{"label-value": 1, "rgba": [255, 0, 0, 255]}, {"label-value": 2, "rgba": [0, 255, 0, 128]}]
PROPERTIES = [{"label-value": 1, "name": "nucleus", "area (pixels)": 1200}, {"label-value": 2, "class": "membrane", "area (pixels)": 1650}]


def one_changed(index, value):
    """A change of one number of a list."""
    def made(document, node):
        def act():
            listed = list(node.value)
            listed[index] = value
            node.set(listed)
        return [Change(f"number {index} is {value}", act)] if isinstance(node.value, list) and len(node.value) == 5 else []
    return made


# Messages may name the list that a number is in, what has as many entries, or the array that lacks an axis.
LENGTHS, AXIS = ("coordinateTransformations", "scale", "translation", "axes"), ("axes", "axis", "scale")
GROUP = ("a group", "arrays", "no Zarr array")
IMAGE = {"scale": {"role": "spacing", "more": one_changed(0, 7.0)}, "translation": {"role": "offset", "more": one_changed(0, 7.0)},
         "unit": {"role": "unit", "words": ("nanometer", "inch", "parsec")}, "version": {"words": ("0.5", "0.9")},
         "type": {"words": ("translation", "sequence"), "names": LENGTHS}, "path": {"names": GROUP}, "multiscales": {"names": GROUP},
         "axes": {"names": AXIS}, "axes/*": {"names": AXIS}, "multiscales/*/axes/*": {"names": AXIS},
         "multiscales/*/coordinateSystems": {"names": AXIS}, "multiscales/*/coordinateSystems/*": {"names": AXIS},
         "multiscales/*/coordinateSystems/*/axes": {"names": AXIS}, "multiscales/*/coordinateSystems/*/axes/*": {"names": AXIS},
         "multiscales/*/name": {"kind": "comment"}, "multiscales/*/metadata": {"kind": "comment"},
         "multiscales/*/type": {"kind": "comment"},
         "multiscales/*/@type": {"kind": "identifier"}, "multiscales/*/axes/*/type": {"words": ("space", "channel", "time"), "names": AXIS},
         "multiscales/*/axes/*/name": {"words": ("x", "u"), "names": AXIS},
         "multiscales/*/datasets/*/coordinateTransformations": {"names": LENGTHS},
         "multiscales/*/datasets/*/coordinateTransformations/*": {"names": LENGTHS},
         "multiscales/*/datasets/*/coordinateTransformations/*/name": {"kind": "comment"},
         "omero/rdefs/model": {"words": ("greyscale",)}, "omero/id": {"kind": "identifier"}, "omero/name": {"kind": "comment"},
         "omero/version": {},
         "omero/channels/*/color": {"words": ("FF0000", "#ff8800")}, "omero/channels/*/inverted": {}, "active": {"default": True},
         "properties/*/area (pixels)": {"kind": "comment"}}
SIZE = ("axes", "channels", "times", "bytes", "chunk")
WHOLE = ("multiscales/*/metadata",)


def image_document(folder, version, name="image"):
    if version == 2:
        return Metadata(folder / ".zattrs", name, whole=WHOLE, traits=IMAGE)
    return Metadata(folder / "zarr.json", name, inside=("attributes", "ome"), whole=WHOLE, traits=IMAGE)


def level_document(folder, version, level):
    """What an array says of its axes, beside the image."""
    if version == 2:
        return Metadata(folder / level / ".zarray", "level2", only=("dimension_separator", "shape"), traits={"shape": {"names": SIZE}})
    return Metadata(folder / level / "zarr.json", "level3", only=("dimension_names", "shape"),
                    traits={"shape": {"names": SIZE}})


def lengths_in_x(image):
    """Factors to the unit of x, if x, y and z state units that are known."""
    units = {axis: (image.axes_units or {}).get(axis) for axis in "xyz" if axis in image.dims}
    if not all(unit in METRES for unit in units.values()):
        return [1.0] * 3
    return [METRES[units.get(axis, units["x"])] / METRES[units["x"]] for axis in "xyz"]


def said_in(folder):
    """The image of a group."""
    attributes = zarr.open_group(folder, mode="r").attrs.asdict()
    return attributes.get("ome", attributes)["multiscales"][0]


def further(image, dims):
    """A scale and a shift of each axis, that the image states for all its levels (0.4 and 0.5). ngff-zarr passes over them."""
    scale, shift = dict.fromkeys(dims, 1.0), dict.fromkeys(dims, 0.0)
    for one in image.get("coordinateTransformations", []) if "coordinateSystems" not in image else []:
        for axis, number in zip(dims, one.get(one["type"], []), strict=True):
            if one["type"] == "scale":
                scale[axis], shift[axis] = scale[axis] * number, shift[axis] * number
            elif one["type"] == "translation":
                shift[axis] += number
    return scale, shift


def agrees(axis):
    """Whether an axis is called as its type says; ngff-zarr goes by its name alone."""
    kind = {"t": "time", "c": "channel"}.get(axis["name"], "space")
    return axis["name"] in "tczyx" and axis.get("type", kind) == kind


def read(folder):
    """As ngff-zarr has it. Its channels are not compared."""
    with contextlib.redirect_stdout(io.StringIO()):
        multiscales = ngff_zarr.from_ngff_zarr(str(folder))
    image, dims = multiscales.images[0], list(multiscales.images[0].dims)
    scale, shift = {}, {}
    if folder.is_dir():
        said = said_in(folder)
        if not all(agrees(axis) for axis in said.get("axes", [])):
            raise ValueError("an axis whose name is not that of its type")
        scale, shift = further(said, dims)
    spacing, origin = [], []
    for axis, factor in zip("xyz", lengths_in_x(image)):
        known = axis if axis in dims else "x"
        spacing.append(image.scale[known] * scale.get(known, 1.0) * factor)
        origin.append((image.translation[axis] * scale.get(axis, 1.0) + shift.get(axis, 0.0)) * factor if axis in dims else 0.0)
    return answer(image.data.compute(), dims, affine=affine(spacing, origin))


def tell(folder, version, said):
    """More attributes of a group."""
    group = zarr.open_group(folder, mode="a", zarr_format=version)
    group.attrs.update({"ome": {**group.attrs.get("ome", {}), **said}} if version == 3 else said)


def by_ome_zarr(folder, fmt, axes="tczyx", dtype="uint16", omero=True, scale_factors=(2,)):
    """As write_image does it: it averages blocks, and says where the levels lie."""
    sides = {"t": 2, "c": 2, "z": 5, "y": 6, "x": 7}
    writer.write_image(numbers([sides[axis] for axis in axes], dtype), str(folder), fmt=fmt, axes=axes, scale_factors=list(scale_factors),
                       scale={axis: SCALE[axis] for axis in axes}, axes_units={axis: UNITS[axis] for axis in axes if axis in UNITS})
    if omero:
        tell(folder, fmt.zarr_format, {"omero": OMERO})


def placed(folder, fmt, axes="tczyx"):
    """By write_multiscale, with translations and transformations of all levels."""
    sides = {"t": 2, "c": 2, "z": 4, "y": 6, "x": 8}
    finest = numbers([sides[axis] for axis in axes], "float32")
    levels = [finest, finest[..., ::2, ::2, ::2]]
    transforms = [[{"type": "scale", "scale": [SCALE[a] * (2 ** level if a in "xyz" else 1) for a in axes]},
                   {"type": "translation", "translation": [SHIFT[a] + (SCALE[a] * level / 2 if a in "xyz" else 0) for a in axes]}]
                  for level in range(2)]
    said = [{"name": a, "type": "time" if a == "t" else "channel" if a == "c" else "space", **({"unit": UNITS[a]} if a in UNITS else {})}
            for a in axes]
    group = zarr.open_group(folder, mode="w", zarr_format=fmt.zarr_format)
    writer.write_multiscale(levels, group=group, fmt=fmt, axes=said, coordinate_transformations=transforms)
    attributes = dict(group.attrs) if fmt.zarr_format == 2 else dict(group.attrs)["ome"]
    multiscales = attributes["multiscales"]
    multiscales[0]["coordinateTransformations"] = [{"type": "scale", "scale": [2.0 if a in "tzyx" else 1.0 for a in axes]}]
    tell(folder, fmt.zarr_format, {"multiscales": multiscales})


def by_ngff_zarr(path, version, units=None, orientation=False):
    """As ngff-zarr writes it, a level that its Gaussian filter made and all its metadata."""
    image = ngff_zarr.to_ngff_image(numbers((5, 6, 7), "int16"), dims=list("zyx"), scale={a: SCALE[a] for a in "zyx"},
                                    translation={a: SHIFT[a] for a in "zyx"}, axes_units=units or {a: UNITS[a] for a in "zyx"},
                                    name="brain")
    if orientation:
        image = ngff_zarr.NgffImage(**{**image.__dict__, "axes_orientations": ngff_zarr.LPS})
    with contextlib.redirect_stdout(io.StringIO()):
        ngff_zarr.to_ngff_zarr(str(path), ngff_zarr.to_multiscales(image, scale_factors=[]), version=version)


def labels(folder, fmt):
    """An image and a label image in it. Users open the latter."""
    by_ome_zarr(folder, fmt, "zyx", omero=False)
    group = zarr.open_group(folder, mode="a", zarr_format=fmt.zarr_format)
    cells = np.random.default_rng(3).integers(0, 4, (5, 6, 7)).astype("uint8")
    writer.write_labels(cells, group=group, name="cells", fmt=fmt, axes="zyx", scale_factors=[2], scale={a: SCALE[a] for a in "zyx"},
                        axes_units={a: UNITS[a] for a in "zyx"}, label_metadata={"colors": COLORS, "properties": PROPERTIES,
                                                                               "source": {"image": "../../"}})


def bioformats2raw(folder, _):
    """The layout of bioformats2raw: images by numbers, and the OME-XML of all of them."""
    tell(folder, 2, {"bioformats2raw.layout": 3})
    for image in ("0", "1"):
        by_ome_zarr(folder / image, ome_format.FormatV04(), "zyx", "uint8" if image == "0" else "uint16")
    tell(folder / "OME", 2, {"series": ["0", "1"]})
    image = ('<Image ID="Image:{0}" Name="{0}"><Pixels ID="Pixels:{0}" DimensionOrder="XYZCT" Type="uint8" SizeX="7" SizeY="6" SizeZ="5" '
             'SizeC="1" SizeT="1" PhysicalSizeX="0.25" PhysicalSizeY="0.5" PhysicalSizeZ="2.5"><MetadataOnly/></Pixels></Image>')
    (folder / "OME" / "METADATA.ome.xml").write_text('<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">'
                                                     + "".join(image.format(i) for i in range(2)) + "</OME>")


def plate(folder, _):
    """A plate with one well of one image."""
    fmt = ome_format.FormatV04()
    group = zarr.open_group(folder, mode="w", zarr_format=2)
    writer.write_plate_metadata(group, ["A"], ["1"], ["A/1"], fmt=fmt, name="a plate", field_count=1,
                                acquisitions=[{"id": 1, "name": "first", "maximumfieldcount": 1}])
    writer.write_well_metadata(group.require_group("A/1"), [{"path": "0", "acquisition": 1}], fmt=fmt)
    by_ome_zarr(folder / "A" / "1" / "0", fmt, "cyx")


def old(folder, version):
    """Of 0.3, as bioformats2raw 0.3 wrote it: axes are names, and nothing says how large voxels are. ome-zarr-py writes it no longer."""
    group = zarr.open_group(folder, mode="w", zarr_format=2)
    for level in range(2):
        shape = (1, 2, 6 >> level, 8 >> level, 8 >> level)
        keys = {"name": "v2", "separator": "/"}
        group.create_array(str(level), shape=shape, dtype="uint16", chunk_key_encoding=keys)[...] = numbers(shape, "uint16")
    group.attrs["multiscales"] = [{"version": version, "axes": list("tczyx"), "datasets": [{"path": "0"}, {"path": "1"}]}]


def further_systems(folder, _):
    """0.6 with a system of the sample beside the image's own, as its examples have it (ngff-spec, multiscales)."""
    by_ngff_zarr(folder, "0.6")
    path = folder / "zarr.json"
    said = json.loads(path.read_text())
    image = said["attributes"]["ome"]["multiscales"][0]
    image["coordinateSystems"].append({"name": "stage", "axes": [{"name": a, "type": "space", "unit": "millimeter"} for a in "zyx"]})
    image["coordinateTransformations"] = [{"type": "scale", "scale": [0.001] * 3, "input": {"name": "intrinsic"},
                                           "output": {"name": "stage"}}]
    path.write_text(json.dumps(said))


def sample(name, write, fmt, documents, source="", suffix=".ome.zarr", reader=read, sidecars=()):
    file = name + suffix
    return Sample(name, file + source, lambda made: write(made / file, fmt), lambda made: documents(made / file),
                  reader and (lambda made: reader(made / file)), tuple(f"{file}/{sidecar}" for sidecar in sidecars))


def image_sample(name, write, fmt, version, level="s0", **more):
    return sample(name, write, fmt, lambda folder: [image_document(folder, version), level_document(folder, version, level)], **more)


def label_documents(version):
    inside = ("image-label",) if version == 2 else ("attributes", "ome", "image-label")
    file = ".zattrs" if version == 2 else "zarr.json"
    return lambda folder: [Metadata(folder / "labels" / "cells" / file, "image-label", inside=inside, traits=IMAGE),
                           Metadata(folder / "labels" / file, "labels", inside=inside[:-1], traits={"labels": {"names": GROUP}})]


def raw_documents(folder):
    return [Metadata(folder / ".zattrs", "layout", traits={"bioformats2raw.layout": {"names": GROUP}}),
            Metadata(folder / "OME" / ".zattrs", "series")]


def plate_documents(folder):
    naming = {"name": {"kind": "comment"}, "path": {"names": GROUP}, "wells": {"names": GROUP}, "plate/wells/*": {"names": GROUP},
              "well": {"names": GROUP}, "images": {"names": GROUP}, "well/images/*": {"names": GROUP}, "plate": {"names": GROUP}}
    parts = ("plate/acquisitions", "plate/columns", "plate/rows")
    return [Metadata(folder / ".zattrs", "plate", traits=naming, whole=parts), Metadata(folder / "A" / "1" / ".zattrs", "well",
                                                                                        traits=naming)]


def samples(_):
    four, five = ome_format.FormatV04(), ome_format.FormatV05()
    mixed = {"z": "nanometer", "y": "micrometer", "x": "micrometer"}
    return [
        image_sample("image4", by_ome_zarr, four, 2),
        image_sample("image5", by_ome_zarr, five, 3),
        image_sample("placed4", placed, four, 2),
        image_sample("placed5", placed, five, 3),
        image_sample("ngff4", lambda path, _: by_ngff_zarr(path, "0.4"), None, 2, level="scale0/brain"),
        image_sample("ngff6", lambda path, _: by_ngff_zarr(path, "0.6"), None, 3, level="scale0/brain"),
        image_sample("mixed5", lambda path, _: by_ngff_zarr(path, "0.5", mixed), None, 3, level="scale0/brain"),
        image_sample("systems6", further_systems, None, 3, level="scale0/brain"),
        image_sample("anatomical5", lambda path, _: by_ngff_zarr(path, "0.5", orientation=True), None, 3, level="scale0/brain"),
        image_sample("times5", lambda path, fmt: by_ome_zarr(path, fmt, "tzyx", "uint8"), five, 3),
        image_sample("old3", lambda path, _: old(path, "0.3"), None, 2, level="0", reader=None),
        sample("labels4", labels, four, label_documents(2), source="/labels", reader=lambda folder: read(folder / "labels" / "cells")),
        sample("labels5", labels, five, label_documents(3), source="/labels", reader=lambda folder: read(folder / "labels" / "cells")),
        sample("raw4", bioformats2raw, None, raw_documents, reader=lambda folder: read(folder / "0"), sidecars=("OME/METADATA.ome.xml",)),
        sample("plate4", plate, None, plate_documents, reader=lambda folder: read(folder / "A" / "1" / "0")),
        sample("archive5", lambda path, _: by_ngff_zarr(path, "0.5"), None, lambda _: [], suffix=".ozx"),
    ]
