"""MRC and CCP4 by mrcfile: the 1024 bytes of the header, with IMOD's fields in what the definition leaves free, and the extended header."""

import gzip

import mrcfile
import numpy as np

from ablation import Answer, CannotWrite, Change, Sample
from documents import HeaderDocument

FIELDS = [
    ("nx", "i4"),
    ("ny", "i4"),
    ("nz", "i4"),
    ("mode", "i4"),
    ("nxstart", "i4"),
    ("nystart", "i4"),
    ("nzstart", "i4"),
    ("mx", "i4"),
    ("my", "i4"),
    ("mz", "i4"),
    ("cella", "f4", 3),
    ("cellb", "f4", 3),
    ("mapc", "i4"),
    ("mapr", "i4"),
    ("maps", "i4"),
    ("dmin", "f4"),
    ("dmax", "f4"),
    ("dmean", "f4"),
    ("ispg", "i4"),
    ("nsymbt", "i4"),
    ("extra1", "V8"),
    ("exttyp", "S4"),
    ("nversion", "i4"),
    ("extra2", "V16"),
    ("imod_nint", "i2"),
    ("imod_nreal", "i2"),
    ("imod_sub", "i2"),
    ("imod_zfac", "i2"),
    ("imod_ranges", "f4", 4),
    ("imodStamp", "i4"),
    ("imodFlags", "i4"),
    ("imod_idtype", "i2"),
    ("imod_lens", "i2"),
    ("imod_nd1", "i2"),
    ("imod_nd2", "i2"),
    ("imod_vd1", "i2"),
    ("imod_vd2", "i2"),
    ("imod_tiltangles", "f4", 6),
    ("origin", "f4", 3),
    ("map", "S4"),
    ("machst", "u1", 4),
    ("rms", "f4"),
    ("nlabl", "i4"),
    ("label", "S80", 10),
]
KINDS = {"label": "comment"}
ROLES = {"cella": "spacing", "mx": "spacing", "my": "spacing", "mz": "spacing", "origin": "affine", "nxstart": "affine", "mapc": "affine"}
NAMES = {
    "nx": ("size", "truncated", "voxels", "bytes"),
    "ny": ("size", "truncated", "voxels", "bytes"),
    "nz": ("size", "truncated", "voxels", "bytes"),
    "mode": ("mode", "truncated"),
    "nsymbt": ("extended header", "truncated", "bytes"),
    "mx": ("intervals", "grid", "MX", "spacing"),
    "my": ("intervals", "grid", "spacing"),
    "mz": ("intervals", "grid", "volumes", "spacing"),
    "cella": ("cell", "spacing"),
    "cellb": ("angle", "cell"),
    "mapc": ("MAPC", "axes", "axis"),
    "mapr": ("MAPC", "axes", "axis"),
    "maps": ("MAPC", "axes", "axis"),
    "map": ("MAP ",),
    "machst": ("byte order", "MAP "),
    "ispg": ("space group", "stack", "volumes"),
}
STAMP = 1146047817
TYPES = {0: np.int8, 1: np.int16, 2: np.float32, 6: np.uint16, 12: np.float16}


def order_of(data):
    return ">" if data[212] == 0x11 else "<"


class Header(HeaderDocument):
    def __init__(self, path, name):
        data = path.read_bytes()
        super().__init__(path, name, np.dtype(FIELDS).newbyteorder(order_of(data)), kinds=KINDS, roles=ROLES, names=NAMES)

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            key = node.path.split("/")[-1]
            if key == "mode":
                node.more = [
                    Change(f"samples are {np.dtype(t).name}", lambda m=m: self._encode(m), same=True)
                    for m, t in TYPES.items()
                    if m in (1, 2, 6)
                ]
            elif key == "machst":
                node.more = [Change("the other byte order", self._swap, same=True)]
            elif key == "mapc":
                node.more = [Change("axes exchanged", self._exchange)]
            elif key == "imodFlags":
                node.words = (0, 1, 2, 4)
            elif key == "ispg":
                node.words = (0, 1, 401)
        return nodes

    def _samples(self):
        order = order_of(self.data)
        at = 1024 + int(self.header["nsymbt"][0])
        return at, np.frombuffer(bytes(self.data[at:]), np.dtype(TYPES[int(self.header["mode"][0])]).newbyteorder(order))

    def _encode(self, mode):
        at, stored = self._samples()
        changed = stored.astype(np.dtype(TYPES[mode]).newbyteorder(order_of(self.data)))
        if not np.array_equal(changed, stored):
            raise CannotWrite("values")
        self.header["mode"] = mode
        self.data[at:] = changed.tobytes()

    def _swap(self):
        at, stored = self._samples()
        if self.header["nsymbt"][0] or self.header["imodStamp"][0]:
            raise CannotWrite("the extended header has the byte order of the file")
        self.data[at:] = stored.byteswap().tobytes()
        self.header = self.header.astype(self.header.dtype.newbyteorder())
        self.header["machst"] = (0x11, 0x11, 0, 0) if self.header["machst"][0][0] == 0x44 else (0x44, 0x44, 0, 0)

    def _exchange(self):
        self.header["mapc"], self.header["mapr"] = self.header["mapr"].copy(), self.header["mapc"].copy()


def values(shape, dtype=np.float32, low=1):
    return np.random.default_rng(5).integers(low, 120, shape).astype(dtype)


