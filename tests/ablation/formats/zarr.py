"""Arrays of Zarr 2 and 3 as xarray, zarr-python and numcodecs write them, with CF's attributes and coordinates."""
import shutil

import numcodecs
import numpy as np
import tensorstore
import xarray
import zarr
from zarr.codecs import BytesCodec, GzipCodec
from zarr.storage import ZipStore

from ablation import Change, Sample
from array_documents import Metadata, affine, answer, kinds_of, numbers

NAMES = ("time", "z", "y", "x")
UNITS = ("m", "km", "mm", "degrees_north")
COMMENT, IDENTIFIER = {"kind": "comment"}, {"kind": "identifier"}
CF = {"scale_factor": {"role": "scale"}, "add_offset": {"role": "offset"}, "_FillValue": {"role": "fill", "names": ("none",)},
      "missing_value": {"role": "fill", "names": ("none",)}, "long_name": COMMENT, "comment": COMMENT, "history": COMMENT, "title": COMMENT,
      "institution": COMMENT, "source": COMMENT, "references": COMMENT, "description": COMMENT, "Conventions": IDENTIFIER,
      "standard_name": IDENTIFIER, "_ARRAY_DIMENSIONS": {"names": ("axes",)}}
COORDINATE = {**CF, "units": {"role": "unit", "names": ("coordinates",), "words": UNITS}, "bounds": {"names": ("coordinates",)},
              "axis": {"words": ("X", "Z")}, "standard_name": {}}
VALUES = {"units": "K", "long_name": "air temperature", "standard_name": "air_temperature", "cell_methods": "time: mean",
          "grid_mapping": "crs", "comment": "made"}


def rewritten(document, **options):
    """Writes the array again with zarr-python, the same values with other settings."""
    def act():
        folder = document.path.parent
        old = zarr.open_array(folder, mode="r")
        data, attributes, version = old[...], dict(old.attrs), old.metadata.zarr_format
        told = {"shape": data.shape, "chunks": old.chunks, "dtype": data.dtype, "fill_value": old.fill_value, "zarr_format": version,
                "attributes": attributes}
        if version == 3:
            told["dimension_names"] = old.metadata.dimension_names
        shutil.rmtree(folder)
        told.update(options)
        zarr.create_array(folder, **told)[...] = data.astype(told["dtype"])
    document.act = act


def again(name, **options):
    """A change that writes the samples in another way."""
    def made(document):
        return Change(name, lambda: rewritten(document, **options), same=True)
    return made


def traits(*changes):
    return {"more": lambda document, _: [change(document) for change in changes]}


# Names by which messages say what of a chunk does not fit: its size, or how it is packed.
CHUNK = ("bytes", "chunk", "damaged", "compressor", "codec")
ARRAY2 = {"dtype": {**traits(again("samples are int32", dtype="<i4"), again("samples are float64", dtype="<f8"),
                             again("the other byte order", dtype=">i2")), "names": CHUNK},
          "order": traits(again("samples in Fortran's order", order="F")),
          "compressor": {**traits(again("packed by zstd", compressors=numcodecs.Zstd()), again("not packed", compressors=None)),
                         "names": CHUNK},
          "compressor/id": {"names": CHUNK, "words": ("zlib", "lz4", "zstd", "blosc")}, "shape": {"names": ("axes", *CHUNK)},
          "chunks": {"names": CHUNK}, "fill_value": {"role": "fill"}, "dimension_separator": {"default": "."},
          **{f"filters/*/{word}": {"names": ("filters", *CHUNK)} for word in ("id", "dtype", "astype", "elementsize")},
          "filters/*/dtype": {"words": ("<i4", ">f4"), "names": ("filters", *CHUNK)}, "filters": {"names": CHUNK},
          "filters/*": {"names": CHUNK}}
