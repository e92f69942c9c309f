"""MGH by nibabel: FreeSurfer's header, and what follows the voxels."""

import gzip

import nibabel
import numpy as np
from nibabel.freesurfer.mghformat import MGHImage

from ablation import Answer, CannotWrite, Change, Sample
from documents import HeaderDocument

HEADER = np.dtype(
    [
        ("version", ">i4"),
        ("dims", ">i4", 4),
        ("type", ">i4"),
        ("dof", ">i4"),
        ("goodRASFlag", ">i2"),
        ("delta", ">f4", 3),
        ("Mdc", ">f4", 9),
        ("Pxyz_c", ">f4", 3),
    ]
)
FOOTER = np.dtype([("tr", ">f4"), ("flip_angle", ">f4"), ("te", ">f4"), ("ti", ">f4"), ("fov", ">f4")])
NAMES = {
    "dims": ("size", "truncated", "voxels", "dimension"),
    "type": ("type", "truncated"),
    "version": ("MGH", "version"),
    "delta": ("spacing", "voxel", "step"),
    "Mdc": ("axes", "cosines", "ras", "direction"),
    "Pxyz_c": ("c_ras", "centre"),
    "goodRASFlag": ("ras_good_flag",),
}
ROLES = {"delta": "spacing", "Mdc": "affine", "Pxyz_c": "affine"}
TYPES = (np.uint8, np.int16, np.int32, np.float32)


class Part(HeaderDocument):
    """A part of a file, which may be compressed."""

    def __init__(self, path, name, dtype, offset=0):
        self.packed = path.suffix == ".mgz"
        self.file = path
        if self.packed:
            path.write_bytes(gzip.decompress(path.read_bytes()))
        super().__init__(path, name, dtype, offset, names=NAMES, roles=ROLES)
        if self.packed:
            path.write_bytes(gzip.compress(path.read_bytes(), mtime=0))
        self.encoded = False

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            key = node.path.split("/")[-1]
            if key == "type":
                node.more = [Change(f"samples are {np.dtype(t).name}", lambda t=t: self._encode(t), same=True) for t in TYPES]
                node.words = (0, 1, 3, 4, 10)
            elif key == "Mdc":
                values = np.array(node.value)
                node.more = [Change("axes exchanged", lambda v=values, n=node: n.set(np.r_[v[3:6], v[:3], v[6:]]))]
            elif key == "Pxyz_c":
                node.words = ([1.0, 2.0, 3.0],)
        return nodes

    def _encode(self, dtype):
        if not self.header["goodRASFlag"][0]:
            raise CannotWrite("nibabel writes axes")
        loaded = nibabel.load(self.path)
        nibabel.save(MGHImage(np.asarray(loaded.dataobj).astype(dtype), loaded.affine, loaded.header), self.path)
        image = nibabel.load(self.path)
        if image.get_data_dtype() != np.dtype(dtype).newbyteorder(">"):
            image.header.set_data_dtype(dtype)
            nibabel.save(MGHImage(np.asarray(loaded.dataobj).astype(dtype), loaded.affine, image.header), self.path)
        self.encoded = True

    def save(self):
        if self.encoded:
            return
        super().save()
        if self.packed:
            self.path.write_bytes(gzip.compress(self.path.read_bytes(), mtime=0))


def affine():
    turned, _ = np.linalg.qr(np.array([[-0.9, 0.1, 0.0], [0.0, 0.1, 0.9], [0.1, -0.9, 0.1]]))
    matrix = np.eye(4)
    matrix[:3, :3] = turned @ np.diag([1.5, 2.0, 2.5])
    matrix[:3, 3] = [10, -20, 30]
    return matrix


def write(folder, shape, dtype, name="a.mgh", tags=b""):
    made = MGHImage(np.random.default_rng(5).integers(1, 120, shape).astype(dtype), affine())
    made.header["tr"], made.header["flip_angle"], made.header["te"], made.header["ti"], made.header["fov"] = (
        2300.0,
        0.14,
        2.98,
        900.0,
        256.0,
    )
    nibabel.save(made, folder / name)
    if tags:
        with open(folder / name, "ab") as file:
            file.write(tags)


def unplaced(folder):
    write(folder, (5, 6, 7), np.uint8)
    part = Part(folder / "a.mgh", "header", HEADER)
    part.header["goodRASFlag"] = 0
    part.save()


def command_tag():
    """Tags behind the voxels, as FreeSurfer writes them: the talairach transform (31) and a command line (3)."""
    return b"".join(
        int(tag).to_bytes(4, "big") + len(text).to_bytes(8, "big") + text
        for tag, text in ((31, b"transforms/talairach.xfm\0"), (3, b"mri_convert a.nii a.mgh ProgramVersion: 7.4\0"))
    )


def read(path):
    """By nibabel; a volume without axes has FreeSurfer's coronal ones, which nibabel 5.4 turns."""
    loaded = nibabel.load(path)
    data = loaded.get_fdata()
    data = data.reshape(data.shape + (1,) * (4 - data.ndim))
    raw = gzip.decompress(path.read_bytes()) if path.suffix == ".mgz" else path.read_bytes()
    affine = loaded.affine
    if int.from_bytes(raw[28:30], "big") == 0:
        affine = np.eye(4)
        affine[:3, :3] = np.array([[-1, 0, 0], [0, 0, 1], [0, -1, 0]])
        affine[:3, 3] = -affine[:3, :3] @ (np.array(data.shape[:3]) / 2)
    return Answer(fields={(t, 0): data[..., t] for t in range(data.shape[3])}, affine=affine)


def sample(name, write_file, file="a.mgh", footer=None, document="header"):
    def documents(folder):
        found = [Part(folder / file, document, HEADER)]
        return found + ([Part(folder / file, "footer", FOOTER, 284 + footer)] if footer else [])

    return Sample(name, file, write_file, documents, lambda folder: read(folder / file))


def samples(_):
    return [
        sample("floats", lambda folder: write(folder, (5, 6, 7), np.float32, tags=command_tag()), footer=840),
        sample("bytes", lambda folder: write(folder, (5, 6, 7), np.uint8), footer=210),
        sample("shorts", lambda folder: write(folder, (5, 6, 7), np.int16), footer=420),
        sample("packed", lambda folder: write(folder, (5, 6, 7), np.int32, "a.mgz"), "a.mgz"),
        sample("times", lambda folder: write(folder, (5, 6, 7, 3), np.float32), footer=2520),
        sample("unplaced", unplaced, document="unplaced"),
    ]
