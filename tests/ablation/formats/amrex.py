"""AMReX plotfiles: written by hand as AMReX 24 writes them (no package of Debian or PyPI does), read by yt."""
import itertools
import pathlib

import numpy as np
import yt

from ablation import Answer, CannotWrite, Document, Node, Sample

yt.set_log_level("critical")
FOREIGN_READER_CRASHES = True  # yt changes global state
NAMES = ("density", "x_velocity")
REAL = {"<f8": "((8, (64 11 52 0 1 12 0 1023)),(8, (8 7 6 5 4 3 2 1)))", ">f8": "((8, (64 11 52 0 1 12 0 1023)),(8, (1 2 3 4 5 6 7 8)))",
        "<f4": "((8, (32 8 23 0 1 9 0 127)),(4, (4 3 2 1)))"}
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
    lines = ["HyperCLaw-V1.1", "2", *NAMES, "3", "0.5", str(levels - 1), " ".join(map(str, CORNER)), " ".join(map(str, high)),
             " ".join(["2"] * (levels - 1)), " ".join(box_text((0, 0, 0), [n * 2 ** i - 1 for n in SIZE]) for i in range(levels)),
             " ".join(["7"] * levels)]
    lines += [" ".join(map(str, SPACING / 2 ** i)) for i in range(levels)]
    lines += ["0", "0"]
    for level in range(levels):
        step, boxes = SPACING[0] / 2 ** level, boxes_of(level)
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
        (made / "Cell_H").write_text("\n".join(["1", "1", "2", str(ghosts), f"({len(boxes)} 0", *(box_text(*box) for box in boxes), ")", str(len(boxes)), *places,
                                                "", f"{len(boxes)},2", *["1.0,-90.0,"] * len(boxes), "", f"{len(boxes)},2", *["90.0,-1.0,"] * len(boxes), ""]))
    (folder / "plt" / "Header").write_text("\n".join(lines) + "\n")
    (folder / "plt" / "job_info").write_text("==== Job Information\nnumber of MPI processes: 1\n Inputs File Parameters\ngeometry.coord_sys = 0\n")


class NumberedLines(Document):
    """Lines whose number says what they are. `words`: their names; those of further lines are `more`."""

    def __init__(self, path, name, words):
        self.path, self.name, self.words = pathlib.Path(path), name, words
        self.lines = self.path.read_text().split("\n")

    def nodes(self):
        nodes = []
        for number, (line, word) in enumerate(itertools.zip_longest(self.lines, self.words[:len(self.lines)], fillvalue="more")):
            if line.strip():
                role = {"corner": "affine", "sides": "spacing"}.get(word, "")
                nodes.append(Node(f"{self.name}/{word}", line, lambda new, n=number: self.lines.__setitem__(n, str(new)),
                                  lambda n=number: self.lines.__setitem__(n, None), role=role))
        return nodes

    def add(self, path, value):
        raise CannotWrite(path)

    def save(self):
        self.path.write_text("\n".join(line for line in self.lines if line is not None))


HEADER = ["version", "count", "name", "name", "dimensions", "time", "finest level", "corner", "far corner", "refinement", "domains", "steps", "sides"]
CELLS = ["cells-version", "how", "components", "ghosts", "boxes", "box"]


def documents(folder):
    refined = "0" in (folder / "plt" / "Header").read_text().split("\n")[6]
    return [NumberedLines(folder / "plt" / "Header", "Header", HEADER + ([] if not refined else ["coordinates", "zero", "grids", "level steps"])),
            NumberedLines(folder / "plt" / "Level_0" / "Cell_H", "Cell_H", CELLS)]


def read(folder):
    data = yt.load(str(folder / "plt"))
    size = data.domain_dimensions * 2 ** data.max_level
    grid = data.covering_grid(data.max_level, data.domain_left_edge, size)
    field = next(name for kind, name in data.field_list if kind == "boxlib")
    step = (np.asarray(data.domain_width) / size)
    affine = np.diag([*step, 1.0])
    affine[:3, 3] = np.asarray(data.domain_left_edge) + step / 2
    return Answer(fields={(0, 0): np.asarray(grid["boxlib", field])} if data.max_level == 0 else {}, affine=affine)


def samples(_):
    return [
        Sample("one-level", "plt?array=density", write, documents, read, ("plt/job_info",)),
        Sample("two-levels", "plt?array=density", lambda folder: write(folder, levels=2), documents, read, ("plt/Level_1/Cell_H",)),
        Sample("float32", "plt?array=density", lambda folder: write(folder, dtype="<f4"), documents, read),
        Sample("big-endian", "plt?array=density", lambda folder: write(folder, dtype=">f8"), documents, read),
        Sample("ghosts", "plt?array=density", lambda folder: write(folder, ghosts=2), documents, read),
    ]