def write(folder, stored, name="a.mrc", volumes=False, extended=None, **fields):
    with mrcfile.new(folder / name, overwrite=True) as file:
        file.set_data(stored)
        if volumes:
            file.set_volume() if stored.ndim == 3 else None
        file.voxel_size = (1.5, 2.0, 2.5)
        file.header.nxstart, file.header.nystart, file.header.nzstart = fields.pop("start", (0, 0, 0))
        file.header.origin = fields.pop("origin", (0, 0, 0))
        file.add_label("made by a program")
        if extended is not None:
            file.set_extended_header(np.frombuffer(extended, np.uint8))
            file.header.exttyp = fields.pop("exttyp", b"CCP4")
        for name_, value in fields.items():
            file.header[name_] = value


def swapped(folder):
    write(folder, values((7, 6, 5)), origin=(10, 20, 30))
    header = Header(folder / "a.mrc", "header")
    header._swap()
    header.save()


def turned(folder):
    """Columns along z, as crystallographers' programs write it: mx, my, mz and the cell are along x, y, z."""
    write(folder, values((5, 6, 7)), start=(3, 2, 1))
    with mrcfile.open(folder / "a.mrc", "r+") as file:
        file.header.mapc, file.header.mapr, file.header.maps = 3, 2, 1
        file.header.mx, file.header.my, file.header.mz = 10, 12, 14
        file.header.cella = (15, 24, 35)


def imod(folder, flags, dtype=np.int8):
    write(folder, values((7, 6, 5), dtype, -100), origin=(10, 20, 30))
    header = Header(folder / "a.mrc", "header")
    header.header["imodStamp"], header.header["imodFlags"], header.header["exttyp"] = STAMP, flags, b"SERI"
    header.save()


def packed(folder):
    write(folder, values((7, 6, 5)), origin=(10, 20, 30))
    (folder / "a.mrc.gz").write_bytes(gzip.compress((folder / "a.mrc").read_bytes()))
    (folder / "a.mrc").unlink()


def tilts(folder):
    """A tilt series with FEI's extended header, an entry for each image."""
    write(folder, values((7, 6, 5), np.int16), extended=np.zeros(7 * 128, np.uint8).tobytes(), exttyp=b"FEI1", name="a.st")


# The foreign reader.


def read(path):
    """Voxels by mrcfile; places by the definition of 2014. Bytes are unsigned where IMOD's stamp and flags say so."""
    with mrcfile.open(path, permissive=True) as file:
        stored, header = file.data, file.header
        order = [int(header.mapc), int(header.mapr), int(header.maps)]
        if sorted(order) != [1, 2, 3] or not np.allclose([header.cellb.alpha, header.cellb.beta, header.cellb.gamma], 90):
            raise ValueError("axes")
        raw = np.frombuffer(header.tobytes(), np.dtype(FIELDS).newbyteorder(header.dtype["nx"].byteorder), 1)
        if int(header.mode) == 0 and raw["imodStamp"][0] == STAMP and not raw["imodFlags"][0] & 1:
            stored = stored.view(np.uint8)
        if stored.ndim == 3:
            stored = stored[np.newaxis]
        step = np.array([header.cella.x, header.cella.y, header.cella.z], float) / [int(header.mx), int(header.my), int(header.mz)]
        at = np.array([header.origin.x, header.origin.y, header.origin.z], float)
        if not at.any():
            starts = dict(zip(order, (int(header.nxstart), int(header.nystart), int(header.nzstart))))
            at = np.array([starts[axis] for axis in (1, 2, 3)]) * step
        affine = np.eye(4)
        affine[:3, 3] = at
        for column, axis in enumerate(order):
            affine[:3, column] = np.eye(3)[axis - 1] * step
        if np.any(step <= 0) or not np.all(np.isfinite(affine)):
            raise ValueError("no lengths")
        return Answer(fields={(t, 0): volume.transpose(2, 1, 0).astype(float) for t, volume in enumerate(stored)}, affine=affine)


def sample(name, write_file, file="a.mrc", documents=None):
    return Sample(
        name, file, write_file, documents or (lambda folder: [Header(folder / file, "header")]), lambda folder: read(folder / file)
    )


def samples(_):
    return [
        sample("floats", lambda folder: write(folder, values((7, 6, 5)), origin=(10, 20, 30))),
        sample("imod-signed", lambda folder: imod(folder, 1)),
        sample("imod-unsigned", lambda folder: imod(folder, 0)),
        sample("starts", lambda folder: write(folder, values((7, 6, 5), np.int16), start=(-3, 2, 4))),
        sample("words", lambda folder: write(folder, values((7, 6, 5), np.uint16), nversion=20141)),
        sample("halves", lambda folder: write(folder, values((7, 6, 5), np.float16))),
        sample("bytes", lambda folder: write(folder, values((7, 6, 5), np.int8, -100))),
        sample("big-endian", swapped),
        sample("turned", turned),
        sample("volumes", lambda folder: write(folder, values((3, 7, 6, 5), np.int16))),
        sample("images", lambda folder: write(folder, values((7, 6, 5), np.int16), "a.mrcs", ispg=0), "a.mrcs"),
        sample("symmetry", lambda folder: write(folder, values((7, 6, 5)), "a.ccp4", extended=b"X,Y,Z".ljust(80), ispg=1), "a.ccp4"),
        sample("imod-origin", lambda folder: imod(folder, 4, np.int16)),
        sample("tilts", tilts, "a.st"),
        sample("packed", packed, "a.mrc.gz", documents=lambda folder: []),
    ]
