"""NRRD by pynrrd and ITK: each line of the header is a node; `key:=value` lines mean what programs agree on, and have a name of their own."""

import re

import nrrd
import numpy as np
import SimpleITK

from ablation import Answer, CannotWrite, Change, Document, Node, Sample

FOREIGN_READER_CRASHES = True  # ITK does, on some headers

KINDS = {"content": "comment"}
ROLES = {
    "spacings": "spacing",
    "space directions": "affine",
    "space origin": "affine",
    "space": "affine",
    "space units": "unit",
    "units": "unit",
}
NAMES = {
    "sizes": ("size", "truncated", "bytes", "samples"),
    "dimension": ("dimension", "axes", "sizes"),
    "type": ("type", "bytes"),
    "encoding": ("encoding", "gzip", "inflat", "bzip", "compressed", "truncated"),
    "space dimension": ("space",),
    "space": ("space",),
    "kinds": ("kind", "axis"),
    "data file": ("file", "samples in"),
    "datafile": ("file",),
    "byte skip": ("byteskip", "truncated", "bytes"),
    "line skip": ("lineskip", "truncated", "lines"),
    "space directions": ("space directions", "axes", "axis"),
    "centers": ("centerings",),
}
WORDS = {
    "space": ("right-anterior-superior", "left-anterior-superior", "RAS", "scanner-xyz", "3D-right-handed"),
    "endian": ("big", "little"),
    "encoding": ("raw", "gzip", "bzip2", "ascii", "hex", "zrl"),
    "type": ("uint8", "short", "unsigned short", "float", "double"),
    "kinds": (
        "domain domain domain",
        "space space space",
        "space space time",
        "list domain domain domain",
        "domain domain domain list",
        "domain domain domain time",
        "vector domain domain domain",
    ),
    "space units": ('"mm" "mm" "mm"', '"um" "um" "um"', '"m" "m" "m"', '"mm" "um" "mm"'),
    "units": ('"mm" "mm" "mm"', '"um" "um" "um"'),
    "centers": ("cell cell cell", "node node node"),
    "centerings": ("cell cell cell", "node node node"),
}
TYPES = (np.uint8, np.int32, np.float32, np.float64)


class Lines(Document):
    """`fields`: the fields of the definition, else the `key:=value` lines."""

    def __init__(self, path, name, fields=True):
        self.path, self.name, self.fields = path, name, fields
        data = path.read_bytes()
        found = re.search(rb"\r?\n\r?\n", data)
        self.lines = data[: found.start() if found else len(data)].decode("latin-1").splitlines()
        self.tail = b"\n" + data[found.end() :] if found else b""
        self.whole = None

    @staticmethod
    def _split(line):
        """Key, what divides, value; None: neither a field nor a key with a value."""
        at = line.find(":=")
        if at > 0 and ": " not in line[:at]:
            return line[:at], ":=", line[at + 2 :]
        at = line.find(": ")
        return (line[:at], ": ", line[at + 2 :].strip()) if at > 0 and not line.startswith("#") else None

    def nodes(self):
        nodes = []
        if self.fields:
            nodes.append(
                Node(f"{self.name}/magic", self.lines[0], lambda new: self.lines.__setitem__(0, new), names=("NRRD",), words=("NRRD0009",))
            )
        for number, line in enumerate(self.lines[1:], 1):
            parts = self._split(line)
            if parts is None or (parts[1] == ": ") != self.fields:
                continue
            key, divider, value = parts
            node = Node(
                f"{self.name}/{key}",
                value,
                lambda new, n=number, k=key, d=divider: self._set(n, f"{k}{d}{new}"),
                lambda n=number: self._set(n, None),
                tuple(NAMES.get(key, ())),
                ROLES.get(key, ""),
                KINDS.get(key, "") if self.fields else "",
                words=WORDS.get(key, ()) if self.fields else (),
            )
            if key == "type":
                node.more = [Change(f"samples are {np.dtype(t).name}", lambda t=t: self._encode(dtype=t), same=True) for t in TYPES]
            elif key == "encoding":
                node.more = [Change(f"encoded as {e}", lambda e=e: self._encode(encoding=e), same=True) for e in ("raw", "gzip", "bzip2")]
            elif key == "endian":
                node.more = [Change("the other byte order", self._swap, same=True)]
            elif key == "space directions":
                node.more = [Change("axes exchanged", lambda n=number, v=value: self._exchange(n, v))]
            nodes.append(node)
        return nodes

    def _set(self, number, line):
        self.lines[number] = line

    def _exchange(self, number, value):
        vectors = re.findall(r"\([^)]*\)|none", value)
        if len(vectors) < 3:
            raise CannotWrite(value)
        vectors[-3:-1] = vectors[-2:-4:-1]
        self.lines[number] = "space directions: " + " ".join(vectors)

    def _encode(self, dtype=None, encoding=None):
        if self.path.suffix == ".nhdr":
            raise CannotWrite("detached")
        data, header = nrrd.read(str(self.path))
        header["type"] = np.dtype(dtype or data.dtype).name
        header["encoding"] = encoding or header["encoding"]
        nrrd.write(str(self.path), data.astype(dtype or data.dtype), header)
        self.whole = self.path.read_bytes()

    def _swap(self):
        data, header = nrrd.read(str(self.path))
        if self.path.suffix == ".nhdr" or data.dtype.itemsize == 1:
            raise CannotWrite("detached")
        order = "big" if header.get("endian", "little") == "little" else "little"
        header.update(encoding="raw", endian=order)
        nrrd.write(str(self.path), data.astype(data.dtype.newbyteorder(">" if order == "big" else "<")), header)
        self.whole = self.path.read_bytes()

    def add(self, path, value):
        key = path.split("/")[-1]
        if value is None or key == "magic" or any((self._split(line) or [""])[0] == key for line in self.lines):
            raise CannotWrite(path)
        self.lines.insert(1, f"{key}{': ' if self.fields else ':='}{value}")

    def save(self):
        if self.whole is not None:
            self.path.write_bytes(self.whole)
        else:
            text = "\n".join(line for line in self.lines if line is not None) + "\n"
            self.path.write_bytes(text.encode("latin-1") + self.tail)


