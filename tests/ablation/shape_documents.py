"""Documents of meshes, lines and points: headers of PLY, keywords of OBJ, the JSON of GLB, tables, the end of FreeSurfer's surfaces."""
import json
import pathlib
import struct

from ablation import CannotWrite, Document, Node
from documents import JsonDocument, LinesDocument
from vtk_documents import as_numbers, as_words


class KeywordLines(Document):
    """Lines that begin with a keyword, between two others. Lines with the same keyword (the first `words` words) are one node, which is
    removed as a whole; the value is that of the first one."""
    def __init__(self, path, name, end=None, words=1, separator=" ", leave=(), names=None):
        """`leave`: keywords that only hold lines together. `names`: words by which messages name a keyword."""
        self.path, self.name, self.words, self.separator = pathlib.Path(path), name, words, separator
        self.leave, self.names = leave, names or {}
        data = self.path.read_bytes()
        at = data.index(end) if end else len(data)
        self.tail = data[at:]
        self.lines = data[:at].decode("latin-1").split("\n")

    def _split(self, line):
        words = line.strip().split(self.separator)
        return "/".join(words[:self.words]), self.separator.join(words[self.words:])

    def nodes(self):
        nodes = {}
        for number, line in enumerate(self.lines):
            if not line.strip()[:1].isalpha():
                continue
            key, value = self._split(line)
            if key not in nodes and key not in self.leave:
                nodes[key] = Node(f"{self.name}/{key}",
                                  as_numbers(value),
                                  lambda new, n=number, k=key: self._set(n, k, new),
                                  lambda k=key: self._remove(k),
                                  names=self.names.get(key, ()))
        return list(nodes.values())

    def _set(self, number, key, value):
        self.lines[number] = self.separator.join([*key.split("/"), as_words(value)])

    def _remove(self, key):
        self.lines = [line for line in self.lines if not line.strip() or self._split(line)[0] != key]

    def add(self, path, value):
        if value is None:
            raise CannotWrite(path)
        self.lines.insert(1, self.separator.join([*path.split("/")[1:], as_words(value)]))

    def save(self):
        self.path.write_bytes("\n".join(self.lines).encode("latin-1") + self.tail)


class PlyHeader(Document):
    """Lines of a PLY header: `property float x` of the element before is vertex/x, of the value `float`."""
    def __init__(self, path):
        self.path = pathlib.Path(path)
        data = self.path.read_bytes()
        at = data.index(b"end_header")
        self.tail, self.lines = data[at:], data[:at].decode("latin-1").rstrip("\n").split("\n")

    def nodes(self):
        nodes, element = [], ""
        for number, line in enumerate(self.lines[1:], 1):
            words = line.split()
            element = words[1] if words[0] == "element" else element
            if words[0] == "property":
                nodes.append(
                    self._node(number,
                               f"{element}/{words[-1]}",
                               words[1:-1],
                               lambda v, w=words: ["property", *v, w[-1]], ("propert", element)))
                nodes.append(
                    self._node(number, f"{element}/{words[-1]}/name", [words[-1]], lambda v, w=words: [*w[:-1], *v], ("propert", element)))
            elif words[0] == "element":
                nodes.append(
                    self._node(number, f"{element}/count", [words[2]], lambda v, w=words: [*w[:2], *v], ("vertex", "face", "element")))
            else:
                nodes.append(self._node(number, "/".join(words[:1]), words[1:], lambda v, w=words: [w[0], *v]))
        return nodes

    def _node(self, number, path, value, line, names=()):
        kind = "comment" if path in ("comment", "obj_info") and "SPACE" not in " ".join(value) else ""
        path = "comment/space" if path == "comment" and not kind else path
        names = (*names, "truncated", "list of")  # then the samples do not fit any more
        return Node(f"ply/{path}",
                    " ".join(value),
                    lambda new: self.lines.__setitem__(number, " ".join(line(str(new).split()))),
                    lambda: self.lines.__setitem__(number, None),
                    names=names,
                    kind=kind)

    def add(self, path, value):
        if not path.startswith("ply/comment"):
            raise CannotWrite(path)
        self.lines.insert(2, f"comment {value}")

    def save(self):
        self.path.write_bytes("\n".join(line for line in self.lines if line is not None).encode("latin-1") + b"\n" + self.tail)


