"""AMReX plotfiles: written by hand as AMReX 24 writes them (no package of Debian or PyPI does), read by yt."""
import pathlib
import re

import numpy as np
import yt

from ablation import Answer, Document, Node, Sample

yt.set_log_level("critical")
FOREIGN_READER_CRASHES = True  # yt changes global state, and loads much at its first file
NAMES = ("density", "x_velocity")
REAL = {
    "<f8": "((8, (64 11 52 0 1 12 0 1023)),(8, (8 7 6 5 4 3 2 1)))",
    ">f8": "((8, (64 11 52 0 1 12 0 1023)),(8, (1 2 3 4 5 6 7 8)))",
    "<f4": "((8, (32 8 23 0 1 9 0 127)),(4, (4 3 2 1)))"
}
CORNER, SPACING, SIZE = np.array([1.0, -2.0, 3.0]), np.array([0.5, 0.5, 0.5]), (8, 8, 8)


def value(x, y, z):
    return 10 + x + 2 * y + 4 * z + 0.25 * x * y


def box_text(low, high):
    return f"(({','.join(map(str, low))}) ({','.join(map(str, high))}) (0,0,0))"


def boxes_of(level):
    """Two boxes of the whole at level 0; one in the middle at level 1."""
    return [((0, 0, 0), (3, 7, 7)), ((4, 0, 0), (7, 7, 7))] if level == 0 else [((4, 4, 4), (11, 11, 11))]


def fab(low, high, step, dtype, ghosts=0):
    low, high = [n - ghosts for n in low], [n + ghosts for n in high]
    centres = [CORNER[i] + (np.arange(low[i], high[i] + 1) + 0.5) * step for i in range(3)]
    x, y, z = np.meshgrid(*centres, indexing="ij")
    stored = np.concatenate([component.transpose(2, 1, 0).ravel() for component in (value(x, y, z), -value(x, y, z))])
    return f"FAB {REAL[dtype]}{box_text(low, high)} 2\n".encode() + stored.astype(dtype).tobytes()


def write(folder, dtype="<f8", levels=1, ghosts=0):
    high = CORNER + SPACING * SIZE
    lines = [
        "HyperCLaw-V1.1", "2", *NAMES, "3", "0.5",
        str(levels - 1), " ".join(map(str, CORNER)), " ".join(map(str, high)), " ".join(["2"] * (levels - 1)),
        " ".join(box_text((0, 0, 0), [n * 2**i - 1 for n in SIZE]) for i in range(levels)), " ".join(["7"] * levels)
    ]
    lines += [" ".join(map(str, SPACING / 2**i)) for i in range(levels)]
    lines += ["0", "0"]
    for level in range(levels):
        step, boxes = SPACING[0] / 2**level, boxes_of(level)
        lines += [f"{level} {len(boxes)} 0.5", "7"]
        for low, top in boxes:
            lines += [f"{CORNER[i] + low[i] * step} {CORNER[i] + (top[i] + 1) * step}" for i in range(3)]
        lines.append(f"Level_{level}/Cell")
        data, places = b"", []
        for low, top in boxes:
            places.append(f"FabOnDisk: Cell_D_00000 {len(data)}")
            data += fab(low, top, step, dtype, ghosts)
        made = folder / "plt" / f"Level_{level}"
        made.mkdir(parents=True)
        (made / "Cell_D_00000").write_bytes(data)
        (made / "Cell_H").write_text("\n".join([
            "1", "1", "2",
            str(ghosts), f"({len(boxes)} 0", *(box_text(*box) for box in boxes), ")",
            str(len(boxes)), *places, "", f"{len(boxes)},2", *["1.0,-90.0,"] * len(boxes), "", f"{len(boxes)},2",
            *["90.0,-1.0,"] * len(boxes), ""
        ]))
    (folder / "plt" / "Header").write_text("\n".join(lines) + "\n")
    (folder / "plt" /
     "job_info").write_text("==== Job Information\nnumber of MPI processes: 1\n Inputs File Parameters\ngeometry.coord_sys = 0\n")


SAID = {
    "count": ("variables", "axes"),
    "dimensions": ("axes", ),
    "name": ("array", "variables"),
    "domains": ("domain", "voxels"),
    "corner": ("corners", "step"),
    "far corner": ("corners", "step"),
    "finest level": ("level", ),
    "grids": ("boxes", "levels"),
    "steps": ("levels", ),
    "boxes": ("box", ),
    "box": ("voxels", "domain"),
    "folder": ("_H", "levels"),
    "place": ("FabOnDisk", "Cell_D", "byte"),
    "places": ("boxes", )
}


