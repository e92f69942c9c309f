"""The paper's kernels and pictures: transform, splatting, Z-buffering of points, figures 12 and 13."""
from __future__ import annotations

import math
import statistics
from collections import Counter
from typing import Any, Iterable, Mapping, Sequence

from .. import plots
from ..page import Photo, Section, Table
from ..ranking import decide
from ..results import Run
from ..value import Value, number_text, speed_text

Points = Sequence[tuple[float, Value]]

# Pairs that differ in one thing: (method, what it is compared with).
_LIKE_WITH_LIKE = {
    "without vectors": ("phases, no vectors", "product, no vectors"),
    "in vectors": ("phases", "product"),
}


def sections(run: Run) -> list[Section]:
    return [_transform(run), _splatting(run), _points(run)]


def power_text(points: Points, x: str) -> str:
    """ "grows as N to the power of 2.9 (N = 50 to 300)": a least-squares line through the logarithms of medians. Empty: fewer than two."""
    logs = [(math.log(at), math.log(y.value)) for at, y in points if y.value > 0]
    if len(logs) < 2:
        return ""
    power = statistics.linear_regression(*zip(*logs)).slope
    over = f"({x} = {points[0][0]} to {points[-1][0]}{', one repeat each' if any(y.repeats == 1 for _, y in points) else ''})"
    if abs(power) < 0.1:
        return f"stays within {x} to the power of {number_text(power, 1)} {over}"
    return f"{'grows' if power > 0 else 'falls'} as {x} to the power of {number_text(power, 2)} {over}"


def compared_text(found: Sequence[tuple[Value, str]], of: str) -> str:
    """How a method compares with another one over several cases, from time of the other over its own and what `decide` found of it."""
    if len(found) == 1:
        return speed_text(*found[0], of)
    counts = Counter(outcome for _, outcome in found)
    if counts["open"] == len(found):
        return f"not ranked against {of}"
    faster, slower = (sorted(ratio.value for ratio, outcome in found if outcome == which) for which in ("faster", "slower"))
    parts = []
    for values, word in ((faster, "fast"), ([1 / value for value in reversed(slower)], "slow")):
        if values:
            ends = list(dict.fromkeys(number_text(value, 2) for value in (values[0], values[-1])))
            parts.append(f"{' to '.join(ends)} times as {word} as {of} in {len(values)} of {len(found)} cases")
    if counts["tie"]:
        parts.append(f"as fast{'' if parts else f' as {of}'} (a tie) in {counts['tie']} of {len(found)}{'' if parts else ' cases'}")
    if counts["open"]:
        parts.append(f"not ranked in {counts['open']} of {len(found)}")
    return ", ".join(parts)


def compared_texts(ratios: Mapping[str, Mapping[Any, Value]], of: Mapping[str, str]) -> dict[str, str]:
    """compared_text of each method, all of them decided together. `of`: what each is compared with."""
    outcomes = decide({(method, case): ratio for method, cases in ratios.items() for case, ratio in cases.items()})
    return {
        method: compared_text([(ratio, outcomes[method, case]) for case, ratio in cases.items()], of[method])
        for method, cases in ratios.items()
    }


