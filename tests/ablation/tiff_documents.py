"""TIFF files: tags as tifffile names and reads them, and what is written in them (OME-XML, ImageJ's lines and binary block, JSON)."""

import io
import json
import pathlib
import struct

import numpy as np
import tifffile

from ablation import CannotWrite, Change, Document, Node
from documents import JsonDocument, LinesDocument, XmlDocument

SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}
LETTERS = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 11: "f", 12: "d", 13: "I", 16: "Q", 17: "q", 18: "Q"}
DESCRIPTION, SUB_IFDS = 270, 330
KINDS = {
    "DateTime": "date",
    "Software": "comment",
    "Artist": "comment",
    "HostComputer": "comment",
    "Make": "comment",
    "Model": "comment",
    "Copyright": "comment",
    "DocumentName": "comment",
    "PageName": "comment",
}
ROLES = {
    "XResolution": "spacing",
    "YResolution": "spacing",
    "ResolutionUnit": "unit",
    "ModelPixelScaleTag": "spacing",
    "GDAL_NODATA": "fill",
}
NAMES = {
    "ImageWidth": ("size", "pixels", "truncated"),
    "ImageLength": ("size", "pixels", "truncated", "rows", "strips"),
    "BitsPerSample": ("bits", "type"),
    "SampleFormat": ("sample format", "type", "format", "predictor"),
    "SamplesPerPixel": ("samples", "components"),
    "StripOffsets": ("strip", "truncated"),
    "StripByteCounts": ("strip", "truncated"),
    "TileOffsets": ("tile", "truncated"),
    "TileByteCounts": ("tile", "truncated"),
    "Compression": ("compress", "decoding"),
    "PhotometricInterpretation": ("photometric", "0 as white", "colour", "samplesperpixel"),
    "NewSubfileType": ("reduced", "resolution"),
    "SubIFDs": ("level",),
    "RowsPerStrip": ("strip",),
    "TileWidth": ("tile",),
    "TileLength": ("tile",),
    "ImageDescription": ("description",),
    "ExtraSamples": ("alpha", "components"),
    "ImageDepth": ("slices",),
    "PlanarConfiguration": ("planes",),
    "ColorMap": ("colour map",),
}
ONE_OF_MANY = ("like the first",)  # how messages speak of a page that differs
STRUCTURE = ("StripOffsets", "StripByteCounts", "TileOffsets", "TileByteCounts", "SubIFDs", "TileWidth", "TileLength")  # where samples lie


class Ifd:
    """A directory: entries (tag, type, count, bytes of the value), in the byte order of the file."""

    def __init__(self, data, at, order, big):
        self.order = order
        (count,) = struct.unpack_from(order + ("Q" if big else "H"), data, at)
        at += 8 if big else 2
        self.entries = []
        for _ in range(count):
            tag, kind, number = struct.unpack_from(order + ("HHQ" if big else "HHI"), data, at)
            size, field = SIZES[kind] * number, at + (12 if big else 8)
            place = field if size <= (8 if big else 4) else struct.unpack_from(order + ("Q" if big else "I"), data, field)[0]
            self.entries.append([tag, kind, number, bytes(data[place : place + size])])
            at += 20 if big else 12
        (self.next,) = struct.unpack_from(order + ("Q" if big else "I"), data, at)

    def index(self, tag):
        return next((i for i, entry in enumerate(self.entries) if entry[0] == tag), None)

    def remove(self, tag):
        at = self.index(tag)
        if at is not None:
            del self.entries[at]

    def set(self, tag, kind, value):
        entry = [tag, kind, *self._encoded(kind, value)]
        at = self.index(tag)
        if at is None:
            self.entries.append(entry)
            self.entries.sort(key=lambda e: e[0])
        else:
            self.entries[at] = entry

    def _encoded(self, kind, value):
        try:
            if kind in (2, 7):
                data = value if isinstance(value, bytes) else str(value).encode() + (b"\0" if kind == 2 else b"")
                return len(data), data
            values = value if isinstance(value, (list, tuple)) else [value]
            if kind in (5, 10):
                flat = [int(v) for v in values]
                return len(flat) // 2, struct.pack(f"{self.order}{len(flat)}{'I' if kind == 5 else 'i'}", *flat)
            number = float if kind in (11, 12) else int
            return len(values), struct.pack(f"{self.order}{len(values)}{LETTERS[kind]}", *[number(v) for v in values])
        except (struct.error, TypeError, ValueError, KeyError) as error:
            raise CannotWrite(str(error)) from error


