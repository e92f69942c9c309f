"""Metadata of chunked arrays in JSON files (Zarr, N5, Neuroglancer's precomputed volumes), and fields by the names of axes."""
import json
import pathlib
import warnings

import numpy as np

from ablation import Answer, CannotWrite
from documents import JsonDocument

warnings.simplefilter("ignore")  # of zarr-python and xarray, of every file beside an array
AXES = {"x": "x lon longitude rlon nav_lon easting col cols column columns", "y": "y lat latitude rlat nav_lat northing row rows",
        "z": "z depth lev level levels plev height altitude plane planes slice slices section",
        "t": "t time times timepoint timepoints frame frames", "c": "c ch channel channels band bands wavelength"}
KINDS = {name: kind for kind, names in AXES.items() for name in names.split()}


class Metadata(JsonDocument):
    """A part of a JSON file, such as the attributes of a node.

    inside: the members that lead to the part. without: members of the part that another document has. whole: paths below the name that
    are a node without nodes in it. only: the last words of nodes that there are. traits: by the path below the name, or by its last word,
    what a Node has besides (names, role, kind, words, more), and `default`: what the definition says if the node is missing.
    """

    def __init__(self, path, name, inside=(), without=(), whole=(), only=(), traits=None):
        self.path, self.name, self.inside = pathlib.Path(path), name, inside
        self.without, self.whole, self.only, self.traits = without, whole, only, traits or {}
        self.root = self._part(json.loads(self.path.read_text()))
        self.act = None  # instead of writing the metadata

    def _part(self, root):
        for word in self.inside:
            root = root.setdefault(word, {})
        return root

    def nodes(self):
        nodes = []
        for node in super().nodes():
            below = node.path[len(self.name) + 1:]
            inner = [whole for whole in self.whole if below.startswith(whole + "/")]
            if below.split("/")[0] in self.without or inner or (self.only and below.split("/")[-1] not in self.only):
                continue
            traits = dict(self._traits(below))
            if "default" in traits and traits.pop("default") == node.value:
                node.remove = None  # nothing else would be said without it
            for key, value in traits.items():
                setattr(node, key, value(self, node) if callable(value) else value)
            if below in self.whole:
                node.set = None
            nodes.append(node)
        return nodes

    def _traits(self, below):
        return self.traits.get(below) or self.traits.get(below.split("/")[-1]) or {}

    def add(self, path, value):
        if self.only and path.split("/")[-1] not in self.only:
            raise CannotWrite(path)
        super().add(path, value)

    def save(self):
        if self.act is not None:
            return self.act()
        whole = json.loads(self.path.read_text())
        part = self._part(whole)
        kept = {key: part[key] for key in self.without if key in part}
        part.clear()
        part.update({**self.root, **kept})
        self.path.write_text(json.dumps(whole, indent=1))


def numbers(shape, dtype, seed=5, most=120):
    """Samples that differ everywhere."""
    return np.random.default_rng(seed).integers(1, most, shape).astype(dtype)


def kinds_of(names):
    """x, y, z, t or c for each axis, by its name, else by its place (docs/formats.md, Zarr: Axes)."""
    kinds = [KINDS.get((name or "").lower(), "") for name in names]
    if any(kind and kinds.count(kind) > 1 for kind in kinds):
        kinds = [""] * len(names)
    for kind in "xyz":
        left = [i for i, k in enumerate(kinds) if not k]
        if kind not in kinds and left:
            kinds[left[-1]] = kind
    for kind in "tc":
        left = [i for i, k in enumerate(kinds) if not k]
        if kind not in kinds and left:
            kinds[left[0]] = kind
    return kinds


def fields_of(data, kinds):
    """Voxels x, y, z by time and channel. Axes that are none of these must have one index."""
    data = np.asarray(data)
    for axis in reversed([i for i, kind in enumerate(kinds) if not kind]):
        if data.shape[axis] != 1:
            raise ValueError("an axis that is none of x, y, z, time and channel")
        data = data.take(0, axis)
        kinds = kinds[:axis] + kinds[axis + 1:]
    order = [kinds.index(kind) for kind in "tcxyz" if kind in kinds]
    data = data.transpose(order)
    for place, kind in enumerate("tcxyz"):
        if kind not in kinds:
            data = np.expand_dims(data, place)
    return {(t, c): data[t, c].astype(float) for t in range(data.shape[0]) for c in range(data.shape[1])}


def affine(spacing, origin):
    """Of voxels x, y, z along the axes of the world."""
    matrix = np.diag([*spacing, 1.0]).astype(float)
    matrix[:3, 3] = origin
    return matrix


def answer(data, kinds, **more):
    return Answer(fields=fields_of(data, kinds), **more)
