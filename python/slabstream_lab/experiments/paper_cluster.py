"""The frames of tables 2, 5 and 6 by real processes (bench/cluster_paper), beside the model and the paper."""
from __future__ import annotations

import math

from .. import plots
from ..page import Section, Table
from ..results import Run
from ..value import Value
from .paper_frames import SPLAT, ZBUFFER, Cases, Frames, Pipeline, fit, over_workers, rounded, size_text

PART = "service frames"


def sections(run: Run) -> list[Section]:
    if run.select(part=PART).empty:
        return []
    frames, measured = Frames(run), Measured(run)
    return [_combining(frames, measured), *(_pipeline(frames, measured, pipeline) for pipeline in (SPLAT, ZBUFFER))]


class Measured(Cases):
    """Frames of real processes: what a client waits for, without making and encoding the picture, which the paper does not count."""

    def __init__(self, run: Run):
        super().__init__(run, PART, axis="view", combine="fan-in", stage=None)

    def time(self, renderer: str, n: int, p: int, **columns) -> Value:
        latency, picture = (self.value(metric, renderer, n, p, **columns) for metric in ("latency", "picture_time"))
        return latency.minus(picture)

    def rest(self, renderer: str, n: int, p: int, **columns) -> Value:
        """What a frame takes beyond its longest rendering: combining, planning, messages and the picture's way to the client."""
        return self.time(renderer, n, p, **columns).minus(self.value("longest_render_time", renderer, n, p, **columns))


HOW = (
    "A service with keys, one worker process of one thread on each host of a time-dilated cluster with 10 Gbit/s (docs/time-dilated-cluster.md), "
    "one frame in flight; times are multiplied by the share of a core that a host has. The frame is planned as the paper did it: class-I "
    "spheres of 5 %, slabs of N/p whole slices, one group. What the paper's program did not do stays: coordinator and client are hosts of their own, "
    "traffic is encrypted, images travel without their empty pixels, and the picture travels to the client. So compare growth, shares and "
    "speed-ups, not times. The time of making the picture is taken off."
)


def _combining(frames: Frames, measured: Measured) -> Section:
    n, shared = frames.table_n, [p for p in measured.workers if p > 1]
    rows, ratios = [], {}
    for p in shared:
        central, tree = (measured.time("splat", n, p, combine=combine) for combine in ("centralized", "fan-in"))
        ratios[p] = central.over(tree)
        row = [p, central, tree, ratios[p]]
        for variant in ("without empty pixels", "whole images"):
            modelled = [frames.find("frame_time", "splat", n, p, combine=c, variant=variant) for c in ("centralized", "fan-in")]
            row.append(modelled[0].over(modelled[1]) if all(modelled) else None)
        printed = [frames.printed("frame_time", "table 2", p, c) for c in ("centralized", "fan-in")]
        rows.append(row + [printed[0].over(printed[1]) if all(printed) else None])
    curves, fits = {}, []
    for renderer in ("splat", "zbuffer"):
        for name, combine in (("centralised", "centralized"), ("hierarchical", "fan-in")):
            points = [(p, measured.rest(renderer, n, p, combine=combine)) for p in shared]
            curves[f"{renderer}, {name}"] = points
            numbers = [(p, v.value) for p, v in points]
            log, linear = fit(numbers, math.log2), fit(numbers, lambda p: p)
            fits.append((renderer, name, log, linear))
    p = shared[-1]
    closer = {(renderer, name): "c log2 p" if log.residual < linear.residual else "c p" for renderer, name, log, linear in fits}
    found = "; ".join(f"{renderer}, {name}: {shape}" for (renderer, name), shape in closer.items())
    gain = f"At p = {p}, a frame with centralised combining takes {ratios[p].text()} times as long as one with hierarchical combining"
    return Section(
        "Real processes: table 2 and figure 9",
        "Combining measured, not assumed: what does the hierarchical scheme gain, and how does combining grow with p?",
        HOW + " Figure 9 shows what a frame takes beyond its longest rendering: combining, and planning, messages and the picture's way to the "
        "client, which the paper's program did not have. Fits as for figure 9 above.",
        f"{gain}. What a frame takes beyond its longest rendering is closer to ({found}).",
        [
            Table(
                f"Table 2 by real processes, splatting, {size_text(frames)}",
                ["p", "centralised", "hierarchical", "ratio", "model, without empty pixels", "model, whole images", "paper"],
                rows,
            ),
            plots.lines(
                "cluster-figure-9", "Figure 9 by real processes: a frame beyond its longest rendering", curves, "workers p", "time", **plots.FROM_ZERO
            ),
            Table(
                "Fits",
                ["pipeline", "combining", "residual of c log2 p (%)", "residual of c p (%)"],
                [[renderer, name, round(100 * log.residual), round(100 * linear.residual)] for renderer, name, log, linear in fits],
            ),
        ],
    )