class GlbJson(JsonDocument):
    """The JSON chunk of a binary glTF file."""

    NAMES = {
        "byteOffset": ("bytes", "index"),
        "bufferView": ("index", "components"),
        "count": ("rows", ),
        "buffer": ("numbers", ),
        "byteLength": ("bytes", ),
        "primitives": ("vertex", ),
        "attributes": ("index", "vertex"),
        "COLOR_0": ("accessor", ),
        "NORMAL": ("accessor", ),
        "POSITION": ("accessor", "vertex"),
        "indices": ("accessor", "index"),
        "mode": ("vertex", ),
        "mesh": ("vertex", ),
        "nodes": ("vertex", ),
        "accessors": ("accessor", )
    }

    def __init__(self, path):
        self.path, self.name = pathlib.Path(path), "glb"
        data = self.path.read_bytes()
        length = struct.unpack_from("<I", data, 12)[0]
        self.root, self.tail = json.loads(data[20:20 + length]), data[20 + length:]

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            node.names = self.NAMES.get(next(word for word in reversed(node.path.split("/")) if word != "*"), ())
        return nodes

    def save(self):
        text = json.dumps(self.root).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + self.tail
        self.path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


class TableDocument(Document):
    """The columns of a table, by the names of its header; lines before it that begin with `#` say the rest."""
    def __init__(self, path, name, separator=",", header=None):
        self.path, self.name, self.separator = pathlib.Path(path), name, separator
        self.lines = self.path.read_text().splitlines()
        self.at = next(i for i, line in enumerate(self.lines) if (line.startswith(header) if header else not line.startswith("#")))
        self.prefix = header or ""
        self.columns = [word.strip() for word in self.lines[self.at][len(self.prefix):].split(separator)]
        self.rows = [line.split(separator) for line in self.lines[self.at + 1:]]

    def nodes(self):
        nodes = []
        for number, line in enumerate(self.lines[:self.at]):
            if "=" in line:
                key, value = line.lstrip("# ").split("=", 1)
                nodes.append(
                    Node(f"{self.name}/{key.strip()}",
                         value.strip(),
                         lambda new, n=number, k=key: self.lines.__setitem__(n, f"# {k}= {new}"),
                         lambda n=number: self.lines.__setitem__(n, "#")))
        for i, column in enumerate(self.columns):
            nodes.append(
                Node(f"{self.name}/{column}/name",
                     column,
                     lambda new, i=i: self.columns.__setitem__(i, str(new)),
                     lambda i=i: self._remove(i),
                     names=("column", )))
            nodes.append(
                Node(f"{self.name}/{column}/rows",
                     as_numbers(" ".join(row[i] for row in self.rows)),
                     lambda new, i=i: self._set(i, new),
                     names=("column", *(("radius", ) if column == "r" else ()))))
        return nodes

    def _remove(self, column):
        for row in (self.columns, *self.rows):
            del row[column]

    def _set(self, column, text):
        for row, word in zip(self.rows, as_words(text).split() + [""] * len(self.rows)):
            row[column] = word

    def add(self, path, value):
        _, column, what = path.split("/")
        if what != "rows" or column in self.columns:
            raise CannotWrite(path)
        self.columns.append(column)
        words = as_words(value).split()
        for number, row in enumerate(self.rows):
            row.append(words[number % len(words)])

    def save(self):
        lines = [*self.lines[:self.at], self.prefix + self.separator.join(self.columns), *(self.separator.join(row) for row in self.rows)]
        self.path.write_text("\n".join(lines) + "\n")


class SurfaceEnd(LinesDocument):
    """The geometry of the volume at the end of a FreeSurfer surface: `cras = 1 2 3`, behind the triangles."""
    def __init__(self, path):
        super().__init__(path, "surface", "=")
        data = self.path.read_bytes()
        at = data.index(b"valid = ")
        self.head, self.tail = data[:at], b""
        self.lines = data[at:].decode("latin-1").split("\n")

    def save(self):
        super().save()
        self.path.write_bytes(self.head + self.path.read_bytes())


class TckLines(LinesDocument):
    """The header of MRtrix tracks. `file: . 123` is where the places begin: it is moved with them, unless it is the change itself."""
    def __init__(self, *args):
        super().__init__(*args)
        self.length, self.file = len(self._head()), self._file()

    def _head(self):
        return "\n".join(line for line in self.lines if line is not None)

    def _file(self):
        return next((i, line) for i, line in enumerate(self.lines) if line is not None and line.startswith("file:"))

    def save(self):
        number, line = self.file
        if self.lines[number] == line:
            words = line.split()
            moved = len(self._head()) - self.length
            told = f"{int(words[-1]) + moved:0{len(words[-1])}}"  # as long as before, so that nothing moves again
            self.lines[number] = " ".join([*words[:-1], told])
        super().save()