class TiffBytes:
    """The directories of a file. save() writes them anew behind all else."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.data = bytearray(self.path.read_bytes())
        self.order = "<" if self.data[:2] == b"II" else ">"
        self.big = 43 in self.data[2:4]
        self.ifds = []
        (at,) = struct.unpack_from(self.order + ("Q" if self.big else "I"), self.data, 8 if self.big else 4)
        while at:
            self.ifds.append(Ifd(self.data, at, self.order, self.big))
            at = self.ifds[-1].next

    def save(self):
        pointer, word, room = (8, "Q", 8) if self.big else (4, "I", 4)
        for ifd in self.ifds:
            places = []
            for _, _, _, value in ifd.entries:
                self.data += b"\0" * (len(self.data) % 2)
                places.append(len(self.data))
                if len(value) > room:
                    self.data += value
            self.data += b"\0" * (-len(self.data) % 8)
            struct.pack_into(self.order + word, self.data, pointer, len(self.data))
            self.data += struct.pack(self.order + ("Q" if self.big else "H"), len(ifd.entries))
            for (tag, kind, number, value), place in zip(ifd.entries, places):
                self.data += struct.pack(self.order + ("HHQ" if self.big else "HHI"), tag, kind, number)
                self.data += value.ljust(room, b"\0") if len(value) <= room else struct.pack(self.order + word, place)
            pointer = len(self.data)
            self.data += struct.pack(self.order + word, 0)
        self.path.write_bytes(bytes(self.data))


class TagsDocument(Document):
    """The tags of all pages (`page` None), or of one page that says otherwise than the others."""

    def __init__(self, path, name, page=None, hidden=(DESCRIPTION,)):
        self.path, self.name, self.page, self.hidden = pathlib.Path(path), name, page, hidden
        self.tiff, self.whole = TiffBytes(path), None

    def _ifds(self):
        return self.tiff.ifds if self.page is None else self.tiff.ifds[self.page : self.page + 1]

    def nodes(self):
        nodes = []
        with tifffile.TiffFile(self.path) as file:
            page = file.pages[self.page or 0]
            for tag in page.tags:
                if tag.code in self.hidden or self._ifds()[0].index(tag.code) is None:
                    continue
                kind = self._ifds()[0].entries[self._ifds()[0].index(tag.code)][1]
                node = self._node(tag, kind)
                nodes.append(node)
        return nodes

    def _node(self, tag, kind):
        value = getattr(tag.value, "value", tag.value)
        value = [int(v) for v in value] if isinstance(value, (tuple, list)) and value and kind not in (11, 12) else value
        value = list(value) if isinstance(value, tuple) else value
        if isinstance(value, (bytes, np.ndarray)) or not isinstance(value, (int, float, str, list)):
            value = None
        if tag.name in STRUCTURE:
            value = None
        node = Node(
            f"{self.name}/{tag.name}",
            value,
            None if value is None else lambda new, t=tag.code, k=kind: self._set(t, k, new),
            lambda t=tag.code: self._remove(t),
            NAMES.get(tag.name, ()) + (ONE_OF_MANY if self.page is not None else ()),
            ROLES.get(tag.name, ""),
            KINDS.get(tag.name, ""),
        )
        if tag.name == "Compression" and self.page is None:
            node.more = [
                Change(name, lambda o=options: self._rewrite(**o), same=True)
                for name, options in (
                    ("Deflate in tiles", dict(compression="zlib", tile=(16, 16))),
                    ("LZW, predictor", dict(compression="lzw", predictor=True)),
                    ("other byte order", dict(swap=True)),
                    ("BigTIFF", dict(bigtiff=True)),
                )
            ]
        return node

    def _set(self, tag, kind, value):
        for ifd in self._ifds():
            if ifd.index(tag) is not None:
                ifd.set(tag, kind, value)

    def _remove(self, tag):
        for ifd in self._ifds():
            ifd.remove(tag)

    def _rewrite(self, swap=False, bigtiff=False, predictor=None, **options):
        """The same pages by tifffile, stored in another way."""
        made = io.BytesIO()
        with tifffile.TiffFile(self.path) as file:
            order = {"<": ">", ">": "<"}[file.byteorder] if swap else file.byteorder
            if any(page.subifds for page in file.pages):
                raise CannotWrite("levels")
            with tifffile.TiffWriter(made, bigtiff=bigtiff or file.is_bigtiff, byteorder=order) as writer:
                for page in file.pages:
                    tags = page.tags
                    if 50839 in tags:
                        raise CannotWrite("ImageJ's block has the byte order of the file")
                    keep = dict(options, predictor=predictor if page.bitspersample % 8 == 0 else None)
                    resolution = (tags[282].value, tags[283].value) if 282 in tags and 283 in tags else None
                    extra = [
                        (t.code, t.dtype, t.count, t.value, True) for t in tags if t.code in (42113, 33550, 33922, 34735, 34737, 42112)
                    ]
                    writer.write(
                        page.asarray(),
                        photometric=page.photometric,
                        description=page.description.encode() or None,
                        metadata=None,
                        resolution=resolution,
                        resolutionunit=tags[296].value if 296 in tags else None,
                        extratags=extra,
                        planarconfig=page.planarconfig if page.samplesperpixel > 1 else None,
                        subfiletype=int(page.subfiletype),
                        colormap=page.colormap,
                        **keep,
                    )
        self.whole = made.getvalue()

    def add(self, path, value):
        tag = tifffile.TIFF.TAGS[path.split("/")[-1]] if path.split("/")[-1] in tifffile.TIFF.TAGS else None
        code = {"XResolution": 5, "YResolution": 5, "GDAL_NODATA": 2, "GDAL_METADATA": 2, "ModelPixelScaleTag": 12, "ModelTiepointTag": 12}
        name = path.split("/")[-1]
        if tag is None or value is None or name in STRUCTURE:
            raise CannotWrite(path)
        for ifd in self._ifds():
            if ifd.index(tag) is not None:
                raise CannotWrite(path)
            ifd.set(tag, code.get(name, 2 if isinstance(value, str) else 12 if isinstance(value, float) else 3), value)

    def save(self):
        if self.whole is not None:
            self.path.write_bytes(self.whole)
        else:
            self.tiff.save()


def description_of(path):
    with tifffile.TiffFile(path) as file:
        return file.pages[0].tags[DESCRIPTION].value


def set_description(path, text):
    tiff = TiffBytes(path)
    tiff.ifds[0].set(DESCRIPTION, 2, text.encode("utf-8", "replace") + b"\0")
    tiff.save()


OME_KINDS = {"Description": "comment", "AcquisitionDate": "date", "AnnotationRef": "identifier"}


class OmeDocument(XmlDocument):
    """The OME-XML in the first page, or in a file of its own."""

    def __init__(self, path, name="ome", xml=False):
        self.file = None if xml else pathlib.Path(path)
        super().__init__(path, name, None if xml else description_of(path))

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            last = node.path.split("/")[-1]
            if last in ("@ID", "@UUID") or node.path.endswith("UUID/text") or "Ref" in last:
                node.kind = "identifier"
            elif last in ("@Creator", "@Fluor") or node.path.endswith(("Image/@Name", "StageLabel/@Name", "Key/text", "Value/text")):
                node.kind = "comment"
            node.kind = node.kind or next((kind for word, kind in OME_KINDS.items() if word in node.path.split("/")), "")
            node.names, node.role = OME_NAMES.get(last, ()), OME_ROLES.get(last, "")
            node.words = OME_WORDS.get(last, ())
        return nodes

    def save(self):
        super().save()
        if self.file is not None:
            set_description(self.file, '<?xml version="1.0" encoding="UTF-8"?>' + self.text)


OME_NAMES = {
    "@SizeZ": ("plane", "page", "slices"),
    "@SizeC": ("plane", "page", "channel"),
    "@SizeT": ("plane", "page", "time"),
    "@IFD": ("page", "directory"),
    "@PlaneCount": ("page", "plane"),
    "@FirstZ": ("plane", "page"),
    "@FirstC": ("plane", "page"),
    "@FirstT": ("plane", "page"),
    "@FileName": ("file",),
    "TiffData": ("page", "plane"),
    "@SizeX": ("size", "pixels"),
    "@SizeY": ("size", "pixels"),
    "@Type": ("type",),
    "Pixels": ("OME", "image"),
    "Image": ("image", "OME"),
    "Channel": ("channel",),
    "@SamplesPerPixel": ("samples", "components", "channel"),
}
OME_ROLES = {
    "@PhysicalSizeX": "spacing",
    "@PhysicalSizeY": "spacing",
    "@PhysicalSizeZ": "spacing",
    "@TimeIncrement": "spacing",
    "@PhysicalSizeXUnit": "unit",
    "@PhysicalSizeYUnit": "unit",
    "@PhysicalSizeZUnit": "unit",
    "@TimeIncrementUnit": "unit",
}
LENGTHS, TIMES = ("nm", "mm", "pixel"), ("ms", "min", "h")
OME_WORDS = {
    "@PhysicalSizeXUnit": LENGTHS,
    "@PhysicalSizeYUnit": LENGTHS,
    "@PhysicalSizeZUnit": LENGTHS,
    "@TimeIncrementUnit": TIMES,
    "@DeltaTUnit": TIMES,
    "@DimensionOrder": ("XYZCT", "XYZTC", "XYCTZ", "XYTCZ", "XYTZC", "XYCZT"),
    "@BigEndian": ("true", "false"),
    "@Interleaved": ("true", "false"),
    "@Type": ("uint8", "int16", "uint16", "float"),
    "@PositionXUnit": LENGTHS,
}


class ImageJLines(LinesDocument):
    """ImageJ's description: a line for each key."""

    WORDS = {
        "unit": ("micron", "um", "nm", "inch", "pixel", "cm"),
        "tunit": ("sec", "ms", "min"),
        "mode": ("grayscale", "color", "composite"),
        "order": ("zct", "xyzct", "default"),
        "cf": ("0", "1", "20", "21"),
        "hyperstack": ("true", "false"),
    }
    ROLES = {"spacing": "spacing", "finterval": "spacing", "unit": "unit", "tunit": "unit", "c0": "offset", "c1": "scale"}
    NAMES = {
        "images": ("pages", "pictures"),
        "channels": ("pages", "channel"),
        "slices": ("pages", "slice"),
        "frames": ("pages", "time"),
        "ImageJ": ("pages",),
        "cf": ("calibration", "function"),
        "c0": ("calibrat",),
        "c1": ("calibrat",),
        "vunit": ("calibrated",),
    }

    def __init__(self, path, name="imagej"):
        self.path, self.name, self.separator = pathlib.Path(path), name, "="
        self.lines, self.tail, self.comment = description_of(path).split("\n"), b"", None

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            key = node.path.split("/")[-1]
            node.words, node.role, node.names = self.WORDS.get(key, ()), self.ROLES.get(key, ""), self.NAMES.get(key, ())
            node.set = lambda new, set=node.set: set(new)
        return nodes

    def save(self):
        set_description(self.path, "\n".join(line.replace("= ", "=") for line in self.lines if line is not None))


