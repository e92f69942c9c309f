"""Documents of VTK's files: XML with arrays by their names, and legacy files in text, block by block."""
import pathlib
import re

from ablation import CannotWrite, Document, Node, numbers_in
from documents import XmlDocument

NAMES = {
    "@WholeExtent": ("extent", "size", "samples"),
    "@Extent": ("extent", "piece", "samples", "voxels", "points", "blocks"),
    "@NumberOfComponents": ("components", "samples"),
    "@NumberOfPoints": ("point", "samples"),
    "@NumberOfCells": ("cells", "samples"),
    "@NumberOfPolys": ("polys", "samples"),
    "@NumberOfLines": ("lines", "samples"),
    "@NumberOfStrips": ("strips", "samples"),
    "@NumberOfVerts": ("verts", "samples"),
    "@NumberOfTuples": ("tuples", "samples"),
    "PointData": ("array", ),
    "CellData": ("array", ),
    "PPointData": ("array", ),
    "PCellData": ("array", ),
    "@type": ("VTKFile", "type"),
    "@Name": ("array", ),
    "@file": ("exist", "named"),
    "@timestep": ("time", ),
    "Collection": ("files", ),
    "vtkMultiBlockDataSet": ("files", ),
    "@Source": ("exist", ),
    "DataSet": ("data set", "file"),
    "DataArray(connectivity)": ("cell", ),
    "DataArray(offsets)": ("cell", "vertex"),
    "DataArray(types)": ("type", ),
    "@Spacing": ("step", ),
    "@compressor": ("compress", "bytes"),
    "@byte_order": ("byte order", "bytes"),
    "@header_type": ("bytes", )
}
ROLES = {"@Spacing": "spacing", "@Origin": "affine", "@Direction": "affine"}
KINDS = {"@version": "version", "@RangeMin": "range", "@RangeMax": "range", "@Scalars": "active"}
VOCABULARY = {"@byte_order": ("LittleEndian", "BigEndian"), "@header_type": ("UInt32", "UInt64")}
HOW = ("@format", "@type", "@NumberOfTuples", "@offset")
DATA = ("PointData", "CellData", "PPointData", "PCellData")


def as_numbers(text):
    """Of a text that consists of numbers the numbers: a change of 0 into -0 is none."""
    found = numbers_in(text)
    return text if found is None else found[0] if len(found[0]) > 1 else found[0][0]


def as_words(value):
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def array_in(path):
    """The name of the array that a path leads to or through."""
    found = re.search(r"Array\(([^)]*)\)", path)
    return found[1] if found else ""


class VtkXml(XmlDocument):
    """Elements of arrays have the arrays' names in their paths. `asked`: arrays that the source asks for; others are of the kind "unread",
    if it asks for any. A text of many numbers is one node."""
    def __init__(self, path, name, asked=()):
        super().__init__(path, name)
        self.asked = asked

    @staticmethod
    def _tag(element):
        tag, name = XmlDocument._tag(element), element.get("Name")
        return f"{tag}({name})" if name and tag.endswith("Array") else tag

    def nodes(self):
        nodes = [node for node in super().nodes() if "/InformationKey/" not in node.path]  # what is in a note goes with it
        for node in nodes:
            words, array = node.path.split("/"), array_in(node.path)
            node.names = (*NAMES.get(words[-2 if words[-1] == "text" else -1], ()), *((array, "array") if array else ()))
            node.role, node.kind, node.words = ROLES.get(words[-1], ""), KINDS.get(words[-1], ""), VOCABULARY.get(words[-1], ())
            if words[-1] == "InformationKey":
                node.kind = "information"
            elif self.asked and array and array not in (*self.asked, "vtkGhostType") and any(word in DATA for word in words):
                node.kind = "unread"
            elif self.asked and "FieldData" in words and words[-1] in HOW:
                node.kind = "unread"
            if "Coordinates" in words:
                node.names = (*node.names, "coordinates")
            if isinstance(node.value, str):
                self._with_numbers(node)
        return nodes

    @staticmethod
    def _with_numbers(node):
        node.value = as_numbers(node.value)
        node.set = lambda new, put=node.set: put(as_words(new))


