"""Documents of common kinds: JSON, XML, lines of text, headers of fixed size."""
import json
import pathlib
import re

import lxml.etree
import numpy as np

from ablation import CannotWrite, Document, Node


class JsonDocument(Document):
    """Members and entries of a JSON file. `name`: its first word in paths. Lists of numbers and of words are one node; other lists have
    a node for each entry."""

    def __init__(self, path, name):
        self.path, self.name = pathlib.Path(path), name
        self.root = json.loads(self.path.read_text())

    def nodes(self):
        return list(self._walk(self.root, self.name))

    def _walk(self, value, path):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in entries:
            here = f"{path}/{key if isinstance(value, dict) else '*'}"
            leaf = not isinstance(entry, (dict, list)) or (isinstance(entry, list) and entry and not any(isinstance(e, (dict, list)) for e in entry))
            yield Node(here, entry if leaf else None, (lambda new, v=value, k=key: v.__setitem__(k, new)) if leaf else None,
                       lambda v=value, k=key: v.__delitem__(k))
            if not leaf:
                yield from self._walk(entry, here)

    def add(self, path, value):
        words = path.split("/")[1:]
        here = self.root
        for word in words[:-1]:
            if word == "*":
                if not isinstance(here, list) or not here:
                    raise CannotWrite(path)
                here = here[0]
            elif isinstance(here, dict) and word in here:
                here = here[word]
            else:
                raise CannotWrite(path)
        if not isinstance(here, dict) or value is None:
            raise CannotWrite(path)
        here[words[-1]] = value

    def save(self):
        self.path.write_text(json.dumps(self.root, indent=1))


class XmlDocument(Document):
    """Attributes, texts and elements of an XML file."""

    def __init__(self, path, name, text=None):
        """`text`: the XML itself, if it is a part of a file; save() then leaves it in `text`."""
        self.path, self.name = path and pathlib.Path(path), name
        source = text if text is not None else self.path.read_bytes()
        self.root = lxml.etree.fromstring(source.encode() if isinstance(source, str) else source)
        self.text = text

    def nodes(self):
        return list(self._walk(self.root, self.name))

    @staticmethod
    def _tag(element):
        return lxml.etree.QName(element).localname

    def _walk(self, element, path):
        for key, value in element.attrib.items():
            yield Node(f"{path}/@{lxml.etree.QName(key).localname}", value, lambda new, e=element, k=key: e.set(k, str(new)),
                       lambda e=element, k=key: e.attrib.pop(k))
        if element.text and element.text.strip():
            yield Node(f"{path}/text", element.text, lambda new, e=element: setattr(e, "text", str(new)), lambda e=element: setattr(e, "text", None))
        for child in element:
            if not isinstance(child.tag, str):
                continue
            here = f"{path}/{self._tag(child)}"
            yield Node(here, None, None, lambda e=element, c=child: e.remove(c))
            yield from self._walk(child, here)

    def add(self, path, value):
        words = path.split("/")[1:]
        here = self.root
        for word in words[:-1]:
            below = [child for child in here if isinstance(child.tag, str) and self._tag(child) == word]
            if not below:
                raise CannotWrite(path)
            here = below[0]
        if not words or not words[-1].startswith("@") or value is None:
            raise CannotWrite(path)
        here.set(words[-1][1:], str(value))

    def save(self):
        told = lxml.etree.tostring(self.root, xml_declaration=self.text is None, encoding="UTF-8")
        if self.text is None:
            self.path.write_bytes(told)
        else:
            self.text = told.decode()


class LinesDocument(Document):
    """Lines `key SEPARATOR value` at the beginning of a file, up to what matches `end` (kept as it is, with the samples behind it)."""

    def __init__(self, path, name, separator, end=None, comment=None):
        self.path, self.name, self.separator = pathlib.Path(path), name, separator
        data = self.path.read_bytes()
        found = re.search(end, data) if end else None
        at = found.start() if found else len(data)
        self.tail = data[at:]
        self.lines = data[:at].decode("latin-1").split("\n")
        self.comment = comment

    def nodes(self):
        nodes = []
        for number, line in enumerate(self.lines):
            if self.separator not in line or (self.comment and line.startswith(self.comment)):
                continue
            key, value = line.split(self.separator, 1)
            if key.strip():
                nodes.append(Node(f"{self.name}/{key.strip()}", value.strip(),
                                  lambda new, n=number, k=key: self.lines.__setitem__(n, f"{k}{self.separator} {new}"),
                                  lambda n=number: self.lines.__setitem__(n, None)))
        return nodes

    def add(self, path, value):
        if value is None:
            raise CannotWrite(path)
        at = len(self.lines) - (1 if self.lines and not self.lines[-1] else 0)
        self.lines.insert(self.place(at), f"{path.split('/')[-1]}{self.separator} {value}")

    def place(self, at):
        """Where a new line goes: `at`, behind all others, unless the format wants a line to be the last."""
        return at

    def save(self):
        self.path.write_bytes("\n".join(line for line in self.lines if line is not None).encode("latin-1") + self.tail)


class HeaderDocument(Document):
    """A header of fixed size, as a NumPy dtype says. Fields of several numbers are one node; so is each of `split` for each number."""

    def __init__(self, path, name, dtype, offset=0, split=(), kinds=None, roles=None, names=None):
        self.path, self.name, self.offset, self.split = pathlib.Path(path), name, offset, split
        self.data = bytearray(self.path.read_bytes())
        self.header = np.frombuffer(bytes(self.data[offset:offset + dtype.itemsize]), dtype, 1).copy()
        self.kinds, self.roles, self.names = kinds or {}, roles or {}, names or {}

    def nodes(self):
        nodes = []
        for field in self.header.dtype.names:
            value = self.header[field][0]
            more = dict(kind=self.kinds.get(field, ""), role=self.roles.get(field, ""), names=tuple(self.names.get(field, ())))
            if isinstance(value, np.ndarray) and field in self.split:
                for i in range(value.size):
                    nodes.append(Node(f"{self.name}/{field}/{i}", value[i], lambda new, f=field, i=i: self._set(f, new, i), **more))
            elif isinstance(value, bytes):
                nodes.append(Node(f"{self.name}/{field}", value.decode("latin-1"), lambda new, f=field: self._set(f, new.encode("latin-1")), **more))
            else:
                nodes.append(Node(f"{self.name}/{field}", value, lambda new, f=field: self._set(f, new), **more))
        return nodes

    def _set(self, field, value, index=None):
        try:
            if index is None:
                self.header[field][0] = value
            else:
                self.header[field][0][index] = value
        except (OverflowError, TypeError, ValueError) as error:
            raise CannotWrite(str(error)) from error

    def save(self):
        self.data[self.offset:self.offset + self.header.dtype.itemsize] = self.header.tobytes()
        self.path.write_bytes(bytes(self.data))