class ShapedJson(JsonDocument):
    """tifffile's description."""

    def __init__(self, path, name="shaped"):
        self.path, self.name, self.root = pathlib.Path(path), name, json.loads(description_of(path))

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            node.names = ("tifffile",)
        return nodes

    def save(self):
        set_description(self.path, json.dumps(self.root))


class ImageJBlock(Document):
    """ImageJ's binary metadata (tags 50838 and 50839)."""

    def __init__(self, path, name="imagej-block"):
        self.path, self.name = pathlib.Path(path), name
        with tifffile.TiffFile(path) as file:
            self.order = file.byteorder
            self.block = dict(file.pages[0].tags[50839].value)

    def nodes(self):
        nodes = []
        for key, value in self.block.items():
            plain = key in ("Ranges", "Labels", "Info")
            nodes.append(
                Node(
                    f"{self.name}/{key}",
                    list(value) if isinstance(value, tuple) else value if plain else None,
                    (lambda new, k=key: self.block.__setitem__(k, new)) if plain else None,
                    lambda k=key: self.block.pop(k),
                    kind="comment" if key in ("Info", "Labels") else "",
                )
            )
            if key == "LUTs":
                nodes[-1].more = [
                    Change("reversed", lambda: self.block.__setitem__("LUTs", list(self.block["LUTs"])[::-1])),
                    Change("inverted", lambda: self.block.__setitem__("LUTs", [255 - lut for lut in self.block["LUTs"]])),
                ]
        return nodes

    def save(self):
        tiff = TiffBytes(self.path)
        for ifd in tiff.ifds[:1]:
            ifd.remove(50838), ifd.remove(50839)
        made = tifffile.tifffile.imagej_metadata_tag(self.block, self.order)
        for code, kind, count, value, _ in made:
            tiff.ifds[0].set(code, int(kind), np.frombuffer(value, self.order + ("u1" if kind == 1 else "u4")).tolist())
        tiff.save()
