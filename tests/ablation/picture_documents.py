"""Pictures: chunks of PNG, segments of JPEG, boxes of JPEG 2000, the header of BMP; the header of NumPy; files that say the same."""

import ast
import io
import pathlib
import struct
import zlib

import numpy as np
from PIL import Image, TiffImagePlugin

from ablation import CannotWrite, Document, Node
from documents import HeaderDocument


class Together(Document):
    """Documents of one class that say the same, such as a picture for each slice: a change changes all of them."""

    def __init__(self, documents):
        self.documents = documents

    def nodes(self):
        listed = [document.nodes() for document in self.documents]
        first = listed[0]
        for i, node in enumerate(first):
            same = [nodes[i] for nodes in listed if i < len(nodes) and nodes[i].path == node.path]
            node.set, node.remove = node.set and self._of(same, "set"), node.remove and self._of(same, "remove")
        return first

    @staticmethod
    def _of(nodes, what):
        acts = [getattr(node, what) for node in nodes]
        return lambda *values: [act(*values) for act in acts]

    def add(self, path, value):
        for document in self.documents:
            document.add(path, value)

    def save(self):
        for document in self.documents:
            document.save()


# Fields of PNG's chunks, by the specification; big endian.
PNG = {
    "IHDR": (
        ("width", "I"),
        ("height", "I"),
        ("bit depth", "B"),
        ("colour type", "B"),
        ("compression", "B"),
        ("filter", "B"),
        ("interlace", "B"),
    ),
    "pHYs": (("x", "I"), ("y", "I"), ("unit", "B")),
    "gAMA": (("gamma", "I"),),
    "sRGB": (("intent", "B"),),
    "cHRM": tuple((name, "I") for name in ("white x", "white y", "red x", "red y", "green x", "green y", "blue x", "blue y")),
    "tIME": (("year", "H"), ("month", "B"), ("day", "B"), ("hour", "B"), ("minute", "B"), ("second", "B")),
    "oFFs": (("x", "i"), ("y", "i"), ("unit", "B")),
}
ROLES = {"pHYs/x": "spacing", "pHYs/y": "spacing", "pHYs/unit": "unit"}
NAMES = {
    "IHDR/width": ("size", "truncated", "png"),
    "IHDR/height": ("size", "truncated", "png"),
    "IHDR/bit depth": ("bit depth", "bits", "png"),
    "IHDR/colour type": ("colour", "color", "png", "components"),
    "IHDR/interlace": ("interlace", "png"),
    "IHDR": ("png", "IHDR"),
    "IHDR/compression": ("compression", "png"),
    "IHDR/filter": ("filter", "png"),
    "PLTE": ("palette", "png"),
    "IDAT": ("png", "truncated"),
    "IEND": ("png", "truncated"),
}


def packed_nodes(here, part, fields, at, about, kind=""):
    """Nodes of big-endian numbers one behind the other, from `at` on in part[1]. `about`: names and role of each, by its own name."""
    nodes = []
    for name, letter in fields:
        (value,) = struct.unpack_from(">" + letter, part[1], at)
        nodes.append(Node(f"{here}/{name}", value, lambda new, a=at, x=letter: set_packed(part, a, x, new), None, *about(name), kind))
        at += struct.calcsize(letter)
    return nodes


def set_packed(part, at, letter, value):
    try:
        struct.pack_into(">" + letter, part[1], at, int(value))
    except struct.error as error:
        raise CannotWrite(str(error)) from error


class PngDocument(Document):
    def __init__(self, path, name="png"):
        self.path, self.name = pathlib.Path(path), name
        data = self.path.read_bytes()
        self.chunks, at = [], 8
        while at < len(data):
            (size,) = struct.unpack_from(">I", data, at)
            self.chunks.append([data[at + 4 : at + 8].decode(), bytearray(data[at + 8 : at + 8 + size])])
            at += 12 + size

    def nodes(self):
        nodes = []
        for chunk in self.chunks:
            kind, data = chunk
            here = f"{self.name}/{kind}"
            text = "comment" if kind in ("tEXt", "zTXt", "iTXt") else "date" if kind == "tIME" else ""
            nodes.append(
                Node(
                    here,
                    bytes(data) if kind not in ("IDAT", "PLTE") else None,
                    None,
                    lambda c=chunk: self.chunks.remove(c),
                    NAMES.get(kind, ()),
                    kind=text,
                )
            )
            about = lambda name, kind=kind: (NAMES.get(f"{kind}/{name}", ()), ROLES.get(f"{kind}/{name}", ""))
            nodes += packed_nodes(here, chunk, PNG.get(kind, ()), 0, about, text)
            if kind == "PLTE":
                nodes.append(Node(f"{here}/colours", list(data), lambda new, c=chunk: c.__setitem__(1, bytearray(new)), names=("palette",)))
            elif kind == "tRNS":
                nodes.append(
                    Node(f"{here}/alphas", list(data), lambda new, c=chunk: c.__setitem__(1, bytearray(new)), names=("alpha", "transparen"))
                )
        return nodes

    def add(self, path, value):
        kind = path.split("/")[-1]
        if len(kind) != 4 or not isinstance(value, bytes) or any(chunk[0] == kind for chunk in self.chunks):
            raise CannotWrite(path)
        self.chunks.insert(1, [kind, bytearray(value)])

    def save(self):
        told = b"\x89PNG\r\n\x1a\n"
        for kind, data in self.chunks:
            body = kind.encode() + bytes(data)
            told += struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
        self.path.write_bytes(told)


