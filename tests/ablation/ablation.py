"""What formats give the runner: samples, the documents in them, and the nodes of those: what a file says, one thing at a time."""
import dataclasses
import itertools
import math
import numbers
import re
import typing

import numpy as np


class CannotWrite(Exception):
    """The document cannot hold such a value there."""


@dataclasses.dataclass
class Change:
    """One way to change a node. `same`: the file says the same in another way (another type, another byte order), so nothing may change."""
    name: str
    make: typing.Callable[[], None]
    same: bool = False


@dataclasses.dataclass
class Node:
    """One thing that a document says.

    path: from the document's own name on, with `*` for an index: "header/pixdim/*". The same path in two samples is the same thing.
    value: a number, truth value, text, list of those, or bytes.
    set, remove: change the open document. None: it cannot.
    names: words by which a message may name it, besides the last word of the path.
    role: "scale", "offset", "fill", "unit", "spacing" or "affine": such nodes are changed in pairs, too.
    kind: "identifier", "date" or "comment", by its type in the format's definition alone: one row of harmless.tsv is for all of a kind.
    more: further changes, such as another type with the samples encoded again.
    words: other values that the format's definition lists; else those of other samples are tried.
    """
    path: str
    value: object
    set: typing.Optional[typing.Callable[[object], None]] = None
    remove: typing.Optional[typing.Callable[[], None]] = None
    names: tuple = ()
    role: str = ""
    kind: str = ""
    more: list = dataclasses.field(default_factory=list)
    words: tuple = ()


class Document:
    """A file, or a part of one, that is read and written by a library of others. Made anew for each change, from a fresh copy of the sample."""

    def nodes(self) -> list:
        """In the same order each time."""
        raise NotImplementedError

    def add(self, path, value):
        """Says what it did not say: a node of another sample's document of the same class. CannotWrite: there is no place for it."""
        raise CannotWrite(path)

    def save(self):
        """Writes the file."""
        raise NotImplementedError


@dataclasses.dataclass
class Answer:
    """What the foreign reader makes of a sample, in the world of Slabstream (docs/rendering.md). What is None is not compared.

    fields: voxels [x, y, z] by (time, channel); those that are not there are not compared.
    affine: from indices x, y, z of those voxels to the world; or `places`, the coordinates of voxels along each axis.
    vertices, triangles, values: of a shape; vertices in any order.
    """
    fields: dict = dataclasses.field(default_factory=dict)
    affine: typing.Optional[np.ndarray] = None
    places: typing.Optional[list] = None
    vertices: typing.Optional[np.ndarray] = None
    triangles: typing.Optional[np.ndarray] = None
    values: typing.Optional[np.ndarray] = None
    facts: dict = dataclasses.field(default_factory=dict)  # facts of observe_sources that must be equal, by name: {"times": [3, 2.5, "s"]}
    tolerance: float = 2e-6


@dataclasses.dataclass
class Sample:
    """A file as a foreign program writes it.

    write: makes it in an empty folder. source: what Slabstream opens, from that folder on, perhaps with options. documents: the open
    documents of a folder. read: the foreign reader; None: there is none. sidecars: files of the folder that are left out one at a time.
    """
    name: str
    source: str
    write: typing.Callable
    documents: typing.Callable
    read: typing.Optional[typing.Callable] = None
    sidecars: tuple = ()


def is_number(value):
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def numbers_in(text):
    """Of a text that consists of numbers and of what divides them: the numbers and the pieces between; else None."""
    found = list(NUMBER.finditer(text))
    rest = NUMBER.sub("", text)
    if not found or not re.fullmatch(r"[\s,;()\[\]{}|\\x]*", rest):
        return None
    return [float(match[0]) if re.search(r"[.eE]", match[0]) else int(match[0]) for match in found], NUMBER.split(text)[::3]


def as_text(values, pieces):
    return "".join(itertools.chain.from_iterable(itertools.zip_longest(pieces, (repr(value) for value in values), fillvalue="")))


def simple(value):
    """Python's own numbers instead of NumPy's."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [simple(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def changed_numbers(values):
    """Lists of numbers instead of these, by name; the same length."""
    changes = {"times 2": [2 * v for v in values], "negated": [-v for v in values], "0": [0 * v for v in values]}
    if len(values) > 1:
        changes["reversed"] = list(reversed(values))
    elif all(isinstance(v, int) for v in values):
        changes["plus 1"] = [v + 1 for v in values]
    return changes


def other_values(node, mined):
    """Values instead of a node's, by name. `mined`: those of the same path in other samples."""
    value = simple(node.value)
    changes = {}
    if isinstance(value, bool):
        changes["inverted"] = not value
    elif is_number(value):
        changes = {name: values[0] for name, values in changed_numbers([value]).items()}
    elif isinstance(value, str):
        found = numbers_in(value)
        if found is not None:
            changes = {name: as_text(values, found[1]) for name, values in changed_numbers(found[0]).items()}
        elif value:
            changes["empty"] = ""
    elif isinstance(value, list) and value:
        if all(is_number(v) for v in value):
            changes = changed_numbers(value)
        elif len(value) > 1:
            changes = {"reversed": value[::-1], "without the last": value[:-1]}
    for other in [simple(word) for word in (*node.words, *mined)]:
        if not same_value(other, value):
            changes[f"is {other!r}"[:60]] = other
    return {name: other for name, other in changes.items() if not same_value(other, value)}


def same_value(a, b):
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b):
        return True
    try:
        one, other = np.asarray(a), np.asarray(b)
        if one.dtype.kind in "iuf" and other.dtype.kind in "iuf":
            return one.shape == other.shape and bool(np.allclose(one, other, rtol=1e-4, atol=1e-12, equal_nan=True))
        return bool(np.array_equal(one, other))
    except (TypeError, ValueError):
        return repr(a) == repr(b)


MOST_CHANGES = 6


def changes_of(node, mined):
    """At most six changes of a node: it is not there; other types; other numbers; other words."""
    changes = []
    if node.remove is not None:
        changes.append(Change("removed", node.remove))
    changes += node.more
    if node.set is not None:
        for name, value in other_values(node, mined).items():
            changes.append(Change(name, lambda value=value: node.set(value)))
    return changes[:MOST_CHANGES]
