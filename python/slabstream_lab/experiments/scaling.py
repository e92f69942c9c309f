"""Strong and weak scaling of both pipelines of the paper."""
from __future__ import annotations

import dataclasses
from typing import Collection

from .. import plots
from ..page import Figure, Page, Section, Table
from ..ranking import rankings
from ..results import Run
from ..value import Value

HALF = 50  # %


def page(run: Run) -> Page:
    return Page(
        "Strong and weak scaling",
        "How far more workers help: with one volume for all of them, and with as many voxels for each.",
        [_section(run, part, renderer) for part in ("strong", "weak") for renderer in run.distinct("renderer", part=part)]
        + ([_many_workers(run)] if run.distinct("workers", part=MANY) else []),
    )


def times(name: str, title: str, series: dict[str, list[tuple[int, Value]]]) -> Figure:
    return plots.lines(name, title, series, "workers", "time", "Both axes logarithmic.", **plots.LOG_LOG)


MANY = "many workers"
ONE, NO_TIME = "one coordinator", "a coordinator that takes no time"


def _many_workers(run: Run) -> Section:
    case = {"part": MANY}
    schemes, workers = run.distinct("combine", **case), sorted(run.distinct("workers", **case))

    def of(metric: str, variant: str, **where) -> Value:
        return run.value(metric, variant=variant, **case, **where)

    rows = []
    for scheme in schemes:
        for p in workers:
            where = {"combine": scheme, "workers": p}
            message, hand_out = of("assignment_bytes", ONE, **where), of("hand_out_time", ONE, **where)
            rows.append(
                [scheme, p]
                + [of(metric, ONE, **where) for metric in ("plan_time", "assignment_time", "hearing_time")]
                + [message, message.times(p), hand_out, of("latency", NO_TIME, **where), of("latency", ONE, **where)]
            )
    most = max(workers)
    shares = [
        f"{of('hand_out_time', ONE, **where).over(of('latency', ONE, **where)).percent().text()} with {scheme}"
        for scheme in schemes
        for where in [{"combine": scheme, "workers": most}]
    ]
    return Section(
        "One coordinator, many workers",
        "From how many workers on does the coordinator hold a frame up?",
        f"Sphere {run.only('volume', **case)}, splatting over a kd-tree, one group, one frame alone. Boxes are rendered alone, and frames are "
        f"simulated on a network ({run.only('link', **case)}). Planning, encoding and decoding are measured. The coordinator sends the same "
        "message to every worker, one after the other, over one wire: all boxes of the group and the addresses of all its workers. So its "
        "time for a frame grows with the square of the number of workers.",
        f"At p = {most} the coordinator's time is {' and '.join(shares)} of the latency of a frame.",
        [
            times(
                "many-workers-latency",
                "Latency of a frame alone",
                {
                    f"{scheme}, {variant}": [(p, of("latency", variant, combine=scheme, workers=p)) for p in workers]
                    for scheme in schemes
                    for variant in (ONE, NO_TIME)
                },
            ),
            Table(
                "One frame, many workers",
                ["scheme", "p", "plan", "encode", "decode, each worker", "message", "messages of a frame", "coordinator", "latency without it", "latency"],
                rows,
            ),
        ],
    )


@dataclasses.dataclass(frozen=True)
class Point:
    """A series at one number of workers."""

    workers: int
    n: int  # voxels along the side of its volume
    latency: Value
    period: Value
    imbalance: Value
    idle: Value


def _points(run: Run, **case) -> list[Point]:
    def at(p: int) -> Point:
        def get(metric: str) -> Value:
            return run.value(metric, workers=p, **case)

        n = run.only("n", workers=p, metric="period", **case)
        return Point(p, n, get("latency"), get("period"), get("imbalance"), get("idle_share").percent())

    return [at(p) for p in sorted(run.distinct("workers", metric="period", **case))]


def efficiency(one: Value, value: Value, workers: int, voxels: float) -> Value:
    """What a worker gets done in a time, over what one worker alone does: `voxels` times the volume, in `value` instead of `one`."""
    return Value.exact(100, "%", one.origin) if workers == 1 else one.over(value).times(voxels / workers).percent()


