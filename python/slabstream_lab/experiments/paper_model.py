"""Models and claims of `experiment paper`: the paper's machine, constants, streaming and balance, claims of the text, validation."""
from __future__ import annotations

import math
import statistics

from .. import plots
from ..page import Section, Table
from ..ranking import Ranking, ranking
from ..results import Run, value_of
from ..value import Value, speed_text
from .paper_frames import TITLES, Frames, rounded, size_text

GOOD = 0.10  # an error up to which a model gives a number back
OCCUPANCY, FILTER = 0.05, 5  # C of our spheres; k of the paper's filter


def machine_sections(run: Run) -> list[Section]:
    frames = Frames(run)
    return [_machine(run), _constants(run, frames)]


def beyond_sections(run: Run) -> list[Section]:
    frames = Frames(run)
    return [_beyond(run, frames), _claims(run, frames), _validation(run)]


# ---------------------------------------------------------------- the paper's machine

COLUMNS = {
    "table 2, centralised": ("splat", "frame_time", "table 2", "centralized", "frame"),
    "table 2, hierarchical": ("splat", "frame_time", "table 2", "fan-in", "frame"),
    "table 5, time": ("splat", "frame_time", "table 5", "fan-in", "frame"),
    "table 5, combining": ("splat", "combine_time", "table 5", "fan-in", "combining"),
    "table 6, time": ("zbuffer", "frame_time", "table 6", "fan-in", "frame"),
    "table 6, combining": ("zbuffer", "combine_time", "table 6", "fan-in", "combining"),
}


def _machine(run: Run) -> Section:
    rows, summary, series, back, not_back = [], [], {}, [], []
    for name, (renderer, metric, table, combine, what) in COLUMNS.items():
        errors = {}
        for p in sorted(run.distinct("workers", part="printed", variant=table, combine=combine)):
            case = {"workers": p, "combine": combine, "renderer": renderer}
            error = run.find("error", part="paper-model", variant=f"{table}, {what}", **case)
            if p == 1 or error is None:
                continue
            times = [run.value(metric, part=part, variant=table, stage=None, **case) for part in ("printed", "paper-model")]
            rows.append([name, p, *times, round(100 * error.value, 1)])
            errors[p] = error
        series[name] = [(p, error.percent()) for p, error in errors.items()]
        worst = max(errors, key=lambda p: abs(errors[p].value))
        others = max((abs(e.value) for p, e in errors.items() if p != worst), default=0)
        summary.append(
            [name, *(f"{100 * limit(e.value for e in errors.values()):+.0f}" for limit in (min, max)), worst, f"{100 * others:.0f}"]
        )
        text = f"{name} ({100 * abs(errors[worst].value):.0f} % at p = {worst}"
        if abs(errors[worst].value) <= GOOD:
            back.append(text + ")")
        else:
            not_back.append(text + f", else up to {100 * others:.0f} %)")
    answer = (
        f"Largest errors of the model. Within {100 * GOOD:.0f} %, so given back: {', '.join(back) or 'no column'}. "
        f"Beyond, so not given back: {', '.join(not_back) or 'no column'}."
    )
    return Section(
        "The paper's machine",
        "Which simple model of the paper's machine gives back its printed times?",
        "T(p) = T(1)/p + u rounds(p), with ceil(log2 p) rounds of hierarchical and p - 1 of centralised combining. T(1) is printed: 72.89 s "
        "(splatting) and 8.46 s (Z-buffer). One u a renderer, 0.20 s and 0.13 s, is fitted by hand: the time to write, read and composite "
        "an image, which rounds do not wait for (Eq. 18, not Eq. 19). Simulations below use this machine: a round takes the same share of a "
        "frame on one processor, for a whole image; an image with fewer pixels takes less.",
        answer,
        [
            Table(
                "Errors of the model, by column of the paper",
                ["column", "least (%)", "largest (%)", "worst at p", "largest elsewhere (%)"],
                summary,
            ),
            plots.lines(
                "paper-model-errors",
                "Errors of the model of the paper's machine",
                series,
                "workers p",
                "model over printed, less 1",
                "All numbers are the paper's or follow from them.",
                marks=True,
            ),
            Table("The model beside the paper", ["column", "p", "printed", "model", "error (%)"], rows),
        ],
    )


