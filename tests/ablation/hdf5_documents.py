"""HDF5 files by h5py and netCDF files by netCDF4: attributes, datasets and dimensions."""
import dataclasses
import io
import pathlib
import re

import h5py
import netCDF4
import numpy as np

from ablation import CannotWrite, Change, Document, Node

MOST_NUMBERS = 64  # of a dataset whose numbers are a node; the others are samples
COMMENTS = {"long_name": "comment", "title": "comment", "history": "comment", "institution": "comment", "source": "comment",
            "references": "comment", "comment": "comment", "Description": "comment", "date": "date", "software": "comment",
            "softwareVersion": "comment", "author": "comment", "machine": "comment"}


def fitting(value, dtype):
    """A value in another type; CannotWrite if it does not fit."""
    try:
        with np.errstate(all="raise"):
            given = np.asarray(value)
            made = given.astype(dtype)
            same = made.dtype.kind == "f" or np.array_equal(made.astype(given.dtype), given)
    except (FloatingPointError, OverflowError, TypeError, ValueError) as error:
        raise CannotWrite(str(error)) from error
    if not same:
        raise CannotWrite(f"{value} as {dtype}")
    return made


def other_type(dtype):
    """A wider type, in the other byte order."""
    return np.dtype({"f": ">f8", "i": ">i8", "u": ">u8"}[dtype.kind])


@dataclasses.dataclass
class Meanings:
    """What the attributes and datasets of a document are, by their last names: see ablation.Node."""
    kinds: dict = dataclasses.field(default_factory=dict)
    roles: dict = dataclasses.field(default_factory=dict)
    names: dict = dataclasses.field(default_factory=dict)
    words: dict = dataclasses.field(default_factory=dict)

    def of(self, last):
        kinds = {**COMMENTS, **self.kinds}
        return {"kind": kinds.get(last, ""), "role": self.roles.get(last, ""), "names": tuple(self.names.get(last, ())),
                "words": tuple(self.words.get(last, ()))}


