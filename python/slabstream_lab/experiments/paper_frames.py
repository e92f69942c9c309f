"""Frames of `experiment paper`: tables 2, 5 and 6, figures 8c to 11, and efficiency over grain."""
from __future__ import annotations

import dataclasses
import math
import statistics
from typing import Callable, Sequence

from .. import plots
from ..page import Figure, Section, Table
from ..ranking import decide
from ..results import Run
from ..value import Value, speed_text

TITLES = {"splat": "splatting", "zbuffer": "the Z-buffer"}


def sections(run: Run) -> list[Section]:
    frames = Frames(run)
    return [_combining(frames), _splatting(frames), _pipeline(frames, SPLAT), _pipeline(frames, ZBUFFER), _compositing(frames), _grain(frames)]


class Cases:
    """A part of the results by renderer, N and p. `usual`: what the other columns hold, unless a question says otherwise."""

    def __init__(self, run: Run, part: str, **usual):
        self._rows = run.narrowed(part=part)
        self._usual = usual
        self.sizes = sorted(self._rows.distinct("n"))
        self.workers = sorted(self._rows.distinct("workers"))

    def find(self, metric: str, renderer: str, n: int, p: int, **columns) -> Value | None:
        return self._rows.find(metric, renderer=renderer, n=n, workers=p, **self._usual | columns)

    def value(self, metric: str, renderer: str, n: int, p: int, **columns) -> Value:
        return self._rows.value(metric, renderer=renderer, n=n, workers=p, **self._usual | columns)

    def time(self, renderer: str, n: int, p: int, **columns) -> Value:
        return self.value("frame_time", renderer, n, p, **columns)

    def speed_up(self, renderer: str, n: int, p: int, **columns) -> Value:
        return Value.exact(1) if p == 1 else self.time(renderer, n, 1).over(self.time(renderer, n, p, **columns))

    def efficiency(self, renderer: str, n: int, p: int, **columns) -> Value:
        return self.speed_up(renderer, n, p, **columns).times(1 / p).percent()


class Frames(Cases):
    """The frames of a run, as the paper counts them, and the printed ones. `axis`: "view" as in the paper, "auto" as Slabstream does."""

    def __init__(self, run: Run):
        super().__init__(run, "frames", axis="view", combine="fan-in", variant="whole images", stage=None)
        self.run = run
        self.table_n = run.distinct("n", part="frames", combine="centralized")[0]
        self.printed_workers = sorted(run.distinct("workers", part="printed"))
        self._printed = run.narrowed(part="printed")

    def printed(self, metric: str, table: str, p: int, combine: str = "fan-in", stage: str | None = None) -> Value | None:
        return self._printed.find(metric, variant=table, workers=p, combine=combine, stage=stage)

    def grain(self, renderer: str, n: int, p: int) -> float:
        return self.value("grain", renderer, n, p).value


def over_workers(name: str, title: str, series: plots.Series, what: str, caption: str) -> Figure:
    """Time, speed-up or efficiency."""
    return plots.lines(name, title, series, "workers p", what, caption, log_y=what == "time", from_zero=what != "time", marks=True)


def shares_of(parts: dict[str, Value | None], whole: float) -> dict[str, float]:
    """In per cent, to the tenth."""
    return {name: round(100 * part.value / whole if part else 0, 1) for name, part in parts.items()}


def rounded(value: Value) -> str:
    """Of printed numbers: with three digits, since none of them has more than four."""
    return f"{value.value:.3g}" + (f" {value.unit}" if value.unit != "1" else "")


def size_text(frames: Frames) -> str:
    return f"N = {frames.table_n}" + ("" if frames.table_n == 200 else " (the paper: N = 200)")


# ---------------------------------------------------------------- combining


@dataclasses.dataclass
class Fit:
    """y = c f(x) by least squares; residual: root mean square of what is left, over the mean of y."""

    constant: float
    residual: float


def fit(points: Sequence[tuple[float, float]], shape: Callable[[float], float]) -> Fit:
    constant = sum(shape(x) * y for x, y in points) / sum(shape(x) ** 2 for x, _ in points)
    left = math.sqrt(statistics.fmean((y - constant * shape(x)) ** 2 for x, y in points))
    mean = statistics.fmean(y for _, y in points)
    return Fit(constant, left / mean if mean > 0 else 0)


def _closer(log: Fit, linear: Fit) -> str:
    if max(log.residual, linear.residual) < 1.1 * min(log.residual, linear.residual):
        return "as close"
    return "log2 p" if log.residual < linear.residual else "p"