# ---------------------------------------------------------------- constants


def _constants(run: Run, frames: Frames) -> Section:
    blocks, found, bounds = [], [], []
    for renderer, times, printed_table in (("splat", "table 5", "table 3"), ("zbuffer", "table 6", "table 4")):
        rows = []
        for symbol, equation, unit, stage, units in _terms(renderer):
            paper = frames.printed("stage_time", times, 1, stage=stage) if stage != "combine" else None
            if stage == "combine":
                last = max(frames.printed_workers)
                combining = frames.printed("combine_time", times, last)
                from_times = combining.times(1 / units(200, last, 200**2)) if combining else None
            else:
                from_times = paper.times(1 / units(200, 1, 200**2)) if paper else None
            here = _constant(frames, renderer, stage, units, frames.table_n, 1)
            everywhere = [v for n in frames.sizes for p in frames.workers if (v := _constant(frames, renderer, stage, units, n, p))]
            largest = max(everywhere, key=lambda v: v.value) if everywhere else None
            if stage == "combine" and renderer == "splat":
                here = run.find("constant", part="combining-pixel", renderer=renderer)
            bound = run.find("constant", part="printed", variant=printed_table, stage=symbol.replace("_", ""))
            gain = from_times.over(here) if from_times and here else None
            rows.append([symbol, equation, unit, here, largest, from_times, bound, gain])
            if gain:
                found.append(f"{symbol} of {TITLES[renderer]} {gain.value:.3g}")
            if bound and from_times:
                bounds.append((bound.value / from_times.value, f"{symbol} of {TITLES[renderer]}"))
        number = printed_table.split()[1]
        blocks.append(
            Table(
                f"Table {number}. Constants of {TITLES[renderer]} in the paper's units",
                ["constant", "Eq.", "a unit is a", "here, p = 1", "here, largest of all N, p", "paper: from its times", "paper: printed bound", "its times / here"],
                rows,
            )
        )
        blocks.append(_fit_table(run, renderer))
    ratios = [ratio for ratio, _ in bounds]
    below = [name for ratio, name in bounds if ratio < 1]
    answer = (
        f"The paper's times a unit, over what one processor takes here at {size_text(frames)}: {', '.join(found)}. "
        f"The printed constants, called upper bounds, are {min(ratios):.2g} to {max(ratios):.2g} times what tables 5 and 6 give"
        + (f"; {', '.join(below)} lies below its times" if below else "")
        + "."
    )
    return Section(
        "Constants: tables 3 and 4",
        "What does a unit of work of each stage cost, in the units of the paper's equations and in those of a model of our own stages?",
        "Tables 3 and 4: a stage's time of the worker that renders longest, over the units that the paper's equation gives it: C = 5 %, k = 5, "
        "I² the pixels of a whole image (the paper: I = N, at p = 1, and p = 30 for combining). Our pipeline skips empty space and filters "
        "separably, so a unit is not the same work. c_co here is measured: to find, copy and composite a pixel of a colour image. c_t of the "
        "Z-buffer is part of c_z here. Below them our own units: a model fitted to every slab of every N and p (least squares of relative "
        "residuals, none below 0, 95 % intervals); the last column is the mean error for slabs that the fit has not seen, over their mean time.",
        answer,
        blocks,
    )


def _terms(renderer: str):
    """Symbol, equation, unit, stage, and the number of units of N, p and I²."""
    occupied = lambda n, p, pixels: OCCUPANCY * n**3 / p  # noqa: E731
    combine = ("18", "pixel and round", "combine", lambda n, p, pixels: pixels * math.ceil(math.log2(p)))
    transform = ("c_t", "12", "voxel", "transform", lambda n, p, pixels: n**3 / p)
    if renderer == "splat":
        return [
            transform,
            ("c_sh", "13", "occupied voxel", "shade", occupied),
            ("c_sp", "14", "occupied voxel and entry of the filter", "splat", lambda n, p, pixels: occupied(n, p, pixels) * FILTER**2),
            ("c_cp", "17", "pixel and slice", "composite", lambda n, p, pixels: n * pixels / p),
            ("c_co", *combine),
        ]
    return [
        transform,
        ("c_z", "22", "occupied voxel", "z_buffer", occupied),
        ("c_sh", "23", "share C of the pixels", "shade", lambda n, p, pixels: OCCUPANCY * pixels),
        ("c_co", "24", *combine[1:]),
    ]


