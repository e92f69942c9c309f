"""NIfTI-1, NIfTI-2 and Analyze 7.5, by nibabel. The header's fields are those of nibabel's dtypes."""
import nibabel
import numpy as np

from ablation import Answer, Change, Sample
from documents import HeaderDocument

KINDS = {"descrip": "comment", "aux_file": "comment", "db_name": "comment", "intent_name": "comment"}
ROLES = {"scl_slope": "scale", "scl_inter": "offset", "pixdim": "spacing", "xyzt_units": "unit", "srow_x": "affine", "srow_y": "affine",
         "srow_z": "affine", "qoffset_x": "affine"}
NAMES = {"dim": ("size", "dimension", "bytes"), "srow_x": ("sform",), "srow_y": ("sform",), "srow_z": ("sform",), "quatern_b": ("qform",),
         "quatern_c": ("qform",), "quatern_d": ("qform",), "qoffset_x": ("qform",), "qoffset_y": ("qform",), "qoffset_z": ("qform",),
         "vox_offset": ("offset",), "magic": ("n+1", "ni1", "NIfTI"), "sizeof_hdr": ("NIfTI",), "datatype": ("type",), "bitpix": ("bits",)}
TYPES = (np.uint8, np.int16, np.int32, np.float32, np.float64)


class Header(HeaderDocument):
    """The header of a file, and its samples in other types and in the other byte order."""

    def __init__(self, path, kind):
        super().__init__(path, "header", kind.template_dtype, split=("dim", "pixdim"), kinds=KINDS, roles=ROLES, names=NAMES)
        self.kind, self.whole = kind, None

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            if node.path == "header/datatype" and self.path.suffix == ".nii":
                node.more = [Change(f"samples are {np.dtype(t).name}", lambda t=t: self._encode(t), same=True) for t in TYPES]
                node.more.append(Change("the other byte order", self._swap, same=True))
        return nodes

    def _encode(self, dtype):
        image = nibabel.load(self.path)
        stored = np.asanyarray(image.dataobj.get_unscaled()).astype(dtype)
        header = image.header.copy()
        header.set_data_dtype(dtype)
        self.whole = self._bytes(header, stored)

    def _swap(self):
        image = nibabel.load(self.path)
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


def values(shape, dtype):
    random = np.random.default_rng(5)
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
        made.header.set_intent(intent)
    return made


def read(path):
    """As nibabel has it, in mm: it does not convert units."""
    loaded = nibabel.load(path)
    data = loaded.get_fdata()
    data = data.reshape(data.shape + (1,) * (5 - data.ndim))
    placed = loaded.header["sform_code"] > 0 or loaded.header["qform_code"] > 0
    unit = {"meter": 1000.0, "micron": 0.001}.get(loaded.header.get_xyzt_units()[0], 1.0) if hasattr(loaded.header, "get_xyzt_units") else 1.0
    return Answer(fields={(t, c): data[..., t, c] for t in range(data.shape[3]) for c in range(data.shape[4])},
                  affine=np.diag([unit] * 3 + [1.0]) @ loaded.affine if placed else None)


def sample(name, file, make, kind):
    header = file.replace(".img", ".hdr")
    return Sample(name, file, lambda folder: nibabel.save(make(), folder / file), lambda folder: [Header(folder / header, kind)],
                  lambda folder: read(folder / file), tuple({header, file} - {file}))


def samples(_):
    one, two = nibabel.Nifti1Image, nibabel.Nifti2Image
    return [
        sample("sform", "a.nii", lambda: image(one, (5, 6, 7), np.int16, slope=(2.0, 3.0)), one.header_class),
        sample("qform", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, sform=False, qform=True), one.header_class),
        sample("neither", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, sform=False), one.header_class),
        sample("both", "a.nii", lambda: image(one, (5, 6, 7), np.float32, qform=True, units=("micron", "msec")), one.header_class),
        sample("times", "a.nii", lambda: image(one, (5, 6, 7, 3), np.int16), one.header_class),
        sample("labels", "a.nii", lambda: image(one, (5, 6, 7), np.uint8, intent="label"), one.header_class),
        sample("second", "b.nii", lambda: image(two, (5, 6, 7), np.int32, slope=(0.5, -1.0)), two.header_class),
        sample("pair", "c.img", lambda: image(nibabel.Nifti1Pair, (5, 6, 7), np.int16), nibabel.Nifti1Pair.header_class),
    ]