def _transform(run: Run) -> Section:
    measured = {"part": "transform", "origin": "measured", "metric": "run_time"}
    sizes = sorted(run.distinct("n", **measured))
    workers = sorted(run.distinct("workers", **measured))
    table_n = run.distinct("n", **measured, variant="product")[0]
    printed_n = run.distinct("n", part="transform", origin="paper", variant="product")[0]

    def get(method: str, n: int, p: int, stage: str | None = None) -> Value:
        return run.value("run_time", part="transform", origin="measured", variant=method, n=n, workers=p, stage=stage)

    def printed(method: str, p: int) -> Value | None:
        return run.find("run_time", part="transform", origin="paper", variant=method, n=printed_n, workers=p)

    def ratios(method: str, of: str) -> dict[int, Value]:
        return {p: get(of, table_n, p).over(get(method, table_n, p)) for p in workers}

    paper = {p: (printed("product", p), printed("phases", p)) for p in workers}
    paper_gains = [product.over(phases).value for product, phases in paper.values() if product and phases]
    methods = ["product, no vectors", "phases, no vectors", "product", "phases", "phases, first slice by products", "running beams"]
    tables = [
        Table(
            f"Table 1. Transform of a worker's slab, N = {table_n} (the paper: N = {printed_n})",
            ["p"]
            + methods
            + ["phases over product, no vectors", "phases over product", "paper: product", "paper: phases", "paper: phases over product"],
            [
                [p]
                + [get(method, table_n, p) for method in methods]
                + [get(of, table_n, p).over(get(method, table_n, p)) for method, of in _LIKE_WITH_LIKE.values()]
                + [product, phases, product.over(phases) if product and phases else None]
                for p, (product, phases) in paper.items()
            ],
        ),
        _phases(run, table_n, workers),
        _errors(run, sizes, methods),
    ]
    p = 15 if 15 in workers else workers[len(workers) // 2]
    growth = power_text([(n, get("phases", n, p)) for n in sizes], "N")
    compared = compared_texts(
        {how: ratios(*pair) for how, pair in _LIKE_WITH_LIKE.items()} | {"running beams": ratios("running beams", "phases")},
        {how: "a product a voxel" for how in _LIKE_WITH_LIKE} | {"running beams": "the phases"},
    )
    texts = [
        f"At N = {table_n} and p = {workers[0]} to {workers[-1]}, {how} the four phases are {compared[how]}." for how in _LIKE_WITH_LIKE
    ]
    texts.append(f"In vectors, running beams are {compared['running beams']}.")
    if paper_gains:
        texts.append(
            f"The paper's vectorised phases are {number_text(min(paper_gains), 2)} to {number_text(max(paper_gains), 2)} times as fast as "
            "its product, which it does not call vectorised."
        )
    cubic = [(n, run.value("run_time", part="transform", origin="paper", n=n, workers=15)) for n in (150, 300)]
    if growth:
        texts.append(
            f"At p = {p} the time of the phases in vectors {growth}; the paper's two printed times at p = 15 grow as N to the power of "
            f"{number_text(math.log(cubic[1][1].value / cubic[0][1].value) / math.log(2), 2)} (N = 150 to 300)."
        )
    cycle = run.value("constant", part="clock-cycle")
    voxels = {n: n * n * math.ceil(n / workers[0]) for n in (sizes[0], sizes[-1])}
    cycles = [f"{get('phases', n, workers[0]).times(1 / count).over(cycle).text()} at N = {n}" for n, count in voxels.items()]
    texts.append(
        f"c_t of Eq. 12, the time of the phases in vectors a voxel, is in clock cycles of {cycle.text()} {' and '.join(cycles)} "
        f"(p = {workers[0]}); the paper says that it tends to one cycle."
    )
    texts.append(_error_text(run, sizes))
    series = {f"N = {n}": [(p, get("phases", n, p)) for p in workers] for n in sizes}
    series[f"N = {printed_n}, paper"] = [(p, phases) for p, (_, phases) in paper.items() if phases]
    return Section(
        "Transform: table 1 and figure 7",
        "How much do the paper's incremental phases gain over a matrix product for every voxel, what does each phase cost, and how large "
        "are the accumulated errors?",
        "The largest slab of a worker, N x N x ceil(N/p) voxels, is transformed into three stored arrays of coordinates, on one thread. "
        "The seed phase multiplies one voxel by the matrix. The voxel phase adds the step along a beam, one voxel after the other; the "
        "beam phase adds a whole beam to the next one; the slice phase adds a whole slice to the next one. Both the product and the phases "
        "are measured compiled without vectors, and in vectors of the machine's best instruction set. Running beams add along each beam in "
        "vectors and start each beam from one number. The transform needs no communication, so the slab of one worker is measured for "
        "every p. The renderers of Slabstream do not run it in this form.",
        " ".join(texts),
        [
            plots.lines(
                "figure-7-transform",
                "Figure 7: transforming a worker's slab in four phases",
                series,
                "workers p",
                "time",
                "In vectors. Whiskers: intervals of the median.",
                log_y=True,
            ),
            tables[0],
            tables[1],
            plots.lines(
                "transform-errors",
                "Largest error of a coordinate",
                {
                    method: [(n, _offset(run, method, n)) for n in sizes]
                    for method in ("product", "phases", "phases, first slice by products", "running beams")
                },
                "N",
                "error in pixels",
                "Of N x N x N voxels at about a pixel a voxel, in 32-bit floats, against the product in 64 bits. Both axes logarithmic.",
                **plots.LOG_LOG,
            ),
            tables[2],
        ],
    )


def _phases(run: Run, n: int, workers: list[int]) -> Table:
    """Equations 8 to 11: what each phase of the vectorised loop does and takes."""

    def rows(p: int, method: str, stages: Iterable[str]) -> list[list]:
        found = []
        for stage in stages:
            of = {"part": "transform", "variant": method, "n": n, "workers": p, "stage": stage}
            additions, products = (run.value(metric, **of).value for metric in ("additions", "products"))
            time = run.value("run_time", **of)
            scalar = run.find("run_time", **{**of, "variant": f"{method}, no vectors"})
            found.append([p, stage, int(additions), int(products), time, time.times(1 / max(additions + products, 1)), scalar])
        return found

    first = ["seed", "voxel", "beam", "slice"]
    ends = [workers[0], workers[-1]] if len(workers) > 1 else workers
    return Table(
        f"Equations 8 to 11: operations and time of each phase, N = {n}. Short phases are repeated for one time, so they find their data "
        "in the cache. The paper counts 12 additions and 16 products for the seed; the matrix has three rows here",
        ["p", "phase", "additions", "products", "time, vectors", "time an operation", "time, no vectors"],
        [row for p in ends for row in rows(p, "phases", first) + rows(p, "phases, first slice by products", ["first slice"])],
    )


def _offset(run: Run, method: str, n: int) -> Value:
    return run.value("offset", part="transform", variant=method, n=n)


def _errors(run: Run, sizes: list[int], methods: list[str]) -> Table:
    return Table(
        "Largest error of a coordinate, in pixels: N x N x N voxels, 32-bit floats",
        ["N"] + methods,
        [[n] + [number_text(_offset(run, method, n).value, 2) for method in methods] for n in sizes],
    )


def _error_text(run: Run, sizes: list[int]) -> str:
    n = sizes[-1]
    phases, remedy = _offset(run, "phases", n).value, _offset(run, "phases, first slice by products", n).value
    growth = power_text([(size, _offset(run, "phases", size)) for size in sizes], "N")
    change = f"lowers it to {number_text(remedy, 2)}" if remedy < phases else f"does not lower it ({number_text(remedy, 2)})"
    text = f"The largest error of the phases {growth}; at N = {n} it" if growth else f"The largest error of the phases at N = {n}"
    return f"{text} is {number_text(phases, 2)} pixels, and the paper's remedy, products for the first slice, {change}."


def _splatting(run: Run) -> Section:
    over_workers, slices = ({"part": part, "metric": "run_time"} for part in ("splat over workers", "slice over k"))
    sizes, workers = sorted(run.distinct("n", **over_workers)), sorted(run.distinct("workers", **over_workers))
    side = run.distinct("n", **slices)[0]
    widths = sorted(run.distinct("k", **slices))
    loops = run.distinct("variant", **slices)

    def slice_time(loop: str, k: int) -> Value:
        return run.value("run_time", part="slice over k", variant=loop, k=k)

    def sparse_time(loop: str, c: float) -> Value:
        return run.value("run_time", part="slice over occupancy", variant=loop, occupancy=c)

    shares = sorted(run.distinct("occupancy", part="slice over occupancy"))
    texts = []
    # Below this width the other work of a voxel weighs on the plain loop.
    wide = [k for k in widths if k >= 9] if sum(k >= 9 for k in widths) >= 2 else widths
    for loop in loops:
        if growth := power_text([(k, slice_time(loop, k)) for k in wide], "k"):
            texts.append(f"by '{loop}' {growth}")
    growths = [f"The time of a filled slice, splatted {'; '.join(texts)} (the paper, not in vectors: quadratic)."] if texts else []
    over = f"k = {widths[0]}" + (f" to {widths[-1]}" if len(widths) > 1 else "")
    pairs = [("phases", "plain, no vectors", "the plain loop without vectors"), ("kernels", "phases", "the phases")]
    ratios = {loop: {k: slice_time(of, k).over(slice_time(loop, k)) for k in widths} for loop, of, _ in pairs}
    ratios["sparse"] = {5: sparse_time("plain, no vectors", shares[0]).over(sparse_time("phases", shares[0]))}
    outcomes = compared_texts(ratios, {loop: name for loop, _, name in pairs} | {"sparse": "the plain loop"})
    compared = [f"For {over} on a filled slice, {loop} are {outcomes[loop]}." for loop, _, _ in pairs]
    compared.append(
        f"With {shares[0] * 100:g} % of the voxels occupied and k = 5, phases, which splat empty voxels too, are {outcomes['sparse']}."
    )
    return Section(
        "Splatting: figures 8a and 8b",
        "How does splatting grow with the workers and with the width of the footprint, and what do the phases gain that "
        "the paper proposes in section 5.1?",
        "a: class-I spheres in equal slabs; the slab that takes longest, rendered alone on one thread (places of voxels and splatting). "
        f"b: a filled slice of {side} x {side} voxels at a pixel a voxel, splatted and composited in three ways that make the same pixels. "
        "Plain: each voxel adds k x k weighted pixels, compiled without vectors, as the paper's. Phases: for each of the k x k offsets in "
        "turn, all voxels add to the pixel at that offset, in vectors (5 x 5 pixels: the voxel's own and the paper's 24 phases). Kernels: "
        "those of the renderer, which filter along one axis and then along the other, in vectors. "
        "The last table has the same of a slice of randomly placed voxels, k = 5.",
        " ".join(growths + compared),
        [
            plots.lines(
                "figure-8a-splatting",
                "Figure 8a: splatting a worker's slab",
                {
                    f"N = {size}": [(w, run.value("run_time", part="splat over workers", n=size, workers=w)) for w in workers]
                    for size in sizes
                },
                "workers p",
                "time",
                "The slab that takes longest. The paper prints its curve without numbers.",
                log_y=True,
            ),
            plots.lines(
                "figure-8b-footprint",
                f"Figure 8b: a filled slice, {side} x {side}",
                {loop: [(k, slice_time(loop, k)) for k in widths] for loop in loops},
                "footprint width k",
                "time",
                "Both axes logarithmic, so a straight line is a power of k.",
                **plots.LOG_LOG,
            ),
            Table(
                f"Figure 8b in numbers: a filled slice, {side} x {side}",
                ["k"] + loops + ["plain over phases", "phases over kernels"],
                [
                    [k]
                    + [slice_time(loop, k) for loop in loops]
                    + [slice_time(of, k).over(slice_time(loop, k)) for loop, of, _ in pairs]
                    for k in widths
                ],
            ),
            Table(
                f"A slice of randomly placed voxels, {side} x {side}, k = 5",
                ["C (%)"] + loops + ["plain over phases"],
                [
                    [f"{c * 100:g}", *(sparse_time(loop, c) for loop in loops), sparse_time(loops[0], c).over(sparse_time(loops[1], c))]
                    for c in shares
                ],
            ),
        ],
    )


def _points(run: Run) -> Section:
    of = {"part": "points", "metric": "run_time", "variant": "points"}
    sizes, views = sorted(run.distinct("n", **of)), run.distinct("view", **of)
    scale = {view: float(view.split()[0]) for view in views}

    def time(variant: str, n: int, view: str) -> Value:
        return run.value("run_time", part="points", variant=variant, n=n, view=view)

    def count(variant: str, n: int, view: str) -> Value:
        return run.value("count", part="points", variant=variant, n=n, view=view)

    def share(variant: str, n: int, view: str) -> Value:
        covered = count("covered pixels", n, view)
        return count(variant, n, view).over(covered).percent() if covered.value else Value.exact(0, "%")

    def holes(n: int, view: str) -> Value:
        empty, behind = (share(variant, n, view) for variant in ("empty pixels", "pixels of voxels behind"))
        return Value.exact(empty.value + behind.value, "%")

    n = sizes[-1]
    shares = [f"{holes(n, view).value:.1f} % at {scale[view]:g}" for view in views]
    doubled = [f"{share('doubled pixels', n, view).value:.1f} % at {scale[view]:g}" for view in views]
    ratios = {(size, view): time("points", size, view).over(time("faces", size, view)) for size in sizes for view in views}
    return Section(
        "Holes and doubled pixels: Z-buffering of voxel points",
        "How many holes and doubled pixels does the paper's Z-buffer leave, and what do faces cost, which leave none?",
        "Points, as in the paper: each occupied voxel of a class-I sphere writes the one pixel that its centre falls on, if it is the "
        "nearest; all voxels are transformed, slice by slice, from an array. Faces: the renderer's Z-buffer stage with its transform, "
        "which draws the faces of voxels and has found the surface beforehand. One thread, N x N pixels, neither is shaded. A pixel that a "
        "face covers is a hole if no point has written it, or one of a voxel that lies more than a voxel's diagonal behind the "
        "face. A pixel is doubled if a second voxel falls on it that lies within a voxel's length of the nearest one, so that neither "
        "hides the other. A magnified sphere is cut off by the picture's border.",
        f"At N = {n}, of the covered pixels {', '.join(shares[:-1])} and {shares[-1]} pixels a voxel are holes; "
        f"{', '.join(doubled[:-1])} and {doubled[-1]} are doubled. Drawing faces is "
        f"{compared_texts({'faces': ratios}, {'faces': 'drawing points'})['faces']}.",
        [
            Table(
                "Points and faces",
                ["N", "pixels a voxel", "points", "faces", "points over faces", "covered pixels", "empty", "a voxel behind", "holes", "doubled"],
                [
                    [
                        size,
                        f"{scale[view]:g}",
                        time("points", size, view),
                        time("faces", size, view),
                        time("points", size, view).over(time("faces", size, view)),
                        int(count("covered pixels", size, view).value),
                        share("empty pixels", size, view),
                        share("pixels of voxels behind", size, view),
                        holes(size, view),
                        share("doubled pixels", size, view),
                    ]
                    for size in sizes
                    for view in views
                ],
            ),
            plots.lines(
                "holes",
                "Covered pixels that show no point of their surface",
                {f"N = {size}": [(scale[view], holes(size, view)) for view in views] for size in sizes},
                "pixels a voxel",
                "share of holes",
                "Counted, so without whiskers.",
                **plots.FROM_ZERO,
            ),
        ],
    )


# What a volume of figure 12 is, by where it comes from.
_SOURCES = {
    "MRI brain": "No --volume was given, so figure 12 shows the MRI brain of Debian's mricron-data.",
    "--volume": "Figure 12 shows the volume that --volume named.",
}


def pictures(run: Run) -> Section:
    pictures = run.attached("pictures")
    heads = pictures[pictures["figure"] == "Figure 12"]
    if heads.empty:
        answer = "There is no figure 12: no --volume was given, and mricron-data is not here."
    else:
        head = heads.iloc[0]
        answer = f"{_SOURCES[head['source']]} It is '{head['volume']}', {head['nx']} x {head['ny']} x {head['nz']} voxels."
    photos = []
    for _, picture in pictures.iterrows():
        png = (run.folder / "pictures" / f"{picture['name']}.png").read_bytes()
        size = f"{picture['nx']} x {picture['ny']} x {picture['nz']}"
        photos.append(Photo(picture["name"], png, f"{picture['figure']}: {picture['volume']}, {size}, by {picture['renderer']}"))
    return Section(
        "Pictures: figures 12 and 13",
        "What do both pipelines draw?",
        "The paper shows an MRI head of 256 x 256 x 256 voxels and a sphere of 128 x 128 x 128. Here: a head, and a class-II sphere with "
        f"40 % of its voxels occupied, both by the Z-buffer and by splatting, {pictures['pixels'].iloc[0]} pixels a side.",
        answer,
        photos,
    )