JFIF = (("major", "B"), ("minor", "B"), ("units", "B"), ("x density", "H"), ("y density", "H"), ("thumbnail x", "B"), ("thumbnail y", "B"))
FRAME = (("precision", "B"), ("height", "H"), ("width", "H"), ("components", "B"))
JPEG_ROLES = {"x density": "spacing", "y density": "spacing", "units": "unit"}
JPEG_NAMES = {
    "precision": ("bits", "precision", "jpeg"),
    "height": ("size", "jpeg", "truncated"),
    "width": ("size", "jpeg", "truncated"),
    "components": ("components", "jpeg", "colour"),
    "sampling": ("jpeg",),
}


class JpegDocument(Document):
    """Segments up to the scan: JFIF, EXIF (by Pillow), Adobe, comments, the frame."""

    def __init__(self, path, name="jpeg"):
        self.path, self.name = pathlib.Path(path), name
        data = self.path.read_bytes()
        self.segments, at = [], 2
        while data[at + 1] != 0xDA:
            (size,) = struct.unpack_from(">H", data, at + 2)
            self.segments.append([data[at + 1], bytearray(data[at + 4 : at + 2 + size])])
            at += 2 + size
        self.scan = data[at:]
        self.exif = Image.open(io.BytesIO(data)).getexif()
        self.exif_changed = False

    def nodes(self):
        nodes = []
        for segment in self.segments:
            marker, data = segment
            if marker == 0xE0 and data[:4] == b"JFIF":
                nodes += self._fields("JFIF", segment, JFIF, 5)
            elif marker in (0xC0, 0xC1, 0xC2):
                nodes += self._fields("frame", segment, FRAME, 0)
            elif marker == 0xEE and data[:5] == b"Adobe":
                nodes += self._fields("Adobe", segment, (("transform", "B"),), 11)
            elif marker == 0xFE:
                nodes.append(Node(f"{self.name}/comment", None, None, lambda s=segment: self.segments.remove(s), kind="comment"))
        for tag, value in sorted(self.exif.items()):
            word = TiffImagePlugin.TiffTags.TAGS_V2.get(tag)
            key = word.name if word else str(tag)
            plain = float(value) if isinstance(value, TiffImagePlugin.IFDRational) else value
            nodes.append(
                Node(
                    f"{self.name}/exif/{key}",
                    plain,
                    lambda new, t=tag: self._set_exif(t, new),
                    lambda t=tag: self._drop_exif(t),
                    kind="comment" if key in ("Make", "Model", "Software", "ImageDescription") else "date" if key == "DateTime" else "",
                    role="spacing" if key.endswith("Resolution") else "",
                    words=(1, 3, 6, 8) if key == "Orientation" else (),
                )
            )
        return nodes

    def _fields(self, kind, segment, fields, at):
        nodes = [Node(f"{self.name}/{kind}", None, None, lambda s=segment: self.segments.remove(s), ("jpeg",))]
        nodes += packed_nodes(f"{self.name}/{kind}", segment, fields, at, lambda name: (JPEG_NAMES.get(name, ()), JPEG_ROLES.get(name, "")))
        return nodes

    def _set_exif(self, tag, value):
        self.exif[tag], self.exif_changed = value, True

    def _drop_exif(self, tag):
        del self.exif[tag]
        self.exif_changed = True

    def save(self):
        if self.exif_changed:
            self.segments = [s for s in self.segments if not (s[0] == 0xE1 and s[1][:4] == b"Exif")]
            self.segments.insert(1, [0xE1, bytearray(self.exif.tobytes())])
        told = b"\xff\xd8"
        for marker, data in self.segments:
            told += bytes([0xFF, marker]) + struct.pack(">H", len(data) + 2) + bytes(data)
        self.path.write_bytes(told + self.scan)


