"""What `experiment paper` finds beyond the tables: streaming and balance, claims of the text, and how far to trust the simulation."""
from __future__ import annotations

import statistics
from typing import Any

from .. import plots
from ..page import Section, Table
from ..ranking import Ranking, decide, rankings
from ..results import Run, value_of
from ..value import Value, speed_text
from .paper_frames import TITLES, Frames, rounded, size_text


def sections(run: Run) -> list[Section]:
    frames = Frames(run)
    return [_beyond(run, frames), _claims(run, frames), _validation(run)]


# ---------------------------------------------------------------- streaming and balance

LINKS = ("paper", "10gbit")


class _Beyond:
    def __init__(self, run: Run):
        self.rows = run.narrowed(part="beyond")

    def find(self, metric: str, renderer: str, link: str, p: int, variant: str = "without empty pixels") -> Value:
        """Of the paper's slabs, shared by all workers."""
        slabs = {"decomposition": "slab", "balance_by": "voxels", "combine": "fan-in", "teams": 1}
        return self.rows.value(metric, renderer=renderer, link=link, workers=p, variant=variant, **slabs)

    def best(self) -> dict[tuple[str, str, int, int], Ranking]:
        """All policies by their period, of each renderer, link, number of workers and number of teams."""
        cases: dict[tuple[str, str, int, int], dict[str, Value]] = {}
        for _, row in self.rows.select(metric="period", variant="without empty pixels").iterrows():
            if row["workers"] > 1:
                case = (row["renderer"], row["link"], int(row["workers"]), int(row["teams"]))
                cases.setdefault(case, {})[_policy_text(row)] = value_of(row)
        return rankings(cases)

    def efficiency(self, metric: str, renderer: str, link: str, p: int, value: Value) -> Value:
        return self.find(metric, renderer, link, 1).over(value).times(1 / p).percent()


def _policy_text(row) -> str:
    along = " along the view" if row["axis"] == "view" else ""
    dynamic = ", dynamic" if row["balance"] == "dynamic" else ""
    return f"{row['decomposition']} by {row['balance_by']}{along}{dynamic}, {row['combine']}"


def _short(found: Ranking) -> str:
    if not found.decided:
        return f"{found.best[0]} (not ranked)"
    return found.best[0] + (f" (ties with {len(found.best) - 1})" if len(found.best) > 1 else "")