def _constant(frames: Frames, renderer: str, stage: str, units, n: int, p: int) -> Value | None:
    if stage == "combine":
        return None
    value = frames.find("stage_time", renderer, n, p, stage=stage)
    if value is None:
        return None
    pixels = n**3 / p / frames.grain(renderer, n, p)
    return value.times(1 / units(n, p, pixels))


def _fit_table(run: Run, renderer: str) -> Table:
    rows = []
    for stage in run.distinct("stage", part="fit", renderer=renderer):
        fitted = run.select(part="fit", renderer=renderer, stage=stage)
        errors = {row["variant"]: 100 * row["value"] for _, row in fitted[fitted["metric"] == "error"].iterrows()}
        for i, (_, row) in enumerate(fitted[fitted["metric"] == "constant"].iterrows()):
            rows.append([stage if i == 0 else "", row["variant"], value_of(row), *(f"{e:.0f}" if i == 0 else "" for e in errors.values())])
    return Table(
        f"Our own model of {TITLES[renderer]}, fitted", ["stage", "a unit is a", "time a unit", "residual (%)", "error of prediction (%)"], rows
    )


# ---------------------------------------------------------------- streaming and balance

LINKS = {"paper": "the paper's machine", "10gbit": "10 Gbit/s"}


class _Beyond:
    def __init__(self, run: Run, n: int):
        self.n = n
        self.rows = Run(run.select(part="beyond"), run.info)

    def find(self, metric: str, renderer: str, link: str, p: int, variant: str = "without empty pixels") -> Value:
        """Of the paper's slabs, shared by all workers."""
        slabs = {"decomposition": "slab", "split": "voxels", "combine": "fan-in", "teams": 1}
        return self.rows.value(metric, renderer=renderer, link=link, workers=p, variant=variant, **slabs)

    def best(self, renderer: str, link: str, p: int, teams: int) -> Ranking:
        """All policies by their period."""
        found = self.rows.select(
            metric="period", renderer=renderer, link=link, workers=p, teams=teams, variant="without empty pixels"
        )
        return ranking({_policy_text(row): value_of(row) for _, row in found.iterrows()})

    def efficiency(self, metric: str, renderer: str, link: str, p: int, value: Value) -> Value:
        return self.find(metric, renderer, link, 1).over(value).times(1 / p).percent()


def _policy_text(row) -> str:
    along = " along the view" if row["axis"] == "view" else ""
    dynamic = ", dynamic" if row["balance"] == "dynamic" else ""
    return f"{row['decomposition']} by {row['split']}{along}{dynamic}, {row['combine']}"


def _short(found: Ranking) -> str:
    if not found.decided:
        return f"{found.best[0]} (not ranked)"
    return found.best[0] + (f" (ties with {len(found.best) - 1})" if len(found.best) > 1 else "")