def _combining(frames: Frames) -> Section:
    n, shared = frames.table_n, [p for p in frames.workers if p > 1]

    def get(p: int, combine: str, variant: str = "whole images") -> Value:
        return frames.time("splat", n, p, combine=combine, variant=variant)

    rows = []
    for p in shared:
        row = [p]
        for variant in ("whole images", "without empty pixels"):
            central, tree = get(p, "centralized", variant), get(p, "fan-in", variant)
            row += [central, tree, central.over(tree)]
        central, tree = (frames.printed("frame_time", "table 2", p, combine) for combine in ("centralized", "fan-in"))
        rows.append(row + [central, tree, central.over(tree) if central and tree else None])
    schemes = ["centralised", "hierarchical", "speed-up"]
    table = Table(
        f"Table 2. A frame by splatting, {size_text(frames)}; rounds of combining are assumed",
        ["p", *(f"{variant}: {s}" for variant in ("whole", "without empty pixels") for s in schemes), *(f"paper: {s}" for s in schemes)],
        rows,
    )

    # Figure 9: what the paper's tables leave to combining. Rounds are an input of ours, so a curve of ours would only return them.
    paper_curves = {}
    one = frames.printed("frame_time", "table 5", 1)
    for name, combine in (("centralised", "centralized"), ("hierarchical", "fan-in")):
        times = [(p, frames.printed("frame_time", "table 2", p, combine)) for p in frames.printed_workers]
        paper_curves[f"paper, table 2 less T(1)/p: {name}"] = [
            (p, Value.exact(v.value - one.value / p, "s", "paper")) for p, v in times if v and one
        ]
    paper_curves["paper, table 5: combining"] = [
        (p, v) for p in frames.printed_workers if p > 1 and (v := frames.printed("combine_time", "table 5", p))
    ]
    fits = {}
    for name, points in paper_curves.items():
        numbers = [(p, v.value) for p, v in points]
        fits[name] = (fit(numbers, math.log2), fit(numbers, lambda p: p))
    fit_table = Table(
        "The paper's combining, fitted by c log2 p (Eq. 18) and by c p (Eq. 19)",
        ["curve", "c of log2 p", "residual (%)", "c of p", "residual (%)", "closer"],
        [
            [name]
            + [cell for f in (log, linear) for cell in (Value.exact(f.constant, "s", "paper").text(), round(100 * f.residual))]
            + [_closer(log, linear)]
            for name, (log, linear) in fits.items()
        ],
    )

    p = shared[-1]
    printed_last = rows[-1][-1]
    paper = f" (the paper: {rounded(printed_last)} times as fast)" if printed_last else ""
    gains = {s: get(p, s).over(get(p, s, "without empty pixels")) for s in ("centralized", "fan-in")} | {"scheme": rows[-1][3]}
    outcomes = decide(gains)
    nearest = "; ".join(f"{name}: {_sentence(log, linear)}" for name, (log, linear) in fits.items())
    answer = (
        f"Of the printed times, {nearest}. Given the rounds that we assume: at p = {p}, with whole images, a frame with hierarchical "
        f"combining is {speed_text(gains['scheme'], outcomes['scheme'], 'one with centralised combining')}{paper}; without empty pixels a "
        f"frame with hierarchical combining is {speed_text(gains['fan-in'], outcomes['fan-in'], 'one with whole images')}, and one with "
        f"centralised combining is {speed_text(gains['centralized'], outcomes['centralized'], 'one with whole images')}."
    )
    return Section(
        "Combining: table 2 and figure 9",
        "What does hierarchical combining gain over one worker that combines all images, and how does combining grow with p?",
        "Schedules run in virtual time with the measured cost of each slab, on the paper's machine (above), until one worker holds the "
        "combined image. The paper sends whole images; Slabstream leaves empty pixels out. Combining is what a frame takes longer than its "
        "slowest slab, so images that are combined while that slab is rendered cost nothing. Combining is assumed, not measured: the "
        "machine's rounds, ceil(log2 p) or p - 1, take one fitted time each and do not contend. So neither the gain of the hierarchical "
        "scheme nor the growth of combining is found here. Fits are least squares through the origin; the residual is the root mean square "
        "over the mean. The paper's caption of table 2 says combining times, but the hierarchical row is the row of frame times of table "
        "5: both rows count as frame times here.",
        answer,
        [
            table,
            plots.lines(
                "figure-9-combining",
                "Figure 9: combining by the paper's tables",
                paper_curves,
                "workers p",
                "combining",
                "N = 200: table 2 less T(1) / p, and the share of combining in table 5. The paper prints figure 9 without numbers.",
                **plots.FROM_ZERO,
            ),
            fit_table,
        ],
    )