ARRAY3 = {"data_type": {**traits(again("samples are int32", dtype="int32"), again("samples are float64", dtype="float64"),
                                 again("the other byte order", serializer=BytesCodec(endian="big"))),
                        "names": CHUNK},
          "codecs": {**traits(again("packed by gzip", compressors=GzipCodec())), "names": CHUNK},
          "shape": {"names": ("axes", *CHUNK)}, "fill_value": {"role": "fill"}, "chunk_grid/configuration/chunk_shape": {"names": CHUNK},
          "codecs/*/configuration/codecs/*/name": {"names": CHUNK}, "codecs/*": {"names": ("codecs", *CHUNK)},
          "codecs/*/name": {"names": CHUNK}, "codecs/*/configuration/order": {"names": CHUNK},
          "codecs/*/configuration": {"names": ("codecs", *CHUNK)}, "codecs/*/configuration/endian": {"words": ("little", "big")},
          "codecs/*/configuration/index_location": {"words": ("start", "end"), "names": ("shard", *CHUNK)},
          "codecs/*/configuration/chunk_shape": {"names": ("shard", *CHUNK)}, "codecs/*/configuration/index_codecs": {"names": ("shard",)},
          "chunk_key_encoding/name": {"words": ("v2", "default")}, "chunk_key_encoding/configuration/separator": {"words": (".", "/"),
                                                                                                                  "default": "/"},
          "dimension_names": {"names": ("axes",)}}


def array_documents(folder, version, name="", tables=(ARRAY2, ARRAY3, CF), **more):
    """Those of an array: what it is, and its attributes. `name`: what it is for, where that is something else than the values."""
    if version == 2:
        return [Metadata(folder / ".zarray", f"{name}array2", traits=tables[0]),
                Metadata(folder / ".zattrs", f"{name}attributes", traits=tables[2], **more)]
    return [Metadata(folder / "zarr.json", f"{name}array3", without=("attributes",), traits=tables[1]),
            Metadata(folder / "zarr.json", f"{name}attributes", inside=("attributes",), traits=tables[2], **more)]


def attributes(folder, version, name, table, **more):
    return array_documents(folder, version, name, (None, None, table), **more)[1]


def group_documents(folder, version):
    if version == 2:
        return [Metadata(folder / ".zgroup", "group2"), Metadata(folder / ".zattrs", "group-attributes", traits=CF),
                Metadata(folder / ".zmetadata", "consolidated2", whole=("metadata",))]
    return [Metadata(folder / "zarr.json", "group3", without=("attributes",), whole=("consolidated_metadata",)),
            Metadata(folder / "zarr.json", "group-attributes", inside=("attributes",), traits=CF)]


def dataset_documents(folder, version):
    """Values, coordinates and the group of a dataset of xarray. What arrays say by themselves is changed in samples of one array."""
    file, table = (".zarray", ARRAY2) if version == 2 else ("zarr.json", ARRAY3)
    documents = [Metadata(folder / "temp" / file, f"member{version}", only=("shape", "zarr_format", "node_type"), traits=table)]
    documents += [attributes(folder / "temp", version, "", CF), *group_documents(folder, version)]
    for axis in ("x", "y", "time"):
        if (folder / axis).is_dir():
            documents += [attributes(folder / axis, version, f"coordinate-{axis}-", COORDINATE)]
    for bounds in folder.glob("*_bnds"):
        documents += [attributes(bounds, version, "bounds-", COORDINATE)]
    return documents