class Hdf5Document(Document):
    """Attributes, groups and datasets of an HDF5 file.

    numbered: what stands for an index in the names of objects, and becomes `*`. types: those in which samples (datasets of more than 64
    numbers) are written again. within: only objects below this one.
    """

    def __init__(self, path, name, meanings=None, numbered=r"\d+", types=("<i2", ">f4", "<f8"), skip=()):
        self.path, self.name, self.meanings, self.numbered = pathlib.Path(path), name, meanings or Meanings(), re.compile(numbered)
        self.types, self.skip = types, skip
        self.bytes = io.BytesIO(self.path.read_bytes())
        self.file = h5py.File(self.bytes, "r+")
        self.objects = {}  # the first of each path
        self.letters = False  # whether texts are lists of single letters, as Imaris has them

    def nodes(self):
        self.objects, nodes = {}, []
        found = [""]
        self.file.visit(found.append)
        for each in found:
            here = "/".join([self.name, *(self.numbered.sub("*", part) for part in each.split("/") if part)])
            self.objects.setdefault(here, each)
            thing = self.file[each or "/"]
            if each:
                nodes += list(self._dataset(here, each)) if isinstance(thing, h5py.Dataset) else [self._object(here, each)]
            nodes += [node for key in sorted(thing.attrs) if (node := self._attribute(here, each, key))]
        return [node for node in nodes if not any(re.search(pattern, node.path) for pattern in self.skip)]

    def _object(self, here, each):
        said = self.meanings.of(here.split("/")[-1])
        said["names"] += ("dataset",)
        return Node(here, None, None, lambda: self.file.__delitem__(each), **said)

    def _dataset(self, here, each):
        dataset = self.file[each]
        said = self.meanings.of(here.split("/")[-1])
        said["names"] += ("dataset",)
        remove = lambda: self.file.__delitem__(each)
        if dataset.dtype.names:
            yield Node(here, None, None, remove, **said)
            if len(dataset.dtype.names) == 2 and dataset.dtype[0].kind == "S":
                yield from self._rows(here, each)
        elif dataset.dtype.kind not in "iuf":
            text = dataset.shape in ((), (1,)) and h5py.check_string_dtype(dataset.dtype)
            value = np.ravel(dataset.asstr()[()])[0] if text else None
            one = dataset.shape == ()
            yield Node(here, value, (lambda new: self.replace(each,
                                                              str(new) if one else [str(new)], None)) if text else None, remove, **said)
        elif dataset.size <= MOST_NUMBERS:
            shape = dataset.shape
            again = Change("another type and byte order", lambda: self.replace(each, self.file[each][()], other_type(dataset.dtype)),
                           same=True)
            def change(new):
                fits = len(shape) > 1 and np.size(new) == np.prod(shape)
                self.replace(each, fitting(new, dataset.dtype).reshape(shape) if fits else fitting(new, dataset.dtype), dataset.dtype)
            yield Node(here, dataset[()].ravel() if len(shape) > 1 else dataset[()], change, remove, more=[again], **said)
        else:
            yield Node(here, None, None, remove, more=self._again(each, dataset), **said)

    def _again(self, each, dataset):
        """The same samples, written in another way; and with axes exchanged."""
        changes = [Change(f"samples are {np.dtype(t).str}", lambda t=t: self.replace(each, fitting(self.file[each][()], t), t), same=True)
                   for t in self.types if np.dtype(t) != dataset.dtype]
        packed = dict(chunks=tuple(min(side, 4) for side in dataset.shape), compression="gzip", shuffle=True)
        changes.insert(
            1, Change("chunks, gzip and shuffle", lambda: self.replace(each, self.file[each][()], dataset.dtype, **packed), same=True))
        if dataset.ndim > 1:
            swap = lambda: self.replace(each, np.ascontiguousarray(np.swapaxes(self.file[each][()], -1, -2)), dataset.dtype)
            changes.append(Change("axes exchanged", swap))
        return changes

    def _rows(self, here, each):
        """A table of names and values."""
        for number, row in enumerate(self.file[each][()]):
            def change(new, number=number):
                table = self.file[each][()]
                table[table.dtype.names[1]][number] = new
                self.file[each][...] = table

            def remove(number=number):
                self.replace(each, np.delete(self.file[each][()], number), None)
            yield Node(f"{here}/{row[0].decode().strip()}", row[1] if not isinstance(row[1], bytes) else row[1].decode().strip(),
                       change, remove, **self.meanings.of(row[0].decode().strip()))

    def replace(self, each, data, dtype, **options):
        """Another dataset with the same attributes and scales."""
        old = self.file[each]
        users = [(name, axis) for name in self._datasets() for axis, dimension in enumerate(self.file[name].dims)
                 if any(scale == old for scale in dimension.values())]
        scales = [[scale.name for scale in dimension.values()] for dimension in old.dims] if old.ndim else []
        plain = [(key, old.attrs[key], old.attrs.get_id(key).dtype) for key in old.attrs if key not in ("DIMENSION_LIST", "REFERENCE_LIST")]
        for name, axis in users:  # else the lists of their scales keep what is no longer there
            self.file[name].dims[axis].detach_scale(old)
        del self.file[each]
        new = self.file.create_dataset(each, data=data, dtype=dtype, **options)
        for key, value, kind in plain:
            new.attrs.create(key, value, dtype=kind)
        for axis, names in enumerate(scales):
            for name in names:
                if name.strip("/") != each and name in self.file:
                    new.dims[axis].attach_scale(self.file[name])
        for name, axis in users:
            if name in self.file and name != each:
                self.file[name].dims[axis].attach_scale(new)

    def _datasets(self):
        found = []
        self.file.visititems(lambda name, thing: found.append(name) if isinstance(thing, h5py.Dataset) else None)
        return found

    def _attribute(self, here, each, key):
        attrs = self.file[each or "/"].attrs
        if key == "REFERENCE_LIST":
            return None
        where, kind = attrs.get_id(key), attrs.get_id(key).dtype
        node = Node(f"{here}/@{key}", None, None, lambda: self._attrs(each).__delitem__(key), **self.meanings.of(key))
        if kind == np.dtype("S1") and where.shape:
            self.letters = True
            node.value = b"".join(attrs[key].tolist()).decode()
            node.set = lambda new: self._attrs(each).create(key, np.frombuffer(str(new).encode() or b"\0", "S1"))
        elif h5py.check_string_dtype(kind):
            value = attrs[key]
            node.value = [self._word(word) for word in value.tolist()] if isinstance(value, np.ndarray) else self._word(value)
            node.set = lambda new: self._attrs(each).__setitem__(key, new)
            node.more = [Change("as the other kind of text", lambda: self._other_text(each, key), same=True)]
        elif kind.kind in "iuf" and h5py.check_enum_dtype(kind) is None:
            node.value = attrs[key]
            node.set = lambda new: self._attrs(each).create(key, fitting(new, kind), shape=np.shape(new), dtype=kind)
            node.more = [
                Change("another type and byte order",
                       lambda: self._attrs(each).create(key, fitting(attrs[key], other_type(kind)), dtype=other_type(kind)), same=True)
            ]
        return node

    def _attrs(self, each):
        return self.file[each or "/"].attrs

    @staticmethod
    def _word(word):
        return word.decode() if isinstance(word, bytes) else str(word)

    def _other_text(self, each, key):
        attrs = self._attrs(each)
        fixed = h5py.check_string_dtype(attrs.get_id(key).dtype).length is not None
        value = attrs[key]
        words = [self._word(word) for word in np.atleast_1d(value).tolist()]
        dtype = h5py.string_dtype() if fixed else h5py.string_dtype(length=max(len(word.encode()) for word in words) + 1)
        data = np.array(words, dtype=object) if fixed else np.array([word.encode() for word in words])
        attrs.create(key, data if np.ndim(value) else data[0], dtype=dtype)

    def add(self, path, value):
        self.nodes()
        parent, last = path.rsplit("/", 1)
        if value is None or parent not in self.objects:
            raise CannotWrite(path)
        here = self.objects[parent]
        if last.startswith("@"):
            attrs = self._attrs(here)
            attrs.create(last[1:], np.frombuffer(value.encode(), "S1")) if self.letters and isinstance(value, str) else attrs.__setitem__(
                last[1:], value)
        elif isinstance(self.file[here or "/"], h5py.Group) and "*" not in last and np.size(value) == 1:
            self.file[f"{here}/{last}"] = value
        else:
            raise CannotWrite(path)

    def save(self):
        self.file.close()
        self.path.write_bytes(self.bytes.getvalue())