def _reach(points: list[tuple[int, Value]]) -> str:
    """Where an efficiency lies above and below a half, by its medians."""
    below = [p for p, value in points if value.value < HALF]
    if not below:
        return f"at least {HALF} % up to p = {points[-1][0]}"
    if below == [p for p, _ in points if p >= below[0]]:
        return f"below {HALF} % from p = {below[0]} on"
    return f"below {HALF} % at p = {', '.join(map(str, below))}, not at all greater p"


def _all_of(names: list[str], among: Collection[str]) -> str:
    return "every series" if len(names) == len(among) else " and ".join(f"({name})" for name in names)


def _section(run: Run, part: str, renderer: str) -> Section:
    weak = part == "weak"
    case = {"part": part, "renderer": renderer}
    series = {name: _points(run, variant=name, **case) for name in run.distinct("variant", **case)}

    def by(metric: str) -> dict[str, list[tuple[int, Value]]]:
        """Efficiency by latency or by period, against p = 1 of the same series."""
        found = {}
        for name, points in series.items():
            one = points[0]
            found[name] = [
                (x.workers, efficiency(getattr(one, metric), getattr(x, metric), x.workers, (x.n / one.n) ** 3)) for x in points
            ]
        return found

    by_latency, by_period = by("latency"), by("period")
    # Not all series go as far as others.
    common = max(set.intersection(*({x.workers for x in points} for points in series.values())))
    last = {label: next(x for x in points if x.workers == common) for label, points in series.items()}
    least = rankings({metric: {label: getattr(x, metric) for label, x in last.items()} for metric in ("period", "latency")})
    reaches: dict[str, list[str]] = {}
    for label, points in by_period.items():
        reaches.setdefault(_reach(points), []).append(label)
    name = f"{part}-{renderer}"
    volumes = run.distinct("volume", **case)
    pixels, link = run.only("pixels", **case), run.only("link", **case)
    return Section(
        f"{'Weak' if weak else 'Strong'} scaling: {renderer}",
        "Ever more voxels for ever more workers, as many for each: does a frame take as long?"
        if weak
        else "The same volume for ever more workers: how much faster?",
        f"{'Spheres from ' + volumes[0] + ' to ' + volumes[-1] if weak else 'Sphere ' + volumes[0]}, {pixels} x {pixels} pixels. Boxes are "
        f"rendered alone, each on one thread. Frames are simulated on a network ({link}) with all that a service does around a frame: "
        "latency of a frame that is alone, and the time from picture to picture with as many frames requested ahead as keep all workers "
        "busy, at most the 256 that one client may have open. Efficiency is what a worker gets done in that time, over what one worker alone gets done, of the same series, by the same time"
        + (
            "; as sides are whole numbers of voxels, a worker has not always as many, which efficiency takes into account."
            if weak
            else ". In series with teams, teams of workers take frames in turn, each with all voxels; else all workers share every frame."
        ),
        f"Efficiency from picture to picture, medians: {'; '.join(f'{reach}: {_all_of(of, series)}' for reach, of in reaches.items())}. "
        f"At p = {common}, the greatest that all series have, least time from picture to picture: "
        f"{least['period'].sentence()}; least latency: {least['latency'].sentence()}.",
        [
            times(
                f"{name}-period",
                "From picture to picture",
                {label: [(x.workers, x.period) for x in points] for label, points in series.items()},
            ),
            *(
                plots.lines(
                    f"{name}-efficiency-{metric}",
                    f"Efficiency by {title}",
                    efficiencies,
                    "workers",
                    "efficiency",
                    "Against one worker of the same series.",
                    **plots.LOG_X_FROM_ZERO,
                )
                for metric, title, efficiencies in (
                    ("period", "time from picture to picture", by_period),
                    ("latency", "latency", by_latency),
                )
            ),
            Table(
                f"{'Weak' if weak else 'Strong'} scaling, {renderer}",
                ["series", "p", "N", "latency", "efficiency, latency", "period", "efficiency, period", "imbalance", "idle"],
                [
                    [label, x.workers, x.n, x.latency, by_latency[label][i][1], x.period, by_period[label][i][1], x.imbalance, x.idle]
                    for label, points in series.items()
                    for i, x in enumerate(points)
                ],
            ),
        ],
    )