class NumberedLines(Document):
    """Lines whose number says what they are: none can be missing, since the next one would take its place. `words`: their names."""
    def __init__(self, path, name, words):
        self.path, self.name, self.words = pathlib.Path(path), name, words
        self.lines = self.path.read_text().split("\n")

    def nodes(self):
        nodes = []
        for number, (line, word) in enumerate(zip(self.lines, self.words)):
            if word and line.strip():
                nodes.append(
                    Node(f"{self.name}/{word}",
                         line,
                         lambda new, n=number: self.lines.__setitem__(n, str(new)),
                         role={
                             "corner": "affine",
                             "sides": "spacing"
                         }.get(word, ""),
                         names=SAID.get(word, ())))
        return nodes

    def save(self):
        self.path.write_text("\n".join(self.lines))


def header_words(lines):
    """Of the lines of Header, which are more the more levels and boxes there are."""
    levels = int(lines[6]) + 1
    words = [
        "version", "count", "name", "name", "dimensions", "time", "finest level", "corner", "far corner", "refinement", "domains", "steps"
    ]
    words += ["sides"] * levels + ["coordinates", "boundary width"]
    for level in range(levels):
        words += ["grids", "level steps", *["edges"] * (3 * len(boxes_of(level))), "folder"]
    return words


def cell_words(lines):
    """Of the lines of Cell_H."""
    count = len(boxes_of(0))
    words = ["cells-version", "how", "components", "ghosts", "boxes", *["box"] * count, "", "places", *["place"] * count]
    return words + ["statistics"] * (len(lines) - len(words))


class LastFab(Document):
    """The line before the values of the last box of a file: their type and byte order, the box, and how many components there are."""
    def __init__(self, path):
        self.path, data = path, path.read_bytes()
        begin = data.rindex(b"FAB ((8")
        end = data.index(b"\n", begin)
        self.front, self.values = data[:begin], data[end:]
        line = data[begin + len("FAB "):end].decode()
        at, self.components = line.rindex("(("), line.split()[-1]
        self.descriptor, self.box = line[:at], line[at:line.rindex(" ")]

    def nodes(self):
        words = {"descriptor": tuple(REAL.values()), "box": (), "components": ()}
        names = {"descriptor": ("type", "values"), "box": ("box", ), "components": ("variables", "truncated")}
        return [
            Node(f"FAB/{name}",
                 getattr(self, name),
                 lambda new, name=name: setattr(self, name, str(new)),
                 words=words[name],
                 names=names[name]) for name in words
        ]

    def save(self):
        self.path.write_bytes(self.front + f"FAB {self.descriptor}{self.box} {self.components}".encode() + self.values)


def documents(folder):
    header, cells = folder / "plt" / "Header", folder / "plt" / "Level_0" / "Cell_H"
    return [
        NumberedLines(header, "Header", header_words(header.read_text().split("\n"))),
        NumberedLines(cells, "Cell_H", cell_words(cells.read_text().split("\n"))),
        LastFab(folder / "plt" / "Level_0" / "Cell_D_00000")
    ]


def check_descriptors(path):
    """yt takes the type and the byte order of the first box for those of all."""
    if len(set(re.findall(rb"FAB (\(\(8, \([\d ]*\)\),\(\d, \([\d ]*\)\)\))", path.read_bytes()))) > 1:
        raise ValueError("boxes of several types")


def read(folder):
    check_descriptors(folder / "plt" / "Level_0" / "Cell_D_00000")
    data = yt.load(str(folder / "plt"))
    size = data.domain_dimensions * 2**data.max_level
    grid = data.covering_grid(data.max_level, data.domain_left_edge, size)
    field = next(name for kind, name in data.field_list if kind == "boxlib")
    values = np.asarray(grid["boxlib", field])
    if np.any(values == 0):
        raise ValueError("yt has found no grid for some cells, and leaves them 0")
    step = (np.asarray(data.domain_width) / size)
    affine = np.diag([*step, 1.0])
    affine[:3, 3] = np.asarray(data.domain_left_edge) + step / 2
    return Answer(fields={(0, 0): values} if data.max_level == 0 else {}, affine=affine)


def samples(_):
    return [
        Sample("one-level", "plt?array=density", write, documents, read, ("plt/job_info", )),
        Sample("two-levels", "plt?array=density", lambda folder: write(folder, levels=2), documents, read, ("plt/Level_1/Cell_H", )),
        Sample("float32", "plt?array=density", lambda folder: write(folder, dtype="<f4"), documents, read),
        Sample("big-endian", "plt?array=density", lambda folder: write(folder, dtype=">f8"), documents, read),
        # yt takes the ghosts for cells.
        Sample("ghosts", "plt?array=density", lambda folder: write(folder, ghosts=2), documents),
    ]