@dataclasses.dataclass
class Variable:
    dtype: np.dtype
    dimensions: list
    data: np.ndarray
    attributes: dict
    options: dict


class NetcdfDocument(Document):
    """Dimensions, variables and attributes of a netCDF file of any version, which is written anew. types: those in which the samples
    (variables of more than 64 numbers) are written again."""

    def __init__(self, path, name, meanings=None, types=("i2", "f4", "f8"), roles=None):
        self.path, self.name, self.meanings, self.types = pathlib.Path(path), name, meanings or Meanings(), types
        with netCDF4.Dataset(self.path) as file:
            file.set_auto_maskandscale(False)
            file.set_auto_chartostring(False)
            self.model = file.data_model
            self.dimensions = {key: None if each.isunlimited() else len(each) for key, each in file.dimensions.items()}
            self.attributes = {key: file.getncattr(key) for key in file.ncattrs()}
            self.variables = {key: self._variable(each) for key, each in file.variables.items()}

    @staticmethod
    def _variable(variable):
        filters = variable.filters() or {}
        options = {key: filters[key] for key in ("zlib", "shuffle", "fletcher32") if filters.get(key)}
        order = variable.endian()
        if order in ("little", "big"):
            options["endian"] = order
        return Variable(variable.dtype, list(variable.dimensions), variable[...],
                        {key: variable.getncattr(key)
                         for key in variable.ncattrs()}, options)

    def nodes(self):
        nodes = [self._attribute(f"{self.name}/@{key}", self.attributes, key) for key in self.attributes]
        for key in self.dimensions:
            nodes.append(
                Node(
                    f"{self.name}/dimensions/{key}", None, None, None, names=("axes",), more=[
                        Change("another name", lambda k=key: self._rename(k, "other_" + k)),
                        Change("unlimited", lambda k=key: self._unlimited(k), same=True)
                    ]))
        for key, variable in self.variables.items():
            nodes += self._nodes_of(key, variable)
        return nodes

    def _nodes_of(self, key, variable):
        here = f"{self.name}/{key}"
        said = self.meanings.of(key)
        said["names"] += ("dataset",)
        remove = lambda: self.variables.__delitem__(key)
        if variable.dtype is str or variable.dtype.kind not in "iuf" or not variable.dimensions:
            yield Node(here, None, None, remove, **said)
        elif variable.data.size <= MOST_NUMBERS:
            def change(new):
                variable.data = fitting(new, variable.dtype).reshape(variable.data.shape)

            yield Node(
                here, variable.data.ravel(), change, remove,
                more=[Change("another type", lambda: self._retype(variable, "f4"
                                                                  if variable.dtype.kind == "i" else "f8"), same=True)], **said)
        else:
            yield Node(here, None, None, remove, more=self._again(variable), **said)
        for name in variable.attributes:
            yield self._attribute(f"{here}/@{name}", variable.attributes, name)

    def _again(self, variable):
        types = () if "_Unsigned" in variable.attributes else self.types  # which is for bytes alone
        changes = [
            Change(f"samples are {t}", lambda t=t: self._retype(variable, t), same=True) for t in types if np.dtype(t) != variable.dtype
        ]
        if self.model == "NETCDF4":
            other = "little" if variable.options.get("endian") == "big" else "big"
            changes.insert(0, Change("the other byte order", lambda: variable.options.update(endian=other), same=True))
            changes.insert(1, Change("packed", lambda: variable.options.update(zlib=True, shuffle=True, fletcher32=True), same=True))
        if len(variable.dimensions) > 1:
            changes.append(Change("axes exchanged", lambda: self._exchange(variable), same=False))
        return changes

    @staticmethod
    def _retype(variable, dtype):
        """With the attributes that are of the type of the samples."""
        old = variable.dtype
        variable.data, variable.dtype = fitting(variable.data, dtype), np.dtype(dtype)
        for key in ("_FillValue", "missing_value", "valid_range", "valid_min", "valid_max", "flag_values"):
            if key in variable.attributes and np.asarray(variable.attributes[key]).dtype == old:
                variable.attributes[key] = fitting(variable.attributes[key], dtype)
        variable.options.pop("endian", None)

    def _exchange(self, variable):
        variable.dimensions[-1], variable.dimensions[-2] = variable.dimensions[-2], variable.dimensions[-1]
        variable.data = np.swapaxes(variable.data, -1, -2)

    def _rename(self, key, other):
        self.dimensions = {other if name == key else name: size for name, size in self.dimensions.items()}
        for variable in self.variables.values():
            variable.dimensions = [other if name == key else name for name in variable.dimensions]

    def _unlimited(self, key):
        """Classic files have at most one, which is the first of each variable."""
        if self.dimensions[key] is None:
            self.dimensions[key] = next(v.data.shape[v.dimensions.index(key)] for v in self.variables.values() if key in v.dimensions)
            return
        self.dimensions[key] = None

    def _attribute(self, path, attributes, key):
        value = attributes[key]

        def change(new):
            kind = np.asarray(value).dtype
            attributes[key] = fitting(new, kind) if kind.kind in "iuf" else new
        more = []
        if not isinstance(value, str) and np.asarray(value).dtype.kind in "iuf" and key != "_FillValue":
            wide = "f8" if np.asarray(value).dtype != np.float64 else "f4"
            more.append(Change(f"of type {wide}", lambda: attributes.__setitem__(key, fitting(value, wide)), same=True))
        return Node(path, value, change, lambda: attributes.__delitem__(key), more=more, **self.meanings.of(key))

    def add(self, path, value):
        words = path.split("/")[1:]
        if value is None:
            raise CannotWrite(path)
        if len(words) == 1 and words[0].startswith("@"):
            self.attributes[words[0][1:]] = value
        elif len(words) == 2 and words[1].startswith("@") and words[0] in self.variables:
            key, variable = words[1][1:], self.variables[words[0]]
            of_type = key in ("_FillValue", "missing_value", "valid_range", "valid_min", "valid_max")
            variable.attributes[key] = fitting(value, variable.dtype) if of_type else value
        else:
            raise CannotWrite(path)

    def save(self):
        with netCDF4.Dataset(self.path, "w", format=self.model) as file:
            file.set_fill_off() if self.model != "NETCDF4" else None
            for key, size in self.dimensions.items():
                file.createDimension(key, size)
            for key, value in self.attributes.items():
                file.setncattr(key, value)
            for key, variable in self.variables.items():
                attributes = dict(variable.attributes)
                options = dict(variable.options) if self.model == "NETCDF4" and variable.dtype is not str else {}
                dtype = variable.dtype if variable.dtype is str else variable.dtype.newbyteorder("=")
                made = file.createVariable(key, dtype, variable.dimensions, fill_value=attributes.pop("_FillValue", None), **options)
                made.set_auto_maskandscale(False)
                made.setncatts(attributes)
                made[...] = variable.data