def _sentence(log: Fit, linear: Fit) -> str:
    residuals = f"{100 * log.residual:.0f} % and {100 * linear.residual:.0f} %"
    closer = _closer(log, linear)
    return f"residuals of c log2 p and c p are {residuals}, " + ("as close" if closer == "as close" else f"closer to c {closer}")


# ---------------------------------------------------------------- occupancy


def _splatting(frames: Frames) -> Section:
    rows = frames.run.select(part="figure-8c").sort_values("occupancy")
    points = plots.points_of(rows, "occupancy")
    (n,), p = frames.run.distinct("n", part="figure-8c"), int(rows["workers"].iloc[0])
    start, left = _straight_line([(c, v.value) for c, v in points])
    (least_c, least), (most_c, most) = points[0], points[-1]
    answer = (
        f"From C = {least_c * 100:.0f} % to {most_c * 100:.0f} %, {most_c / least_c:.0f} times as many voxels, splatting takes "
        f"{most.over(least).text()} times as long. The straight line of least squares leaves {100 * left:.0f} % (the paper: linear) and "
        f"begins {'above' if start > 0 else 'below'} 0, at {100 * start / most.value:+.0f} % of the time at C = {most_c * 100:.0f} %."
    )
    return Section(
        "Splatting: figure 8c",
        "How does the splatting stage grow with occupancy?",
        f"Class II as in the paper, which has N = 300, here N = {n}, p = {p}: each worker's slab holds a ball clipped by the slab, with at "
        "most C N³/p voxels. All slabs are alike, and one is rendered on one thread: places of voxels and splatting. The view sets the "
        "width of our footprint, 4 to 6 voxels; the paper's is k = 5. What the line leaves is the root mean square over the mean.",
        answer,
        [
            plots.lines(
                "figure-8c-occupancy",
                f"Figure 8c: splatting against occupancy, N = {n}, p = {p}",
                {"class II in each slab": points},
                "occupied share C of a slab",
                "time",
                "The paper's curve ends between 80 and 90 s at C = 1.",
                from_zero=True,
            ),
            Table("Figure 8c in numbers", ["C (%)", "time"], [[round(c * 100), v] for c, v in points]),
        ],
    )


