"""Groups of slabs: what streaming costs and what it saves."""
from __future__ import annotations

from functools import partial
from typing import Callable

from .. import plots
from ..page import Figure, Page, Section, Table
from ..ranking import decide
from ..results import Run
from ..value import Value, speed_text


def page(run: Run) -> Page:
    return Page(
        "Streaming: groups of slabs",
        "A volume is divided into groups of slabs that pass through the workers one after the other: the next group renders while the last "
        "one is combined. More groups need less memory and show a first preview sooner. What do they cost?",
        [_section(run, volume) for volume in run.distinct("volume", metric="period")],
    )


def _section(run: Run, volume: str) -> Section:
    rows = run.select(volume=volume, origin="simulated")
    workers = sorted(run.distinct("workers", volume=volume, metric="period"))
    groups = sorted(run.distinct("groups", volume=volume, metric="period"))
    shared = [p for p in workers if p > 1]
    pixels = run.distinct("pixels", volume=volume)[0]

    def get(metric: str, p: int, g: int, origin: str = "simulated") -> Value:
        return run.value(metric, volume=volume, workers=p, groups=g, origin=origin, link="host" if p == 0 else "10gbit")

    def efficiency(p: int, g: int) -> Value:
        return get("period", 1, 1).over(get("period", p, g)).times(1 / p).percent()

    def over_groups(plot: str, title: str, values: dict[str, Callable[[int, int], Value]], y: str, caption: str) -> Figure:
        """A line for each number of workers and each of these values of p and groups, by what follows p in its name."""
        series = {f"p = {p}{what}": [(g, of(p, g)) for g in groups] for p in shared for what, of in values.items()}
        return plots.lines(f"{plot}-{name}", title, series, "groups", y, caption, **plots.FROM_ZERO)

    table = Table(
        f"{volume}: groups",
        ["p", "groups", "latency", "first preview", "period", "efficiency", "voxels of a worker", "latency, service"],
        [
            [
                p,
                g,
                get("latency", p, g),
                get("preview", p, g),
                get("period", p, g),
                efficiency(p, g),
                get("memory", p, g, "measured"),
                run.find("latency", volume=volume, workers=p, groups=g, origin="measured"),
            ]
            for p in shared
            for g in groups
        ],
    )
    p, few, many = shared[-1], groups[0], groups[-1]
    gains = {metric: get(metric, p, few).over(get(metric, p, many)) for metric in ("preview", "latency", "period")}
    outcomes, of = decide(gains), f"that with {few} group{'' if few == 1 else 's'}"
    preview, latency, period = (speed_text(gain, outcomes[metric], of) for metric, gain in gains.items())
    answer = (
        f"At p = {p}, with {many} groups instead of {few}, a worker must hold {get('memory', p, many, 'measured').text()} of voxels instead "
        f"of {get('memory', p, few, 'measured').text()}. The first preview is {preview}; a frame alone is {latency}; a frame of many is "
        f"{period}."
    )
    name = volume.replace(".", "-")
    return Section(
        volume,
        "How many groups?",
        f"Equal slabs, {pixels} x {pixels} pixels, combined by the tree. Every slab is rendered alone on one thread. Frames are simulated on "
        "a switched network of 10 Gbit/s with all that a service does around a frame. Efficiency compares the period with that of one worker "
        "and one group. A worker must hold the slabs of two groups and their halos. The last column is the service on this machine.",
        answer,
        [
            over_groups(
                "efficiency", "Efficiency, frames requested ahead", {"": efficiency}, "efficiency",
                "Halos are rendered again in every group, and every group has its own combining.",
            ),
            over_groups(
                "memory", "Voxels that a worker must hold", {"": lambda p, g: get("memory", p, g, "measured")}, "memory",
                "Counted from the boxes: two groups with their halos.",
            ),
            over_groups(
                "preview", "Time to the first preview", {", preview": partial(get, "preview"), ", whole frame": partial(get, "latency")}, "time",
                "The nearest group alone, and all of the frame.",
            ),
            table,
            plots.timeline(
                f"timeline-{name}",
                "Three frames",
                run.attached(f"timeline-{volume}"),
                "Group g + 1 renders while group g is combined, across frames too.",
            ),
        ],
    )