def _beyond(run: Run, frames: Frames) -> Section:
    beyond = _Beyond(run, frames.table_n)
    workers = [p for p in sorted(run.distinct("workers", part="beyond")) if p > 1]
    rows, teams_rows, answers, blocks = [], [], [], []
    p_last = workers[-1]
    for renderer, table in (("splat", "table 5"), ("zbuffer", "table 6")):
        curves: dict[str, list[tuple[float, Value]]] = {}
        for link, link_text in LINKS.items():
            for p in workers:
                whole = link == "paper"
                kinds = {"without empty pixels": "", **({"whole images": ", whole images"} if whole else {})}
                values = {}
                for variant, suffix in kinds.items():
                    values["one at a time" + suffix] = beyond.efficiency(
                        "latency", renderer, link, p, beyond.find("latency", renderer, link, p, variant)
                    )
                    values["asked ahead" + suffix] = beyond.efficiency(
                        "period", renderer, link, p, beyond.find("period", renderer, link, p, variant)
                    )
                best = beyond.best(renderer, link, p, 1)
                values["asked ahead, best partition"] = beyond.efficiency("period", renderer, link, p, best.values[best.best[0]])
                for name, value in values.items():
                    if whole:
                        curves.setdefault(name, []).append((p, value))
                rows.append(
                    [renderer, link, p]
                    + [values.get(kind + suffix) for suffix in (", whole images", "") for kind in ("one at a time", "asked ahead")]
                    + [values["asked ahead, best partition"], best.values[best.best[0]], _short(best)]
                )
                if p != p_last:
                    continue
                for teams in sorted(run.distinct("teams", part="beyond", workers=p)):
                    by_team = beyond.best(renderer, link, p, teams)
                    value = by_team.values[by_team.best[0]]
                    teams_rows.append([renderer, link, p // teams, teams, value, beyond.efficiency("period", renderer, link, p, value), _short(by_team)])
                if whole:
                    paper_p = max(frames.printed_workers)
                    times = [frames.printed("frame_time", table, q) for q in (1, paper_p)]
                    answers.append(
                        f"{TITLES[renderer]}: one frame at a time in the paper's slabs {values['one at a time, whole images'].text()} by latency "
                        f"with whole images (the paper at p = {paper_p}: {rounded(times[0].over(times[1]).times(1 / paper_p).percent())}); "
                        f"frames asked ahead, by throughput, {values['asked ahead, whole images'].text()} with whole images, "
                        f"{values['asked ahead'].text()} without empty pixels, and {values['asked ahead, best partition'].text()} with "
                        f"{_short(best)}"
                    )
        blocks.append(
            plots.lines(
                f"beyond-{renderer}",
                f"{TITLES[renderer]}: efficiency on the paper's machine",
                curves,
                "workers p",
                "efficiency",
                "One at a time: by latency. Asked ahead: by throughput. Each against one worker by the same measure.",
                from_zero=True,
                marks=True,
            )
        )
    blocks.append(
        Table(
            f"{size_text(frames)}: efficiency, all workers on every frame",
            [
                "pipeline", "link", "p", "one at a time, whole images", "asked ahead, whole images", "one at a time", "asked ahead",
                "asked ahead, best partition", "its period", "best partition and scheme",
            ],  # fmt: skip
            rows,
        )
    )
    blocks.append(
        Table(
            f"p = {p_last}: teams that take frames in turn; each team holds the volume",
            ["pipeline", "link", "workers a frame", "teams", "period", "efficiency", "best partition and scheme"],
            teams_rows,
        )
    )
    for name in ("slabs", "kd-tree"):
        blocks.append(
            plots.timeline(
                f"timeline-{name}", f"Four frames, p = {workers[0]}: {name}", run.attached(f"timeline-{name}"), "10 Gbit/s, frames asked for ahead."
            )
        )
        blocks.append(plots.cuts(f"boxes-{name}", f"Render time by box, p = {workers[0]}: {name}", run.attached(f"boxes-{name}"), "Every box rendered alone."))
    return Section(
        "Beyond the paper: streaming and balance",
        "The paper proposes data streaming, other primitives and load balancing. What do they give?",
        "The spheres of the tables, as many frames asked for ahead as keep all workers busy: they render the next frames while the last ones "
        "are combined. Partitions: the paper's slabs; slabs and kd-trees of equal work, along a fixed axis or the view's; one with dynamic "
        "balance; each combined by fan-in and radix-k, ranked by the period. Efficiency by latency compares times of one frame, by "
        "throughput times from picture to picture, each with one worker. The paper's machine has no costs around a frame and one processor a worker; 10gbit is a "
        "switched network with all that a service does around a frame, two cores a worker.",
        f"Efficiency at {size_text(frames)}, p = {p_last}, on the paper's machine. " + ". ".join(text[0].upper() + text[1:] for text in answers) + ".",
        blocks,
    )


# ---------------------------------------------------------------- claims


def _claims(run: Run, frames: Frames) -> Section:
    n, least, shared = frames.table_n, frames.sizes[0], [p for p in frames.workers if p > 1]
    p = shared[-1]
    rows = []

    speed_ups = {q: frames.speed_up("zbuffer", least, q) for q in shared}
    below = [q for q, v in speed_ups.items() if v.ranks and v.high < 1]
    unclear = [q for q, v in speed_ups.items() if not v.ranks or v.low <= 1 <= v.high]
    text = f"below 1 at p = {', '.join(map(str, below))}" if below else "at no p below 1"
    if unclear:
        text += f"; not decided at p = {', '.join(map(str, unclear))}"
    listed = ", ".join(f"{v.text()} (p = {q})" for q, v in speed_ups.items())
    rows.append(["Z-buffer, N = 50: the speed-up is below 1", f"N = {least}: {text}", listed])

    ratios = {q: frames.time("splat", n, q, combine="centralized").over(frames.time("splat", n, q)) for q in shared}
    decided = all(v.ranks for v in ratios.values())
    ahead = [q for i, q in enumerate(shared) if all(ratios[r].low > 1 for r in shared[i:])]
    text = "not ranked" if not decided else f"from p = {ahead[0]} on" if ahead else "at no p up to the largest"
    rows.append(
        ["Hierarchical combining beats centralised even for a modest number of processors", text, ", ".join(f"{v.text()} (p = {q})" for q, v in ratios.items())]
    )

    part = frames.find("combine_time", "zbuffer", n, p).over(frames.time("zbuffer", n, p)).percent()
    paper = frames.printed("combine_time", "table 6", 30).over(frames.printed("frame_time", "table 6", 30)).percent()
    decided = part.ranks and not part.low <= 50 <= part.high
    verdict = "not decided" if not decided else f"{'more' if part.value > 50 else 'less'} than half of the frame"
    rows.append(
        ["Combining dominates the Z-buffer with many processors", f"p = {p}: {verdict}", f"{part.text()} (the paper, p = 30: {rounded(paper)})"]
    )

    pictures = {}
    for view in run.distinct("view", part="claims"):
        values = {}
        for metric in ("count", "image_bytes"):
            slab, cube = (run.value(metric, part="claims", view=view, workers=p, decomposition=d) for d in ("slab", "subcube"))
            values[metric] = cube.value / slab.value
        pictures["perspective" if "fov" in view else "orthographic"] = values
    for name, values in pictures.items():
        ratio = values["count"]
        verdict = "smaller" if ratio < 1 else "larger" if ratio > 1 else "as large"
        rows.append(
            [f"Subcubes make smaller images than slabs ({name})", f"p = {p}: {verdict}",
             f"pixels {ratio:.2f} times those of slabs, bytes sent by fan-in {values['image_bytes']:.2f} times"]  # fmt: skip
        )
    if {"perspective", "orthographic"} <= set(pictures):
        inner, outer = (pictures[name]["count"] for name in ("perspective", "orthographic"))
        text = "as much, within 1 %," if abs(inner / outer - 1) < 0.01 else "more" if inner < outer else "less"
        rows.append(
            ["Slabs suit least under perspective", f"subcubes save {text} under perspective", f"{inner:.3f} against {outer:.3f} of the pixels of slabs"]
        )

    beyond = _Beyond(run, n)
    for renderer in ("splat", "zbuffer"):
        latency, period = (beyond.find(metric, renderer, "paper", p, "whole images") for metric in ("latency", "period"))
        ratio = latency.over(period)
        rows.append(
            [f"Data streaming overlaps rendering and combining ({TITLES[renderer]})",
             f"p = {p}: frames that are asked ahead are {speed_text(ratio, 'one at a time')}",
             f"{period.text()} from picture to picture, {latency.text()} alone"]  # fmt: skip
        )
    one = frames.time("splat", n, 1).over(frames.time("zbuffer", n, 1))
    paper_one = [frames.printed("frame_time", table, 1) for table in ("table 5", "table 6")]
    rows.append(
        ["Splatting takes much longer than the Z-buffer", f"p = 1: the Z-buffer is {speed_text(one, 'splatting')}",
         f"the paper: {rounded(paper_one[0].over(paper_one[1]))} times as fast"]  # fmt: skip
    )

    views = run.distinct("view", part="claims")
    counts = Table(
        f"Pixels of all local images that are not empty, and bytes sent by fan-in, splatting, {size_text(frames)}",
        ["view", "p", *(f"{d}: {what}" for d in ("slab", "beam", "subcube") for what in ("pixels", "bytes"))],
        [
            [view, q]
            + [
                f"{v.value:.0f}" if metric == "count" else v
                for d in ("slab", "beam", "subcube")
                for metric in ("count", "image_bytes")
                for v in [run.value(metric, part="claims", view=view, workers=q, decomposition=d)]
            ]
            for view in views
            for q in shared
        ],
    )
    return Section(
        "Claims of the text",
        "What does the text claim, and what holds here?",
        "Each line is decided by a rule from the numbers in it, which stand in the tables of this page: the same N, p and C; ties are not "
        "decided. Images of slabs, beams and subcubes are those of plans of equal volume, class-I sphere, without empty pixels.",
        ". ".join(f"“{claim}”: {here}" for claim, here, _ in rows) + ".",
        [Table("Claims", ["the paper", "here", "numbers"], rows), counts],
    )


# ---------------------------------------------------------------- validation

LONG = 5e-3  # s: shorter frames consist mostly of wake-ups between threads


def _validation(run: Run) -> Section:
    rows, series = [], {}
    errors: dict[tuple[int, bool], list[float]] = {}
    for p in sorted(run.distinct("workers", part="validation")):
        for renderer in run.distinct("renderer", part="validation", workers=p):
            points = []
            for n in sorted(run.distinct("n", part="validation", workers=p, renderer=renderer)):
                case = {"part": "validation", "workers": p, "renderer": renderer, "n": n}
                measured, simulated = (run.value("latency", origin=origin, **case) for origin in ("measured", "simulated"))
                error = simulated.over(measured)
                error = Value(error.value - 1, error.low - 1, error.high - 1, error.repeats, "1", "simulated", error.noise).percent()
                rows.append([renderer, n, p, measured, simulated, error])
                points.append((measured.value * 1e3, error))
                errors.setdefault((p, measured.value >= LONG), []).append(abs(error.value))
            series[f"{renderer}, p = {p}"] = points
    if not rows:
        return Section("How far to trust the simulation", "Does the simulation say what the service does?", "", "This run has no frames of the service.")
    sentences = [
        f"Frames of {'at least' if long else 'less than'} {LONG * 1e3:.0f} ms, p = {p}: off by {statistics.median(found):.0f} % in the median, "
        f"by {max(found):.0f} % at most ({len(found)} frames)"
        for (p, long), found in sorted(errors.items(), key=lambda item: (item[0][0], not item[0][1]))
    ]
    long_errors = [e for (_, long), found in errors.items() if long for e in found]
    if not long_errors:
        verdict = f"No frame took {LONG * 1e3:.0f} ms: this run does not tell how far times of long frames are off"
    elif statistics.median(long_errors) > 100 * GOOD:
        verdict = f"Long frames are off by more than {100 * GOOD:.0f} % in the median: take simulated times of this run only as an order of magnitude"
    else:
        verdict = f"Long frames agree within {100 * GOOD:.0f} % in the median"
    return Section(
        "How far to trust the simulation",
        "Where this machine can run the workers, does the simulation say what the service does?",
        "The same frames by the service inside this process, workers of one thread each, as many as this machine has cores, at most two, one "
        "frame in flight; and, turn by turn between them, simulated from the costs of their slabs on a model of this machine whose "
        "constants are measured by themselves. Medians over turns on both sides. No time of the service enters the simulation, which leaves "
        "out lost messages and hiding by groups in front.",
        ". ".join([*sentences, verdict]) + ".",
        [
            plots.lines(
                "validation",
                "Simulated frames against measured ones",
                series,
                "measured frame (ms)",
                "simulated over measured, less 1",
                "Each marker is a frame of one N.",
                log_x=True,
            ),
            Table("Simulated and measured frames", ["pipeline", "N", "p", "measured", "simulated", "error"], rows),
        ],
    )