WORDS = {
    "POINTS": ("count", "type"),
    "SCALARS": ("name", "type", "components"),
    "FIELD": ("name", "count"),
    "CELLS": ("offsets", "size"),
    "CELL_TYPES": ("count", ),
    "X_COORDINATES": ("count", "type"),
    "Y_COORDINATES": ("count", "type"),
    "Z_COORDINATES": ("count", "type"),
    "LOOKUP_TABLE": ("name", ),
    "OFFSETS": ("type", ),
    "CONNECTIVITY": ("type", ),
    "POINT_DATA": ("count", ),
    "CELL_DATA": ("count", ),
    "VERTICES": ("offsets", "size"),
    "LINES": ("offsets", "size"),
    "POLYGONS": ("offsets", "size"),
    "TRIANGLE_STRIPS": ("offsets", "size"),
    "VECTORS": ("name", "type"),
    "NORMALS": ("name", "type"),
    "DATASET": ("kind", ),
    "DIMENSIONS": (),
    "SPACING": (),
    "ORIGIN": (),
    "METADATA": ()
}
ARRAY = re.compile(r"(\S+) (\d+) (\d+) (bit|(unsigned_)?(char|short|int|long)|float|double|string|vtkIdType|vtktype\w+)\s*")
OPENS = {
    "SCALARS": ("LOOKUP_TABLE", "METADATA"),
    "POINTS": ("METADATA", ),
    "CELLS": ("OFFSETS", "CONNECTIVITY"),
    "POLYGONS": ("OFFSETS", "CONNECTIVITY")
}
SECTIONS = ("POINT_DATA", "CELL_DATA")
LEGACY_NAMES = {
    "DIMENSIONS": ("size", "samples"),
    "POINT_DATA": ("samples", "points"),
    "CELL_DATA": ("samples", "cells"),
    "encoding": ("ASCII", "BINARY"),
    "DATASET": ("COORDINATES", "POINTS", "CELLS"),
    "CELLS": ("OFFSETS", "CONNECTIVITY"),
    "SCALARS": ("array", ),
    "FIELD": ("array", "velocity"),
    "SPACING": ("step", ),
    "version": ("first line", )
}


class LegacyLines(Document):
    """A legacy file in text: a block is a line with a keyword, or of an array of a FIELD, and its samples, which go with it."""
    def __init__(self, path, name, asked=()):
        self.path, self.name, self.asked, self.blocks = pathlib.Path(path), name, asked, []
        lines = self.path.read_text().split("\n")
        self.head = lines[:3]
        for line in lines[3:]:
            key = line.split(" ")[0].strip()
            if key in WORDS or ARRAY.fullmatch(line) or not self.blocks:
                self.blocks.append([line])
            else:
                self.blocks[-1].append(line)

    @staticmethod
    def _key(block):
        found = ARRAY.fullmatch(block[0])
        return found[1] if found else block[0].split(" ")[0].strip()

    def nodes(self):
        nodes = [
            Node(f"{self.name}/{name}",
                 line,
                 lambda new, i=i: self.head.__setitem__(i, str(new)),
                 names=LEGACY_NAMES.get(name, ()),
                 kind={
                     "version": "version",
                     "title": "comment"
                 }.get(name, "")) for i, (name, line) in enumerate(zip(("version", "title", "encoding"), self.head))
        ]
        seen = set()
        for block in self.blocks:
            if self._key(block) not in seen:
                seen.add(self._key(block))
                nodes += self._nodes_of(block)
        return nodes

    def _nodes_of(self, block):
        key, words = self._key(block), block[0].split()
        is_array = key not in WORDS
        more = dict(names=(key, *LEGACY_NAMES.get(key, ()), *(("array", "FIELD") if is_array else ())),
                    kind="information" if key == "METADATA" else "",
                    role={
                        "SPACING": "spacing",
                        "ORIGIN": "affine"
                    }.get(key, ""))
        if is_array and self.asked and key not in (*self.asked, "vtkGhostType", "TimeValue", "CYCLE", "units"):
            more["kind"] = "unread"
        whole = Node(f"{self.name}/{key}", None, None, lambda: self._remove(key), **more)
        if not is_array and not WORDS[key]:
            whole.value = as_numbers(" ".join(words[1:]))
            whole.set = lambda new: block.__setitem__(0, f"{key} {as_words(new)}")
            return [whole]
        names = ("components", "tuples", "type") if is_array else WORDS[key]
        return [whole] + [
            Node(f"{self.name}/{key}/{name}", as_numbers(words[i]), lambda new, i=i: self._set(block, i, new), **more)
            for i, name in enumerate(names, 1) if i < len(words)
        ]

    @staticmethod
    def _set(block, index, value):
        words = block[0].split()
        words[index] = str(value)
        block[0] = " ".join(words)

    def _remove(self, key):
        kept, closes, field = [], (), None
        for block in self.blocks:
            here = self._key(block)
            field = block if here == "FIELD" else field
            inside = {"arrays": here not in WORDS or here == "METADATA", "section": here not in SECTIONS}.get(closes, here in closes)
            if here == key or inside:
                if here == key:
                    closes = "section" if here in SECTIONS else "arrays" if here == "FIELD" else OPENS.get(here, ())
                    if here not in WORDS:
                        self._set(field, 2, int(field[0].split()[2]) - 1)
                        closes = ("METADATA", )
            else:
                closes = ()
                kept.append(block)
        self.blocks = kept

    def add(self, path, value):
        raise CannotWrite(path)

    def save(self):
        self.path.write_text("\n".join([*self.head, *(line for block in self.blocks for line in block)]))
