"""NIfTI-1, NIfTI-2 and Analyze 7.5, by nibabel. The header's fields are those of nibabel's dtypes."""
import nibabel
import numpy as np

from ablation import Answer, CannotWrite, Change, Document, Node, Sample
from documents import HeaderDocument

KINDS = {"descrip": "comment", "aux_file": "comment", "db_name": "comment", "intent_name": "comment"}
ROLES = {"scl_slope": "scale", "scl_inter": "offset", "pixdim": "spacing", "xyzt_units": "unit", "srow_x": "affine", "srow_y": "affine",
         "srow_z": "affine", "qoffset_x": "affine"}
NAMES = {"dim": ("size", "dimension", "bytes", "channels", "times"), "srow_x": ("sform",), "srow_y": ("sform",), "srow_z": ("sform",), "quatern_b": ("qform",),
         "quatern_c": ("qform",), "quatern_d": ("qform",), "qoffset_x": ("qform",), "qoffset_y": ("qform",), "qoffset_z": ("qform",),
         "vox_offset": ("offset", "truncated"), "magic": ("n+1", "ni1", "NIfTI"), "sizeof_hdr": ("NIfTI",), "datatype": ("type", "truncated"), "bitpix": ("bits",),
         "qform_code": ("qform", "sform"), "sform_code": ("qform", "sform")}
COLOUR = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])
TYPES = (np.uint8, np.int16, np.int32, np.float32, np.float64)


class Header(HeaderDocument):
    """The header of a file, and its samples in other types and in the other byte order."""

    def __init__(self, path, kind):
        name = "header" if issubclass(kind, nibabel.Nifti1Header) else "analyze"
        super().__init__(path, name, kind.template_dtype, split=("dim", "pixdim"), kinds=KINDS, roles=ROLES, names=NAMES)
        self.kind, self.whole = kind, None

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            if node.path.endswith("/datatype") and self.path.suffix == ".nii":
                node.more = [Change(f"samples are {np.dtype(t).name}", lambda t=t: self._encode(t), same=True) for t in TYPES]
                node.more.append(Change("the other byte order", self._swap, same=True))
        return nodes

    def _encode(self, dtype):
        image = nibabel.load(self.path)
        if image.get_data_dtype().fields or image.header.extensions:
            raise CannotWrite("colours, or an extension before the samples")
        stored = np.asanyarray(image.dataobj.get_unscaled()).astype(dtype)
        header = image.header.copy()
        header.set_data_dtype(dtype)
        self.whole = self._bytes(header, stored)

    def _swap(self):
        image = nibabel.load(self.path)
        if image.header.extensions:
            raise CannotWrite("an extension has the byte order of the file")
        stored = np.asanyarray(image.dataobj.get_unscaled())
        self.whole = self._bytes(image.header.as_byteswapped(), stored.astype(stored.dtype.newbyteorder()))

    def _bytes(self, header, stored):
        raw = header.binaryblock
        return raw + bytes(int(float(nibabel.load(self.path).header["vox_offset"])) - len(raw)) + stored.tobytes(order="F")

    def save(self):
        if self.whole is not None:
            self.path.write_bytes(self.whole)
        else:
            super().save()


EXTENSION = np.dtype([("extender", "u1", 4), ("esize", "<i4"), ("ecode", "<i4")])


class LabelLines(Document):
    """X.nii.txt: the names of labels."""

    def __init__(self, path):
        self.path, self.lines = path, path.read_text().splitlines()

    def nodes(self):
        return [Node("label-names/*", line, lambda new, n=n: self.lines.__setitem__(n, new), lambda n=n: self.lines.__delitem__(n), ("nii.txt", "name"))
                for n, line in enumerate(self.lines)]

    def save(self):
        self.path.write_text("".join(line + "\n" for line in self.lines))


class LabelColours(Document):
    """X.nii.lut: 256 bytes of red, then green, then blue."""

    def __init__(self, path):
        self.path, self.data = path, path.read_bytes()

    def nodes(self):
        return [Node("label-colours", None, None, None, ("nii.lut", "colour"), more=[
            Change("inverted", lambda: setattr(self, "data", bytes(255 - v for v in self.data))),
            Change("truncated", lambda: setattr(self, "data", self.data[:700]))])]

    def save(self):
        self.path.write_bytes(self.data)


def values(shape, dtype):
    random = np.random.default_rng(5)
    if np.dtype(dtype).fields:
        return random.integers(1, 120, shape + (len(np.dtype(dtype).fields),)).astype(np.uint8).view(dtype)[..., 0]
    return random.integers(1, 120, shape).astype(dtype)


def affine():
    turned = np.array([[-0.9, 0.1, 0.0], [0.1, 0.9, 0.0], [0.0, 0.0, 1.0]])
    q, _ = np.linalg.qr(turned)
    matrix = np.eye(4)
    matrix[:3, :3] = q @ np.diag([1.5, 2.0, 2.5])
    matrix[:3, 3] = [10, -20, 30]
    return matrix


def image(kind, shape, dtype, sform=True, qform=False, slope=None, units=("mm", "sec"), intent=None):
    made = kind(values(shape, dtype), affine())
    made.set_sform(affine() if sform else None, code=1 if sform else 0)
    made.set_qform(affine() if qform else None, code=1 if qform else 0)
    made.header.set_xyzt_units(*units)
    if slope:
        made.header.set_slope_inter(*slope)
    if intent:
        made.header.set_intent(*([intent] if isinstance(intent, str) else intent))
    return made