def _straight_line(points: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Of y = a + b x by least squares: a, and the root mean square of what is left over the mean of y."""
    xs, ys = zip(*points)
    slope, start = statistics.linear_regression(xs, ys)
    return start, math.sqrt(statistics.fmean((y - start - slope * x) ** 2 for x, y in points)) / statistics.fmean(ys)


# ---------------------------------------------------------------- pipelines


@dataclasses.dataclass(frozen=True)
class Pipeline:
    renderer: str
    title: str
    table: str  # of the paper
    figure: int
    stages: Sequence[str]  # without combining
    remark: str = ""


SPLAT = Pipeline("splat", "Splatting: table 5 and figure 10", "table 5", 10, ("transform", "shade", "splat", "composite"))
ZBUFFER = Pipeline(
    "zbuffer",
    "Z-buffer: table 6 and figure 11",
    "table 6",
    11,
    ("transform", "z_buffer", "shade"),
    " Our Z-buffer transforms a voxel as it draws it: the stage z_buffer holds both.",
)


def _shares(frames: Frames, pipeline: Pipeline, p: int) -> dict[str, float]:
    n, renderer = frames.table_n, pipeline.renderer
    parts = {stage: frames.find("stage_time", renderer, n, p, stage=stage) for stage in pipeline.stages}
    parts["combine"] = frames.find("combine_time", renderer, n, p)
    return shares_of(parts, sum(part.value for part in parts.values() if part))  # the medians of parts need not sum to that of the whole


def _printed_shares(frames: Frames, pipeline: Pipeline, p: int) -> dict[str, float] | None:
    parts = {stage: frames.printed("stage_time", pipeline.table, p, stage=stage) for stage in pipeline.stages}
    time = frames.printed("frame_time", pipeline.table, p)
    return shares_of(parts | {"combine": frames.printed("combine_time", pipeline.table, p)}, time.value) if time else None


def _pipeline(frames: Frames, pipeline: Pipeline) -> Section:
    n, renderer, workers = frames.table_n, pipeline.renderer, frames.workers
    ours = {p: _shares(frames, pipeline, p) for p in workers}
    theirs = {p: _printed_shares(frames, pipeline, p) for p in workers}
    names, printed_names = list(ours[workers[-1]]), list(next(filter(None, theirs.values())))
    stages = Table(
        f"{pipeline.table.capitalize()}. {size_text(frames)}: a frame, and the share of each stage in per cent",
        [
            "p", "time", *("combine, assumed" if name == "combine" else name for name in names),
            "paper: time", *(f"paper: {name}" for name in printed_names),
        ],  # fmt: skip
        [
            [p, frames.time(renderer, n, p), *(ours[p].get(name) for name in names), frames.printed("frame_time", pipeline.table, p)]
            + [(theirs[p] or {}).get(name) for name in printed_names]
            for p in workers
        ],
    )
    bars = {}
    for p in workers:
        bars[f"{p}"] = ours[p]
        if theirs[p]:
            bars[f"{p} paper"] = theirs[p]

    shared = [p for p in workers if p > 1]
    axes = Table(
        f"{size_text(frames)}: slabs of whole slices, as in the paper, and along our default axis",
        ["p", "whole slices: time", "efficiency", "default axis: time", "efficiency", "whole slices / default"],
        [
            [
                p,
                frames.time(renderer, n, p),
                frames.efficiency(renderer, n, p),
                frames.time(renderer, n, p, axis="auto"),
                frames.efficiency(renderer, n, p, axis="auto"),
                frames.time(renderer, n, p).over(frames.time(renderer, n, p, axis="auto")),
            ]
            for p in shared
        ],
    )

    def curves(of: Callable[..., Value], paper: Callable[[Value, Value, int], Value], default_axis: bool = False):
        series = {f"N = {size}": [(p, of(renderer, size, p)) for p in workers] for size in frames.sizes}
        if default_axis:
            series[f"N = {n}, default axis"] = [(p, of(renderer, n, p, axis="auto")) for p in shared]
        times = {p: v for p in frames.printed_workers if (v := frames.printed("frame_time", pipeline.table, p))}
        return series | {"paper, N = 200": [(p, paper(times[1], v, p)) for p, v in times.items()]}

    number = pipeline.figure
    p = workers[-1]
    paper_p = max(q for q in frames.printed_workers if theirs.get(q))
    paper_one, paper_last = (frames.printed("frame_time", pipeline.table, q) for q in (1, paper_p))
    paper_speed_up = paper_one.over(paper_last)
    by_size = [frames.speed_up(renderer, size, p) for size in frames.sizes]
    gains = dict(enumerate(b.over(a) for a, b in zip(by_size, by_size[1:])))
    gains["default"] = frames.time(renderer, n, p).over(frames.time(renderer, n, p, axis="auto"))
    outcomes = decide(gains)
    steps = [outcomes[i] for i in range(len(by_size) - 1)]
    if "open" in steps:
        trend = "are not ranked by N"
    elif "slower" in steps:
        trend = "do not grow with N at every step"
    elif "tie" in steps:
        trend = "tie for some neighbouring N"
    else:
        trend = "grow with N at every step"
    listed = ", ".join(f"{v.text()} (N = {size})" for size, v in zip(frames.sizes, by_size))
    default = speed_text(gains["default"], outcomes["default"], "one with slabs of whole slices")
    answer = (
        f"At N = {n}, p = {p} the speed-up is {frames.speed_up(renderer, n, p).text()}, an efficiency of "
        f"{frames.efficiency(renderer, n, p).text()} (the paper at N = 200, p = {paper_p}: {rounded(paper_speed_up)}, "
        f"{rounded(paper_speed_up.times(1 / paper_p).percent())}); {ours[p]['combine']:.0f} % of the time is combining, whose rounds are "
        f"assumed (the paper: {theirs[paper_p]['combine']:.0f} % at p = {paper_p}). Speed-ups at p = {p} {trend}: {listed}. With our "
        f"default axis the frame is {default}."
    )
    caption = "Slanted in the table: simulated. p = 1 is measured."
    times = curves(frames.time, lambda one, v, q: v)
    speed_ups = curves(frames.speed_up, lambda one, v, q: one.over(v))
    efficiencies = curves(frames.efficiency, lambda one, v, q: one.over(v).times(1 / q).percent(), True)
    return Section(
        pipeline.title,
        f"How long does a frame by {TITLES[renderer]} take, how much do p workers gain, and where does the time go?",
        "As the paper did it: class-I spheres of 5 %, slabs of N/p whole slices, hierarchical combining of whole images, one frame at a "
        "time, nobody balanced. Slabs are measured one by one; with p = 1 that is the whole frame. For more workers the combining is "
        "simulated on the paper's machine. Shares are of the sum of the medians: stages of the worker that renders longest, and what "
        "combining adds to it. Our default axis does not change with the view, so no voxel moves; slices are then "
        f"divided.{pipeline.remark}",
        answer,
        [
            stages,
            plots.stacked(
                f"figure-{number}-stages", f"Where a frame's time goes, N = {n}", bars, "share (%)", "By workers, ours and the paper's."
            ),
            over_workers(f"figure-{number}a-time", f"Figure {number}a: time of a frame", times, "time", caption),
            over_workers(
                f"figure-{number}b-speed-up", f"Figure {number}b: speed-up", speed_ups, "speed-up", "Time of one worker over that of p (Eq. 6)."
            ),
            over_workers(f"figure-{number}c-efficiency", f"Figure {number}c: efficiency", efficiencies, "efficiency", "Speed-up over p (Eq. 7)."),
            axes,
        ],
    )


# ---------------------------------------------------------------- compositing


def _compositing(frames: Frames) -> Section:
    """Equation 17: T_cp = c_cp I^2 N / p."""
    times = {(n, p): frames.find("stage_time", "splat", n, p, stage="composite") for n in frames.sizes for p in frames.workers}

    # I^2 is N^3/p over the grain.
    constants = {(n, p): time.times(p**2 * frames.grain("splat", n, p) / n**4) for (n, p), time in times.items() if time is not None}
    ordered = sorted(constants, key=lambda case: constants[case].value)
    (least_n, least_p), (most_n, most_p) = ordered[0], ordered[-1]
    least, most = constants[ordered[0]], constants[ordered[-1]]
    return Section(
        "Compositing: equation 17",
        "The paper takes compositing to grow as c I² N/p. Is c the same for all N and p?",
        "The stage of the worker that renders longest, in the frames of figure 10. I² is the number of pixels of the grid along the slices. A constant c "
        "would make each line of the first plot fall as 1/p, and the lines of the second plot flat.",
        f"c is least at N = {least_n}, p = {least_p}, with {least.text()} a pixel and slice, and most at N = {most_n}, p = {most_p}, with "
        f"{most.text()}: {most.value / least.value:.1f} times as much.",
        [
            plots.lines(
                "equation-17-over-p",
                "Compositing over p",
                {f"N = {n}": [(p, times[n, p]) for p in frames.workers if times[n, p] is not None] for n in frames.sizes},
                "workers p",
                "time of the stage",
                "Both axes logarithmic.",
                **plots.LOG_LOG,
            ),
            plots.lines(
                "equation-17-constant",
                "c of equation 17 over N",
                {f"p = {p}": [(n, constants[n, p]) for n in frames.sizes if (n, p) in constants] for p in frames.workers},
                "N",
                "c",
                **plots.FROM_ZERO,
            ),
        ],
    )


# ---------------------------------------------------------------- grain


def _grain(frames: Frames) -> Section:
    rows, curves, found = [], {}, []
    for renderer in ("splat", "zbuffer"):
        points = [
            (frames.grain(renderer, n, p), n, p, frames.efficiency(renderer, n, p)) for n in frames.sizes for p in frames.workers if p > 1
        ]
        rows += [[renderer, n, p, f"{grain:.3g}", efficiency] for grain, n, p, efficiency in points]
        for p in (q for q in frames.workers if q > 1):
            if renderer == "splat" or p in (2, frames.workers[-1]):
                curves[f"{renderer}, p = {p}"] = [(grain, efficiency) for grain, _, q, efficiency in points if q == p]
        rank = _rank_correlation([(grain, efficiency.value) for grain, _, _, efficiency in points])
        how = "rise together" if rank > 0.5 else "go opposite ways" if rank < -0.5 else "are not closely related"
        found.append(f"For {TITLES[renderer]} grain and efficiency {how} (rank correlation {rank:.2f} over {len(points)} frames)")
    return Section(
        "Grain",
        "The paper expects efficiency to follow the grain, the ratio of computation to communication (N³/p)/I² (section 2). Does it?",
        "The frames of figures 10 and 11 with p > 1. I² is the number of pixels that a worker renders into and sends: with splatting those "
        "of the grid along the slices.",
        ". ".join(found) + ".",
        [
            plots.lines(
                "grain-efficiency",
                "Efficiency over grain",
                curves,
                "grain (N³/p)/I²",
                "efficiency",
                "Along each line only N changes.",
                log_x=True,
                from_zero=True,
            ),
            Table("Grain and efficiency", ["pipeline", "N", "p", "(N³/p)/I²", "efficiency"], rows),
        ],
    )


def _rank_correlation(points: Sequence[tuple[float, float]]) -> float:
    """Spearman's."""
    import pandas

    ranks = pandas.DataFrame(points).rank()
    correlation = ranks[0].corr(ranks[1])
    return 0 if math.isnan(correlation) else correlation