def values(shape, dtype=np.int16, high=120):
    return np.random.default_rng(5).integers(1, high, shape).astype(dtype)


def directions(scale=(1.5, 2.0, 2.5)):
    turned, _ = np.linalg.qr(np.array([[0.9, 0.1, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.0]]))
    turned *= np.sign(np.diag(turned))
    return (turned * np.array(scale)).T.round(6)


def write(folder, data, header, name="a.nrrd", **options):
    nrrd.write(str(folder / name), data, header, index_order="F", **options)


def placed(space="left-posterior-superior", **more):
    return {
        "space": space,
        "space directions": directions(),
        "space origin": np.array([10.0, -20.0, 30.0]),
        "kinds": ["domain"] * 3,
        **more,
    }


def with_lines(folder, lines, fields=True, name="a.nrrd"):
    """Lines that pynrrd does not know, as other programs write them."""
    document = Lines(folder / name, "header", fields)
    document.lines[1:1] = lines
    document.save()


def slicer(folder):
    write(folder, values((5, 6, 7)), placed(encoding="gzip", content="a head"))
    with_lines(
        folder,
        ["measurement frame: (1,0,0) (0,1,0) (0,0,1)", 'space units: "um" "um" "um"', "old min: 0", "old max: 4000", "sample units: HU"],
    )


def itk(folder):
    image = SimpleITK.GetImageFromArray(values((7, 6, 5), np.uint16))
    image.SetSpacing((1.5, 2.0, 2.5)), image.SetOrigin((10, -20, 30))
    image.SetMetaData("ITK_InputFilterName", "NrrdImageIO"), image.SetMetaData("Modality", "CT")
    SimpleITK.WriteImage(image, str(folder / "a.nrrd"), useCompression=True)


def spaced(folder):
    write(
        folder,
        values((5, 6, 7), np.float32),
        {
            "spacings": [1.5, 2.0, 2.5],
            "units": ["um", "um", "um"],
            "labels": ["x", "y", "z"],
            "thicknesses": [1.5, 2.0, 3.0],
            "encoding": "raw",
        },
    )
    with_lines(folder, ["centers: cell cell cell", "block size: 1", "number: 210"][:1])


def axis_mins(folder):
    """As teem's own tools write it."""
    write(folder, values((5, 6, 7), np.uint8), {"encoding": "raw"})
    with_lines(folder, ["axis mins: 0 10 20", "axis maxs: 10 22 41", "centers: cell cell cell"])


def colours(folder):
    write(
        folder,
        values((3, 5, 6, 7), np.uint8),
        {
            "space": "left-posterior-superior",
            "kinds": ["RGB-color", "domain", "domain", "domain"],
            "space directions": np.vstack([[np.nan] * 3, directions()]),
            "space origin": [10.0, -20.0, 30.0],
            "encoding": "gzip",
        },
    )