def _beyond(run: Run, frames: Frames) -> Section:
    beyond = _Beyond(run)
    workers = [p for p in sorted(run.distinct("workers", part="beyond")) if p > 1]
    rows, teams_rows, answers, blocks = [], [], [], []
    p_last = workers[-1]
    ranked = beyond.best()
    for renderer, table in (("splat", "table 5"), ("zbuffer", "table 6")):
        curves: dict[str, list[tuple[float, Value]]] = {}
        for link in LINKS:
            for p in workers:
                whole = link == "paper"
                kinds = {"without empty pixels": "", **({"whole images": ", whole images"} if whole else {})}
                values = {}
                for variant, suffix in kinds.items():
                    for kind, metric in (("one at a time", "latency"), ("asked ahead", "period")):
                        found = beyond.find(metric, renderer, link, p, variant)
                        values[kind + suffix] = beyond.efficiency(metric, renderer, link, p, found)
                best = ranked[renderer, link, p, 1]
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
                    by_team = ranked[renderer, link, p, teams]
                    value = by_team.values[by_team.best[0]]
                    efficiency = beyond.efficiency("period", renderer, link, p, value)
                    teams_rows.append([renderer, link, p // teams, teams, value, efficiency, _short(by_team)])
                if whole:
                    paper_p = max(frames.printed_workers)
                    times = [frames.printed("frame_time", table, q) for q in (1, paper_p)]
                    answers.append(
                        f"{TITLES[renderer]}: one frame at a time in the paper's slabs {values['one at a time, whole images'].text()} by "
                        f"latency with whole images (the paper at p = {paper_p}: "
                        f"{rounded(times[0].over(times[1]).times(1 / paper_p).percent())}); frames asked ahead, by throughput, "
                        f"{values['asked ahead, whole images'].text()} with whole images, {values['asked ahead'].text()} without empty "
                        f"pixels, and {values['asked ahead, best partition'].text()} with {_short(best)}"
                    )
        blocks.append(
            plots.lines(
                f"beyond-{renderer}",
                f"{TITLES[renderer]}: efficiency on the paper's machine",
                curves,
                "workers p",
                "efficiency",
                "One at a time: by latency. Asked ahead: by throughput. Each against one worker by the same measure.",
                **plots.FROM_ZERO,
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
        title, spans, boxes = f"p = {workers[0]}: {name}", run.attached(f"timeline-{name}"), run.attached(f"boxes-{name}")
        blocks.append(plots.timeline(f"timeline-{name}", f"Four frames, {title}", spans, "10 Gbit/s, frames asked for ahead."))
        blocks.append(plots.cuts(f"boxes-{name}", f"Render time by box, {title}", boxes, "Every box rendered alone."))
    return Section(
        "Beyond the paper: streaming and balance",
        "The paper proposes data streaming, other primitives and load balancing. What do they give?",
        "The spheres of the tables, as many frames asked for ahead as keep all workers busy: they render the next frames while the last "
        "ones are combined. Partitions: the paper's slabs; slabs and kd-trees of equal work, along a fixed axis or the view's; one with "
        "dynamic balance; each combined by fan-in and radix-k, ranked by the period. Efficiency by latency compares times of one frame, "
        "by throughput times from picture to picture, each with one worker. The paper's machine has no costs around a frame and one "
        "processor a worker; 10gbit is a switched network with all that a service does around a frame, two cores a worker.",
        f"Efficiency at {size_text(frames)}, p = {p_last}, on the paper's machine. "
        + ". ".join(text[0].upper() + text[1:] for text in answers)
        + ".",
        blocks,
    )


# ---------------------------------------------------------------- claims


def _projection(view: str) -> str:
    return "perspective" if "fov" in view else "orthographic"


ASSUMED = "assumed, not found: rounds of combining are an input (The paper's machine)"


def _measured_speed_up(run: Run, renderer: str, n: int) -> Value | None:
    """Of two workers of the service against one, if the run has such frames."""
    one, two = (run.find("latency", part="validation", origin="measured", renderer=renderer, n=n, workers=p) for p in (1, 2))
    return one.over(two) if one and two else None


def _claims(run: Run, frames: Frames) -> Section:
    n, least, shared = frames.table_n, frames.sizes[0], [p for p in frames.workers if p > 1]
    p = shared[-1]
    rows = []

    gains: dict[Any, Value] = {}
    beyond = _Beyond(run)
    if service := _measured_speed_up(run, "zbuffer", least):
        gains["small"] = service
    for renderer in ("splat", "zbuffer"):
        latency, period = (beyond.find(metric, renderer, "paper", p, "whole images") for metric in ("latency", "period"))
        gains["streaming", renderer] = latency.over(period)
    gains["pipelines"] = frames.time("splat", n, 1).over(frames.time("zbuffer", n, 1))
    outcomes = decide(gains)

    here = "not tested: this run has no frames of the service"
    if service:
        verdicts = {"slower": "below 1", "faster": "above 1", "tie": "1, a tie", "open": "not ranked"}
        here = f"N = {least}, p = 2, measured by the service here: {verdicts[outcomes['small']]}"
    modelled = ", ".join(f"{frames.speed_up('zbuffer', least, q).text()} (p = {q})" for q in shared)
    numbers = f"on the paper's machine, which has neither latency nor wake-ups and so cannot decide it: {modelled}"
    rows.append(["Z-buffer, N = 50: the speed-up is below 1", here, (f"{service.text()} (p = 2); " if service else "") + numbers])

    ratios = {q: frames.time("splat", n, q, combine="centralized").over(frames.time("splat", n, q)) for q in shared}
    listed = ", ".join(f"{v.text()} (p = {q})" for q, v in ratios.items())
    rows.append(["Hierarchical combining beats centralised even for a modest number of processors", ASSUMED, listed])

    part = frames.find("combine_time", "zbuffer", n, p).over(frames.time("zbuffer", n, p)).percent()
    paper = frames.printed("combine_time", "table 6", 30).over(frames.printed("frame_time", "table 6", 30)).percent()
    numbers = f"{part.text()} of the frame at p = {p} (the paper, p = 30: {rounded(paper)})"
    rows.append(["Combining dominates the Z-buffer with many processors", ASSUMED, numbers])

    pictures = {}
    for view in run.distinct("view", part="claims"):
        values = {}
        for metric in ("count", "image_bytes"):
            slab, cube = (run.value(metric, part="claims", view=view, workers=p, decomposition=d) for d in ("slab", "subcube"))
            values[metric] = cube.value / slab.value
        pictures[_projection(view)] = values
    for name, values in pictures.items():
        ratio = values["count"]
        verdict = "smaller" if ratio < 1 else "larger" if ratio > 1 else "as large"
        rows.append(
            [f"Subcubes make smaller images than slabs ({name})", f"p = {p}: {verdict}",
             f"pixels {ratio:.2f} times those of slabs, bytes sent by fan-in {values['image_bytes']:.2f} times"]  # fmt: skip
        )
    for view in run.distinct("view", part="claims"):
        one = run.value("count", part="claims", view=view, workers=1)
        slab, beam, cube = (
            run.value("count", part="claims", view=view, workers=p, decomposition=d).value / one.value for d in ("slab", "beam", "subcube")
        )
        name = _projection(view)
        verdict = "less" if cube < slab else "more" if cube > slab else "as much"
        rows.append(
            [f"Images of subcubes overlap less than those of slabs ({name})", f"p = {p}: {verdict}",
             f"pixels of all images over those of one: slabs {slab:.2f}, beams {beam:.2f}, subcubes {cube:.2f}"]  # fmt: skip
        )
    if {"perspective", "orthographic"} <= set(pictures):
        inner, outer = (pictures[name]["count"] for name in ("perspective", "orthographic"))
        text = "as much, within 1 %," if abs(inner / outer - 1) < 0.01 else "more" if inner < outer else "less"
        numbers = f"{inner:.3f} against {outer:.3f} of the pixels of slabs"
        rows.append(["Slabs suit least under perspective", f"subcubes save {text} under perspective", numbers])

    for renderer in ("splat", "zbuffer"):
        latency, period = (beyond.find(metric, renderer, "paper", p, "whole images") for metric in ("latency", "period"))
        case = ("streaming", renderer)
        rows.append(
            [f"Data streaming overlaps rendering and combining ({TITLES[renderer]})",
             f"p = {p}, with rounds of combining that are assumed: frames that are asked ahead are "
             f"{speed_text(gains[case], outcomes[case], 'one at a time')}",
             f"{period.text()} from picture to picture, {latency.text()} alone"]  # fmt: skip
        )
    paper_one = [frames.printed("frame_time", table, 1) for table in ("table 5", "table 6")]
    rows.append(
        ["Splatting takes much longer than the Z-buffer",
         f"p = 1: the Z-buffer is {speed_text(gains['pipelines'], outcomes['pipelines'], 'splatting')}",
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
        "decided. What follows from the assumed rounds of combining is called so and decides nothing. Images "
        "of slabs, beams and subcubes are those of plans of equal volume, class-I sphere, without empty pixels.",
        ". ".join(f"“{claim}”: {here}" for claim, here, _ in rows) + ".",
        [Table("Claims", ["the paper", "here", "numbers"], rows), counts],
    )


# ---------------------------------------------------------------- validation

TRUST = "How far to trust the simulation"
GOOD = 0.10  # an error up to which a simulation agrees
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
        return Section(TRUST, "Does the simulation say what the service does?", "", "This run has no frames of the service.")
    sentences = [
        f"Frames of {'at least' if long else 'less than'} {LONG * 1e3:.0f} ms, p = {p}: off by {statistics.median(found):.0f} % in the "
        f"median, by {max(found):.0f} % at most ({len(found)} frames)"
        for (p, long), found in sorted(errors.items(), key=lambda item: (item[0][0], not item[0][1]))
    ]
    long_errors = [e for (_, long), found in errors.items() if long for e in found]
    if not long_errors:
        verdict = f"No frame took {LONG * 1e3:.0f} ms: this run does not tell how far times of long frames are off"
    elif statistics.median(long_errors) > 100 * GOOD:
        verdict = f"Long frames are off by more than {100 * GOOD:.0f} % in the median"
    else:
        verdict = f"Long frames agree within {100 * GOOD:.0f} % in the median"
    return Section(
        TRUST,
        "Where this machine can run the workers, does the simulation say what the service does?",
        "The same frames by the service inside this process, workers of one thread each, as many as this machine has cores, at most two, "
        "one frame in flight; and, turn by turn between them, simulated from the costs of their slabs on a model of this machine whose "
        "constants are measured by themselves. Medians over turns on both sides. No time of the service enters the simulation, which "
        "leaves out lost messages and hiding by groups in front.",
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