def dataset(values, packing=None, times=True, y_step=-0.5, uneven=False, bounds=False, **more):
    """As a model of the atmosphere leaves it: a field, its coordinates, and what CF says of both."""
    place = {"time": ("time", [0.0, 6.0], {"units": "hours since 2000-01-01", "calendar": "proleptic_gregorian", "axis": "T"}),
             "z": ("z", np.array([0, 1, 3, 7, 15.0]) if uneven else np.arange(5) * 2.5 + 10, {"units": "m", "axis": "Z", "positive": "up"}),
             "y": ("y", np.arange(6) * y_step + 4, {"units": "m", "axis": "Y", "standard_name": "projection_y_coordinate"}),
             "x": ("x", np.arange(7) * 0.25 + 1, {"units": "m", "axis": "X", "standard_name": "projection_x_coordinate"})}
    names = NAMES if times else NAMES[1:]
    made = xarray.Dataset({"temp": (names, values, {**VALUES, **more})}, coords={name: place[name] for name in names},
                          attrs={"Conventions": "CF-1.10", "title": "a model", "history": "2024-01-01 run", "institution": "an institute"})
    if bounds:
        low = place["x"][1] - 0.2
        made["x_bnds"] = (("x", "nv"), np.stack([low, low + 0.25], axis=1))
        made["x"].attrs["bounds"] = "x_bnds"
    made["temp"].encoding.update(packing or {})
    return made


def places(opened, axis, values):
    """Coordinates along an axis: the centres of its cells, if they are stated and even; else its coordinates; else numbers."""
    name = values.dims[axis]
    plain = np.arange(values.shape[axis], dtype=float)
    if name not in opened.variables or opened[name].dims != (name,) or opened[name].dtype.kind not in "iuf":
        return plain
    bounds = opened[name].attrs.get("bounds")
    if bounds in opened.variables and opened[bounds].shape == (values.shape[axis], 2):
        cells = opened[bounds].values
        steps, lengths = np.diff(cells.mean(axis=1)), np.abs(np.diff(cells, axis=1))
        if np.allclose(steps, steps[0], rtol=0.02) and np.allclose(lengths, abs(steps[0]), rtol=0.02) and steps[0] != 0:
            return cells.mean(axis=1)
    steps = np.diff(opened[name].values)
    risen = np.all(steps > 0) or np.all(steps < 0)
    return opened[name].values.astype(float) if len(steps) and risen and np.all(np.isfinite(steps)) else plain


def read_xarray(folder, name="temp", masked=True):
    """As xarray has it; the metadata of the nodes count, not those that are consolidated."""
    opened = xarray.open_dataset(folder, engine="zarr", consolidated=False, decode_times=False, mask_and_scale=masked, chunks=None,
                                 decode_coords=False)
    values = opened[name]
    kinds = kinds_of(values.dims)
    along = [places(opened, kinds.index(kind), values) if kind in kinds else np.zeros(1) for kind in "xyz"]
    return answer(values.values, kinds, places=along)


def read_array(folder):
    """As zarr-python has it."""
    array = zarr.open_array(folder, mode="r")
    names = array.metadata.dimension_names if array.metadata.zarr_format == 3 else array.attrs.get("_ARRAY_DIMENSIONS")
    return answer(array[...], kinds_of(names or [""] * array.ndim))


def xarray_sample(name, version, make, read=read_xarray, documents=dataset_documents, sidecars=()):
    folder = f"{name}.zarr"
    return Sample(name, folder, lambda made: make().to_zarr(made / folder, zarr_format=version, consolidated=True),
                  lambda made: documents(made / folder, version), read and (lambda made: read(made / folder)),
                  tuple(f"{folder}/{sidecar}" for sidecar in sidecars))


def array_sample(name, version, write, read=read_array):
    folder = f"{name}.zarr"
    return Sample(name, folder, lambda made: write(made / folder), lambda made: array_documents(made / folder, version),
                  lambda made: read(made / folder))


def packed(fill=-99):
    return {"dtype": "int16", "scale_factor": 0.5, "add_offset": 3.0, "_FillValue": fill, "chunks": (1, 5, 6, 4)}


def temperatures(missing=True):
    values = numbers((2, 5, 6, 7), float) * 0.5 + 3
    if missing:
        values[0, 0, 0, 0] = np.nan  # a corner, which is always compared
    return values