def diffusion(folder):
    """As Slicer writes it: directions of gradients as keys."""
    write(
        folder,
        values((5, 6, 7, 3), np.int16),
        {
            "space": "left-posterior-superior",
            "kinds": ["space", "space", "space", "list"],
            "space directions": np.vstack([directions(), [np.nan] * 3]),
            "space origin": [10.0, -20.0, 30.0],
            "encoding": "raw",
            "thicknesses": [np.nan, np.nan, 2.5, np.nan],
            "modality": "DWMRI",
            "DWMRI_b-value": "1000",
            "DWMRI_gradient_0000": "0 0 0",
            "DWMRI_gradient_0001": "1 0 0",
            "DWMRI_gradient_0002": "0 1 0",
        },
    )
    with_lines(folder, ["measurement frame: (-1,0,0) (0,-1,0) (0,0,1)", "centerings: cell cell cell ???"])


def times(folder):
    write(
        folder,
        values((5, 6, 7, 3), np.int16),
        {
            "kinds": ["domain", "domain", "domain", "time"],
            "spacings": [1.5, 2.0, 2.5, 0.5],
            "units": ["mm", "mm", "mm", "s"],
            "labels": ["i", "j", "k", "t"],
            "encoding": "raw",
        },
    )


def itk_times(folder):
    image = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(values((7, 6, 5)) + k) for k in range(3)])
    image.SetSpacing((1.5, 2.0, 2.5, 0.5)), image.SetOrigin((10, -20, 30, 0))
    SimpleITK.WriteImage(image, str(folder / "a.nrrd"))


def segmentation(folder):
    """As Slicer writes .seg.nrrd."""
    keys = {
        "Segmentation_MasterRepresentation": "Binary labelmap",
        "Segmentation_ContainedRepresentationNames": "Binary labelmap|",
        "Segmentation_ReferenceImageExtentOffset": "0 0 0",
        "Segmentation_ConversionParameters": "Smoothing factor|0.5|",
    }
    for i, (name, color) in enumerate((("Liver", "0.8 0.4 0.2"), ("Spleen", "0.1 0.5 0.9"))):
        keys.update(
            {
                f"Segment{i}_ID": f"Segment_{i + 1}",
                f"Segment{i}_Name": name,
                f"Segment{i}_NameAutoGenerated": "0",
                f"Segment{i}_Color": color,
                f"Segment{i}_ColorAutoGenerated": "0",
                f"Segment{i}_Extent": "0 4 0 5 0 6",
                f"Segment{i}_LabelValue": str(i + 1),
                f"Segment{i}_Layer": "0",
                f"Segment{i}_Tags": "Segmentation.Status:inprogress|TerminologyEntry:Segmentation category~SCT^123037004^Tissue|",
            }
        )
    write(folder, values((5, 6, 7), np.uint8, 3), {**placed(encoding="gzip"), **keys}, "a.seg.nrrd")


def layers(folder):
    """Segments that overlap, in layers."""
    keys = {"Segmentation_MasterRepresentation": "Binary labelmap"}
    for i, name in enumerate(("Liver", "Spleen")):
        keys.update(
            {
                f"Segment{i}_ID": f"Segment_{i + 1}",
                f"Segment{i}_Name": name,
                f"Segment{i}_Color": "0.8 0.4 0.2",
                f"Segment{i}_LabelValue": "1",
                f"Segment{i}_Layer": str(i),
            }
        )
    write(
        folder,
        values((2, 5, 6, 7), np.uint8, 2),
        {
            "space": "left-posterior-superior",
            "kinds": ["list", "domain", "domain", "domain"],
            "space directions": np.vstack([[np.nan] * 3, directions()]),
            "space origin": [10.0, -20.0, 30.0],
            "encoding": "gzip",
            **keys,
        },
        "a.seg.nrrd",
    )


def big_endian(folder):
    write(folder, values((5, 6, 7), ">u2"), placed("right-anterior-superior", encoding="raw", endian="big"))


def unnamed_space(folder):
    write(
        folder,
        values((5, 6, 7), np.float64),
        {
            "space dimension": 3,
            "space directions": directions(),
            "space origin": [1.0, 2.0, 3.0],
            "space units": ["um", "um", "um"],
            "encoding": "raw",
        },
    )


def detached(folder, encoding="raw"):
    write(folder, values((5, 6, 7)), placed(encoding=encoding), "a.nhdr", detached_header=True)


def skipped(folder):
    detached(folder)
    raw = folder / "a.raw"
    raw.write_bytes(b"line one\nline two\n" + b"\1" * 16 + raw.read_bytes())
    with_lines(folder, ["line skip: 2", "byte skip: 16"], name="a.nhdr")