def told(made):
    """With what programs write beside the geometry: window, times of slices, names."""
    header = made.header
    header["cal_min"], header["cal_max"], header["toffset"], header["slice_code"], header["slice_end"] = 5.0, 90.0, 1.5, 1, 6
    header["slice_duration"], header["descrip"], header["aux_file"] = 0.07, b"FSL5.0", b"colours"
    header.set_dim_info(0, 1, 2)
    return made


def extended(made):
    made.header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", b"made by a program"))
    return made


def labelled(folder):
    """As MRIcron keeps its atlases."""
    made = image(nibabel.Nifti1Image, (5, 6, 7), np.uint8, intent="label")
    nibabel.save(made, folder / "a.nii")
    (folder / "a.nii.txt").write_text("".join(f"{i} part_{i}\n" for i in range(1, 5)))
    (folder / "a.nii.lut").write_bytes(bytes(np.random.default_rng(1).integers(1, 255, 768).astype(np.uint8)))


def analyze(kind):
    made = kind(values((5, 6, 7), np.int16), np.diag([1.5, 2.0, 2.5, 1.0]))
    made.header["descrip" if "descrip" in made.header else "db_name"] = b"spm"
    return made


def read_spacing(path):
    """Analyze: the spacing alone."""
    loaded = nibabel.load(path)
    answer = read(path)
    answer.affine = np.diag([*np.abs(np.array(loaded.header["pixdim"][1:4], float)), 1.0])
    return answer


def read(path):
    """As nibabel has it, in mm: it does not convert units."""
    loaded = nibabel.load(path)
    if path.suffix == ".nii" and float(nibabel.load(path).dataobj.offset) < 348:
        raise ValueError("nibabel takes the header for samples")
    if loaded.get_data_dtype().fields:
        parts = np.asanyarray(loaded.dataobj)
        data = np.stack([parts[name].astype(float) for name in parts.dtype.names], axis=-1)[:, :, :, np.newaxis]
    else:
        data = loaded.get_fdata()
    data = data.reshape(data.shape + (1,) * (5 - data.ndim))
    placed = isinstance(loaded.header, nibabel.Nifti1Header) and (loaded.header["sform_code"] > 0 or loaded.header["qform_code"] > 0)
    unit = {"meter": 1000.0, "micron": 0.001}.get(loaded.header.get_xyzt_units()[0], 1.0) if hasattr(loaded.header, "get_xyzt_units") else 1.0
    return Answer(fields={(t, c): data[..., t, c] for t in range(data.shape[3]) for c in range(data.shape[4])},
                  affine=np.diag([unit] * 3 + [1.0]) @ loaded.affine if placed else None)


def sample(name, file, make, kind, reader=read):
    header = file.replace(".img", ".hdr")
    return Sample(name, file, lambda folder: nibabel.save(make(), folder / file), lambda folder: [Header(folder / header, kind)],
                  lambda folder: reader(folder / file), tuple({header, file} - {file}))


def with_extension():
    plain = sample("extension", "a.nii", lambda: extended(image(nibabel.Nifti1Image, (5, 6, 7), np.int16)), nibabel.Nifti1Image.header_class)
    plain.documents = lambda folder: [Header(folder / "a.nii", nibabel.Nifti1Image.header_class),
                                      HeaderDocument(folder / "a.nii", "extension", EXTENSION, 348)]
    return plain


def atlas():
    return Sample("atlas", "a.nii", labelled, lambda folder: [LabelLines(folder / "a.nii.txt"), LabelColours(folder / "a.nii.lut")],
                  lambda folder: read(folder / "a.nii"), ("a.nii.txt", "a.nii.lut"))


def packed():
    made = sample("packed", "a.nii.gz", lambda: image(nibabel.Nifti1Image, (5, 6, 7), np.int16), nibabel.Nifti1Image.header_class)
    made.documents = lambda folder: []
    return made


def samples(_):
    one, two = nibabel.Nifti1Image, nibabel.Nifti2Image
    return [
        sample("sform", "a.nii", lambda: image(one, (5, 6, 7), np.int16, slope=(2.0, 3.0)), one.header_class),
        sample("qform", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, sform=False, qform=True), one.header_class),
        sample("neither", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, sform=False), one.header_class),
        sample("both", "a.nii", lambda: image(one, (5, 6, 7), np.float32, qform=True, units=("micron", "msec")), one.header_class),
        sample("times", "a.nii", lambda: told(image(one, (5, 6, 7, 3), np.int16)), one.header_class),
        sample("vectors", "a.nii", lambda: image(one, (5, 6, 7, 1, 3), np.float32, intent="vector"), one.header_class),
        sample("statistics", "a.nii", lambda: image(one, (5, 6, 7), np.float32, intent=("t test", (10,), "contrast")), one.header_class),
        sample("rgb", "a.nii", lambda: image(one, (5, 6, 7), COLOUR), one.header_class),
        sample("spectrum", "a.nii", lambda: image(one, (5, 6, 7, 4), np.float32, units=("mm", "ppm")), one.header_class),
        sample("labels", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, intent="label"), one.header_class),
        sample("second", "b.nii", lambda: image(two, (5, 6, 7), np.int32, slope=(0.5, -1.0)), two.header_class),
        with_extension(), atlas(), packed(),
        sample("analyze", "d.img", lambda: analyze(nibabel.AnalyzeImage), nibabel.AnalyzeImage.header_class, read_spacing),
        sample("spm", "d.img", lambda: analyze(nibabel.Spm99AnalyzeImage), nibabel.Spm99AnalyzeImage.header_class, read_spacing),
        sample("pair", "c.img", lambda: image(nibabel.Nifti1Pair, (5, 6, 7), np.int16), nibabel.Nifti1Pair.header_class),
    ]