def write_plain(dtype, version, **options):
    def write(folder):
        values = numbers((5, 6, 7), dtype)
        zarr.create_array(folder, shape=values.shape, dtype=dtype, zarr_format=version, **{"chunks": (3, 4, 4), **options})[...] = values
    return write


def named(version):
    return {"attributes": {"_ARRAY_DIMENSIONS": ["z", "y", "x"]}} if version == 2 else {"dimension_names": ["z", "y", "x"]}


def write_partly(version):
    """Chunks that were never written hold the fill value."""
    def write(folder):
        array = zarr.create_array(folder, shape=(5, 6, 7), chunks=(3, 4, 4), dtype="int16", zarr_format=version, fill_value=17,
                                  **named(version))
        array[:3, :4] = numbers((3, 4, 7), "int16") - 60
    return write


def write_tensorstore(folder):
    values = numbers((5, 6, 7, 2), "uint16")
    spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": str(folder)},
            "metadata": {"shape": values.shape, "data_type": "uint16", "dimension_names": ["z", "y", "x", "c"], "fill_value": 0,
                         "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [6, 6, 8, 2]}},
                         "codecs": [{"name": "sharding_indexed", "configuration": {
                             "chunk_shape": [3, 3, 4, 1], "index_location": "start",
                             "codecs": [{"name": "transpose", "configuration": {"order": [3, 2, 1, 0]}},
                                        {"name": "bytes", "configuration": {"endian": "big"}},
                                        {"name": "blosc", "configuration": {"cname": "zstd", "shuffle": "bitshuffle", "typesize": 2,
                                                                            "clevel": 5}}],
                             "index_codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]}}]}}
    tensorstore.open(spec, create=True).result().write(values).result()


def write_zip(path):
    with ZipStore(path, mode="w") as store:
        array = zarr.create_array(store, name="density", shape=(5, 6, 7), dtype="float32", chunks=(5, 6, 7),
                                  dimension_names=["z", "y", "x"])
        array[...] = numbers((5, 6, 7), "float32")


def read_zip(path):
    with ZipStore(path, mode="r") as store:
        return answer(zarr.open_group(store, mode="r")["density"][...], kinds_of("zyx"))


def zip_sample():
    return Sample("zip", "a.zip", lambda made: write_zip(made / "a.zip"), lambda made: [], lambda made: read_zip(made / "a.zip"))


def by_cf_axes(folder):
    """What lies along an axis is what the attribute `axis` of its coordinates says (CF, chapter 4), whatever it is called."""
    opened = xarray.open_dataset(folder, engine="zarr", consolidated=False, decode_times=False)
    kinds = [opened[name].attrs["axis"].lower() for name in opened["temp"].dims]
    return answer(opened["temp"].values, kinds, places=[opened[opened["temp"].dims[kinds.index(kind)]].values for kind in "xyz"])


def write_funlib(folder):
    """As funlib.persistence (daisy, gunpowder) writes arrays: where they lie is in attributes of theirs, z first."""
    write_plain("uint8", 2)(folder)
    zarr.open_array(folder, mode="a").attrs.update({"offset": [400, 200, 100], "voxel_size": [40, 8, 4], "axis_names": ["z", "y", "x"],
                                                    "units": ["nm", "nm", "nm"]})


def read_funlib(folder):
    """As the same attributes of HDF5 files are taken (docs/formats.md, HDF5)."""
    array = zarr.open_array(folder, mode="r")
    attributes = array.attrs
    size, first = attributes.get("voxel_size", [1] * 3)[::-1], attributes.get("offset", [0] * 3)[::-1]
    return answer(array[...], kinds_of(attributes.get("axis_names", [""] * 3)), affine=affine(size, first))


def oddly_named():
    made = dataset(temperatures(False)[0], times=False).transpose("x", "y", "z")
    return made.rename({"x": "xi_rho", "y": "eta_rho", "z": "s_rho"})


def packed_coordinates():
    made = dataset(temperatures(False)[0], times=False)
    made["x"].encoding.update({"dtype": "int16", "scale_factor": 0.25, "add_offset": 1.0})
    return made


def unsigned():
    """NetCDF-3 has no unsigned types; converted files keep its way to say so."""
    made = dataset(numbers((5, 6, 7), "int8", most=127), times=False, y_step=0.5)
    made["temp"].values[::2] -= 127
    made["temp"].attrs["_Unsigned"] = "true"
    return made


def few(*words):
    """Only these attributes, of samples that are read wrongly as they are: the others are seen in the samples before them."""
    return lambda folder, version: [attributes(folder / "temp", version, "", CF, only=words)]


def samples(_):
    x2, x3 = ((lambda: dataset(temperatures(False), packed())), (lambda: dataset(temperatures(), packed())))
    missing = {"valid_min": np.int16(-10), "valid_max": np.int16(110), "actual_range": [3.0, 60.0], "coordinates": "x y"}
    return [
        array_sample("partly2", 2, write_partly(2)),
        array_sample("partly3", 3, write_partly(3)),
        xarray_sample("xarray2", 2, x2, sidecars=(".zmetadata",)),
        xarray_sample("xarray3", 3, x3),
        xarray_sample("floats", 3, lambda: dataset(temperatures(False)[0].astype("float32"), {"_FillValue": np.float32(-1e9)}, times=False,
                                                   y_step=0.5)),
        xarray_sample("uneven", 2, lambda: dataset(temperatures(False)[0], times=False, uneven=True)),
        xarray_sample("bounds", 3, lambda: dataset(temperatures(False)[0], times=False, bounds=True)),
        xarray_sample("missing", 3, lambda: dataset(temperatures()[0], {"dtype": "int16", "missing_value": np.int16(-7)}, times=False)),
        array_sample("plain2", 2, write_plain("uint16", 2, compressors=numcodecs.Blosc(), **named(2))),
        array_sample("plain3", 3, write_plain("int16", 3, **named(3))),
        array_sample("nameless", 3, write_plain("float32", 3)),
        array_sample("half", 2, write_plain(">f2", 2, compressors=numcodecs.Zlib(), order="F", **named(2))),
        array_sample("bool", 3, write_plain("bool", 3, **named(3))),
        array_sample("filters", 2, write_plain("float32", 2, filters=[numcodecs.FixedScaleOffset(offset=10, scale=4, dtype="<f4",
                                                                                                 astype="<i2"),
                                                                      numcodecs.Delta(dtype="<i2"), numcodecs.Shuffle(2)],
                                               compressors=numcodecs.GZip(), **named(2))),
        array_sample("shards", 3, write_tensorstore),
        zip_sample(),
        Sample("funlib", "funlib.zarr", lambda made: write_funlib(made / "funlib.zarr"),
               lambda made: [Metadata(made / "funlib.zarr" / ".zattrs", "funlib", traits={"offset": {"role": "offset"}})],
               lambda made: read_funlib(made / "funlib.zarr")),
        xarray_sample("limits", 3, lambda: dataset(temperatures(False)[0], {"dtype": "int16", "scale_factor": 0.5, "add_offset": 3.0},
                                                   times=False, **missing), documents=few("valid_min", "valid_max", "actual_range")),
        xarray_sample("fill2", 2, lambda: dataset(temperatures(), packed()),
                      documents=lambda folder, _: [Metadata(folder / "temp" / ".zarray", "member2", only=("fill_value",), traits=ARRAY2)]),
        xarray_sample("unsigned", 2, unsigned, documents=few("_Unsigned")),
        xarray_sample("packed-coordinates", 3, packed_coordinates,
                      documents=lambda folder, version: [attributes(folder / "x", version, "coordinate-x-", COORDINATE,
                                                                    only=("scale_factor", "add_offset"))]),
        xarray_sample("odd-names", 3, oddly_named, by_cf_axes, documents=lambda *_: []),
    ]