def _pipeline(frames: Frames, measured: Measured, pipeline: Pipeline) -> Section:
    n, renderer, workers = frames.table_n, pipeline.renderer, measured.workers
    rows = []
    for p in workers:
        time, longest = measured.time(renderer, n, p), measured.value("longest_render_time", renderer, n, p)
        stages = {stage: measured.find("stage_time", renderer, n, p, stage=stage) for stage in pipeline.stages}
        shares = [stage.over(time).percent() if stage is not None else None for stage in stages.values()]
        printed_one, printed = (frames.printed("frame_time", pipeline.table, q) for q in (1, p))
        row = [p, time, longest, measured.rest(renderer, n, p).over(time).percent(), *shares, measured.value("period", renderer, n, p)]
        row += [measured.speed_up(renderer, n, p), frames.speed_up(renderer, n, p) if p in frames.workers else None]
        rows.append(row + [printed_one.over(printed) if printed_one and printed else None])
    shared = [p for p in workers if p > 1]
    curves: dict[str, dict[str, list]] = {
        what: {f"N = {size}": [(p, of(renderer, size, p)) for p in workers] for size in measured.sizes}
        for what, of in (("time", measured.time), ("speed-up", measured.speed_up), ("efficiency", measured.efficiency))
    }
    label = f"N = {n}, model"
    curves["speed-up"][label] = [(p, frames.speed_up(renderer, n, p)) for p in frames.workers]
    curves["efficiency"][label] = [(p, frames.efficiency(renderer, n, p)) for p in frames.workers]
    one = frames.printed("frame_time", pipeline.table, 1)
    paper = [(p, one.over(v)) for p in frames.printed_workers if one and (v := frames.printed("frame_time", pipeline.table, p))]
    curves["speed-up"]["paper, N = 200"] = paper
    curves["efficiency"]["paper, N = 200"] = [(p, v.times(1 / p).percent()) for p, v in paper]
    p = shared[-1]
    by_size = ", ".join(f"{measured.speed_up(renderer, size, p).text()} (N = {size})" for size in measured.sizes)
    of_paper = dict(paper).get(p)
    others = [f"the model: {frames.speed_up(renderer, n, p).text()}"] if p in frames.workers else []
    others += [f"the paper: {rounded(of_paper)}"] if of_paper else []
    share = measured.rest(renderer, n, p).over(measured.time(renderer, n, p)).percent()
    number = pipeline.figure
    return Section(
        f"Real processes: {pipeline.table} and figure {number}",
        "How much do real workers gain, and where does the time of a frame go?",
        HOW + " Shares are those of the worker that renders longest. “Beyond”: what a frame takes beyond its longest rendering.",
        f"At N = {n}, p = {p} the speed-up is {measured.speed_up(renderer, n, p).text()}"
        + (f" ({'; '.join(others)})" if others else "")
        + f"; {share.text()} of the frame are beyond its longest rendering. Speed-ups at p = {p}: {by_size}.",
        [
            Table(
                f"{pipeline.table.capitalize()} by real processes, {size_text(frames)}: a frame, and shares in per cent",
                ["p", "time", "longest rendering", "beyond", *pipeline.stages, "period", "speed-up", "model: speed-up", "paper: speed-up"],
                rows,
            ),
            *(
                over_workers(
                    f"cluster-figure-{number}{letter}",
                    f"Figure {number}{letter} by real processes: {what}",
                    curves[what],
                    what,
                    "Solid: measured; dashed: the model; dotted: the paper.",
                )
                for letter, what in zip("abc", curves)
            ),
        ],
    )