def listed(folder):
    """A file for each slice."""
    detached(folder)
    raw = (folder / "a.raw").read_bytes()
    for k in range(7):
        (folder / f"s{k:03d}.raw").write_bytes(raw[60 * k : 60 * (k + 1)])
    (folder / "a.raw").unlink()
    document = Lines(folder / "a.nhdr", "header")
    document.lines = ["data file: s%03d.raw 0 6 1 2" if line.startswith("data file") else line for line in document.lines]
    document.save()


# The foreign reader.

LPS = {
    "left-posterior-superior": (-1, -1, 1),
    "lps": (-1, -1, 1),
    "right-anterior-superior": (1, 1, 1),
    "ras": (1, 1, 1),
    "left-anterior-superior": (-1, 1, 1),
    "las": (-1, 1, 1),
}


def space_of(header, axes):
    """From indices of the axes of space to the world; None: unknown."""
    if "space directions" in header:
        rows = np.array(header["space directions"], float)[axes]
        signs = LPS.get(header.get("space", "").lower())
        if rows.shape == (3, 4) and "space" not in header:  # ITK's: left, posterior, superior, time
            rows, signs = rows[:, :3], LPS["lps"]
        if rows.shape != (3, 3) or not np.all(np.isfinite(rows)) or (signs is None and "space" in header):
            return None
        affine = np.eye(4)
        affine[:3, :3] = rows.T
        affine[:3, 3] = np.array(header.get("space origin", np.zeros(3)), float)[:3]
        return np.diag([*(signs or (1, 1, 1)), 1]) @ affine
    if "space" in header or "spacings" in header:  # axes along those of the space, as ITK takes it
        signs = LPS.get(header["space"].lower()) if "space" in header else (1, 1, 1)
        if signs is None:
            return None
        affine = np.diag([*(np.abs(np.array(header["spacings"], float)[axes]) if "spacings" in header else (1, 1, 1)), 1.0])
        affine[:3, 3] = header.get("space origin", np.zeros(3)) if "space" in header else 0
        return np.diag([*signs, 1]) @ affine
    return None


def read(path):
    data, header = nrrd.read(str(path), index_order="F")
    kinds = header.get("kinds", ["domain"] * data.ndim)
    in_space = [kind in ("domain", "space") for kind in kinds]
    if "space directions" in header:
        in_space = [bool(np.all(np.isfinite(np.atleast_1d(row)))) for row in header["space directions"]]
    axes = [i for i, yes in enumerate(in_space) if yes]
    others = [i for i, yes in enumerate(in_space) if not yes]
    if len(axes) == 4 and not others:  # ITK's fourth axis
        axes, others = axes[:3], axes[3:]
    if len(axes) != 3 or len(others) > 1:
        raise ValueError("axes")
    if not others:
        return Answer(fields={(0, 0): data.astype(float)}, affine=space_of(header, axes))
    is_time = others[0] == 3 and kinds[3] in ("time", "list", "domain", "space", "???")
    parts = np.moveaxis(data, others[0], 0).astype(float)
    return Answer(fields={((i, 0) if is_time else (0, i)): part for i, part in enumerate(parts)}, affine=space_of(header, axes))


def read_by_itk(path):
    image = SimpleITK.ReadImage(str(path))
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return Answer(
        fields={(0, 0): SimpleITK.GetArrayFromImage(image).transpose(2, 1, 0).astype(float)}, affine=np.diag([-1, -1, 1, 1]) @ affine
    )


def sample(name, write_file, file="a.nrrd", document="header", sidecars=(), reader=read):
    return Sample(
        name,
        file,
        write_file,
        lambda folder: [Lines(folder / file, document), Lines(folder / file, f"{document}-keys", False)],
        lambda folder: reader(folder / file),
        sidecars,
    )


def samples(_):
    return [
        sample("slicer", slicer),
        sample("spacings", spaced),
        sample("colours", colours),
        sample("times", times),
        sample("itk-times", itk_times),
        sample("big-endian", big_endian),
        sample("unnamed-space", unnamed_space),
        sample("diffusion", diffusion),
        sample("axis-mins", axis_mins),
        sample("itk", itk),
        sample("detached", detached, "a.nhdr", "header", ("a.raw",)),
        sample("skipped", skipped, "a.nhdr"),
        sample("detached-gzip", lambda folder: detached(folder, "gzip"), "a.nhdr"),
        sample("slices", listed, "a.nhdr", "header", ("s003.raw",), read_by_itk),
        sample("segmentation", segmentation, "a.seg.nrrd"),
        sample("layers", layers, "a.seg.nrrd"),
    ]