BMP = np.dtype(
    [
        ("signature", "S2"),
        ("file_size", "<u4"),
        ("reserved", "<u4"),
        ("data_offset", "<u4"),
        ("header_size", "<u4"),
        ("width", "<i4"),
        ("height", "<i4"),
        ("planes", "<u2"),
        ("bits", "<u2"),
        ("compression", "<u4"),
        ("image_size", "<u4"),
        ("x_per_metre", "<i4"),
        ("y_per_metre", "<i4"),
        ("colours", "<u4"),
        ("important_colours", "<u4"),
    ]
)
BMP_NAMES = {
    "signature": ("bmp",),
    "width": ("size", "truncated"),
    "height": ("size", "truncated", "rows"),
    "bits": ("bits", "truncated"),
    "data_offset": ("offset", "truncated", "bytes"),
    "header_size": ("header",),
    "colours": ("palette", "colour"),
    "planes": ("planes",),
}


def bmp_document(path, name="bmp"):
    return HeaderDocument(path, name, BMP, names=BMP_NAMES, roles={"x_per_metre": "spacing", "y_per_metre": "spacing"})


BOXES = {
    b"ihdr": (
        ("height", "I"),
        ("width", "I"),
        ("components", "H"),
        ("bits", "B"),
        ("compression", "B"),
        ("unknown colour", "B"),
        ("intellectual property", "B"),
    ),
    b"colr": (("method", "B"), ("precedence", "B"), ("approximation", "B"), ("space", "I")),
    b"resc": (
        ("vertical over", "H"),
        ("vertical under", "H"),
        ("horizontal over", "H"),
        ("horizontal under", "H"),
        ("vertical exponent", "b"),
        ("horizontal exponent", "b"),
    ),
}
SIZ = (
    ("capabilities", "H"),
    ("width", "I"),
    ("height", "I"),
    ("x offset", "I"),
    ("y offset", "I"),
    ("tile width", "I"),
    ("tile height", "I"),
    ("tile x offset", "I"),
    ("tile y offset", "I"),
    ("components", "H"),
    ("bits", "B"),
    ("x step", "B"),
    ("y step", "B"),
)


class Jp2Document(Document):
    """The boxes of JP2 and the SIZ segment of the codestream, each in its place."""

    def __init__(self, path, name="jp2"):
        self.path, self.name = pathlib.Path(path), name
        self.data = bytearray(self.path.read_bytes())

    def nodes(self):
        nodes = []
        for box, fields in BOXES.items():
            at = self.data.find(box)
            if at >= 0:
                nodes += self._fields(box.decode(), fields, at + 4)
        at = self.data.find(b"\xff\x51")
        return nodes + self._fields("SIZ", SIZ, at + 4)

    def _fields(self, kind, fields, at):
        nodes = []
        for name, letter in fields:
            (value,) = struct.unpack_from(">" + letter, self.data, at)
            nodes.append(
                Node(
                    f"{self.name}/{kind}/{name}",
                    value,
                    lambda new, a=at, x=letter: self._set(a, x, new),
                    None,
                    ("jp2", "JPEG 2000", "size"),
                )
            )
            at += struct.calcsize(letter)
        return nodes

    def _set(self, at, letter, value):
        try:
            struct.pack_into(">" + letter, self.data, at, int(value))
        except struct.error as error:
            raise CannotWrite(str(error)) from error

    def save(self):
        self.path.write_bytes(bytes(self.data))


class NpyDocument(Document):
    """The entries of the header, a dictionary as Python writes it."""

    def __init__(self, path, name="npy"):
        self.path, self.name = pathlib.Path(path), name
        data = self.path.read_bytes()
        self.version = data[6:8]
        size = struct.unpack_from("<H" if self.version[0] == 1 else "<I", data, 8)[0]
        at = 10 if self.version[0] == 1 else 12
        self.header, self.tail, self.array = ast.literal_eval(data[at : at + size].decode("latin-1")), data[at + size :], None

    def nodes(self):
        nodes = [
            Node(
                f"{self.name}/version",
                self.version[0],
                lambda new: setattr(self, "version", bytes([int(new), 0])),
                names=("version", "npy", "header"),
            )
        ]
        for key, value in self.header.items():
            node = Node(
                f"{self.name}/{key}",
                list(value) if isinstance(value, tuple) else value,
                lambda new, k=key: self.header.__setitem__(k, tuple(new) if isinstance(new, list) else new),
                lambda k=key: self.header.pop(k),
                {"shape": ("size", "truncated", "bytes", "axes"), "descr": ("type", "truncated", "dtype")}.get(key, ()),
            )
            if key == "descr":
                node.words = ("<f4", ">f4", "|u1", "<i2", "<c8", "|O", "|S4", "<U1")
            nodes.append(node)
        return nodes

    def add(self, path, value):
        raise CannotWrite(path)

    def save(self):
        text = repr(self.header).encode()
        first = self.version[0] == 1
        size = -(-(len(text) + 1 + (10 if first else 12)) // 64) * 64 - (10 if first else 12)
        self.path.write_bytes(
            b"\x93NUMPY" + self.version + struct.pack("<H" if first else "<I", size) + text.ljust(size - 1) + b"\n" + self.tail
        )
