"""Figures of a page. Solid lines with filled markers are measured, dashed ones with open markers simulated, dotted ones from the paper."""
from __future__ import annotations

import io
import re
from typing import Iterable, Mapping, Sequence

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot  # noqa: E402
import matplotlib.ticker  # noqa: E402
import pandas  # noqa: E402

from .page import Figure  # noqa: E402
from .results import value_of  # noqa: E402
from .value import Value, number_text, scale_of  # noqa: E402

# Okabe and Ito, 2008: told apart by colour-blind readers.
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6bb1", "#7f7f7f", "#b3a200"]
MARKERS = "osD^v<>pP*"
LINES = {"measured": "-", "simulated": "--", "paper": ":"}

# What `lines` says of both axes together.
FROM_ZERO = {"from_zero": True, "marks": True}
LOG_X_FROM_ZERO = {"log_x": True, "from_zero": True, "marks": True}
LOG_LOG = {"log_x": True, "log_y": True, "marks": True}

Series = Mapping[str, Iterable[tuple[float, Value]]]


def figure_of(name: str, caption: str, figure: matplotlib.figure.Figure) -> Figure:
    """The SVG of a matplotlib figure, without what changes from run to run."""
    text = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    matplotlib.pyplot.close(figure)
    svg = text.getvalue()
    svg = re.sub(r"<!--.*?-->\s*", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    # Several figures on one page must not share ids.
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'(xlink:href="|href="|url\()#', rf"\1#{name}-", svg)
    return Figure(name, svg, caption)


def axes(title: str, x: str, y: str, size: tuple[float, float] = (7.2, 4.2)):
    figure, plot = matplotlib.pyplot.subplots(figsize=size)
    plot.set_title(title, fontsize=11)
    plot.set_xlabel(x)
    plot.set_ylabel(y)
    plot.grid(True, color="#e5e5e5", linewidth=0.8)
    plot.set_axisbelow(True)
    for side in ("top", "right"):
        plot.spines[side].set_visible(False)
    return figure, plot


def lines(
    name: str,
    title: str,
    series: Series,
    x: str,
    y: str,
    caption: str = "",
    log_x: bool = False,
    log_y: bool = False,
    from_zero: bool = False,
    marks: bool = False,
    markers: bool = True,
) -> Figure:
    """A line for each name, with whiskers. All y are of one unit. `marks`: a tick at every x. `markers`: False for many points."""
    data = {label: list(points) for label, points in series.items()}
    sizes = [abs(v.value) for points in data.values() for _, v in points]
    units = [v.unit for points in data.values() for _, v in points]
    factor, unit = scale_of(units[0], sorted(sizes)[len(sizes) // 2]) if sizes else (1, "")
    figure, plot = axes(title, x, f"{y} ({unit})" if unit else y)
    for i, (label, points) in enumerate(data.items()):
        points = sorted(points, key=lambda point: point[0])
        if not points:
            continue
        xs = [point[0] for point in points]
        ys = [v.value / factor for _, v in points]
        origin = points[-1][1].origin
        plot.errorbar(
            xs,
            ys,
            yerr=[[max(y_ - v.low / factor, 0) for y_, (_, v) in zip(ys, points)], [max(v.high / factor - y_, 0) for y_, (_, v) in zip(ys, points)]],
            label=label,
            color=COLOURS[i % len(COLOURS)],
            linestyle=LINES[origin],
            marker=MARKERS[i % len(MARKERS)] if markers else "",
            markersize=5,
            markerfacecolor="white" if origin == "simulated" else None,
            linewidth=1.6,
            elinewidth=0.9,
            capsize=2,
        )
    if log_x:
        plot.set_xscale("log", base=2 if marks else 10)
    if log_y:
        plot.set_yscale("log")
        if sizes and min(sizes) > 0 and max(sizes) < 10 * min(sizes):  # a decade has one named tick, or none
            plot.yaxis.set_minor_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    if from_zero:
        plot.set_ylim(bottom=0)
    # One repeat that was disturbed may reach many times as far as all values: then the values keep the plot.
    largest, reach = max(sizes, default=0), max((abs(v.high) for points in data.values() for _, v in points), default=0)
    if reach > 2 * largest > 0:
        plot.set_ylim(top=1.5 * largest / factor)
        longest = f"{number_text(reach / factor, 2)} {unit}".strip()
        caption = f"{caption} Whiskers end at the edge; the longest reaches {longest}.".strip()
    if marks:
        plot.set_xticks(sorted({point[0] for points in data.values() for point in points}))
        plot.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
        plot.xaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    _legend(plot, len(data))
    return figure_of(name, caption, figure)


def bars(name: str, title: str, groups: Mapping[str, Mapping[str, Value]], y: str, caption: str = "", log_y: bool = False) -> Figure:
    """Bars side by side: groups[group][bar]."""
    names = list(dict.fromkeys(bar for group in groups.values() for bar in group))
    values = [v for group in groups.values() for v in group.values()]
    factor, unit = scale_of(values[0].unit, sorted(abs(v.value) for v in values)[len(values) // 2])
    figure, plot = axes(title, "", f"{y} ({unit})" if unit else y)
    width = 0.8 / len(names)
    for i, bar in enumerate(names):
        present = [(j, group[bar]) for j, group in enumerate(groups.values()) if bar in group]
        plot.bar(
            [j + (i - (len(names) - 1) / 2) * width for j, _ in present],
            [v.value / factor for _, v in present],
            width,
            yerr=[[max(v.value - v.low, 0) / factor for _, v in present], [max(v.high - v.value, 0) / factor for _, v in present]],
            label=bar,
            color=COLOURS[i % len(COLOURS)],
            alpha=0.65 if present and present[0][1].origin == "simulated" else 1,
            error_kw={"elinewidth": 0.9},
        )
    plot.set_xticks(range(len(groups)))
    plot.set_xticklabels(list(groups), rotation=0 if len(groups) < 8 else 40, ha="center" if len(groups) < 8 else "right")
    if log_y:
        plot.set_yscale("log")
    _legend(plot, len(names))
    return figure_of(name, caption, figure)


def stacked(name: str, title: str, bars_: Mapping[str, Mapping[str, float]], y: str, caption: str = "") -> Figure:
    """One bar a name, divided into parts: bars_[bar][part]."""
    figure, plot = axes(title, "", y)
    parts = list(dict.fromkeys(part for bar in bars_.values() for part in bar))
    bottom = [0.0] * len(bars_)
    for i, part in enumerate(parts):
        heights = [bar.get(part, 0) for bar in bars_.values()]
        plot.bar(range(len(bars_)), heights, 0.7, bottom, label=part, color=COLOURS[i % len(COLOURS)])
        bottom = [b + h for b, h in zip(bottom, heights)]
    plot.set_xticks(range(len(bars_)))
    plot.set_xticklabels(list(bars_), rotation=0 if len(bars_) < 10 else 40, ha="center" if len(bars_) < 10 else "right")
    _legend(plot, len(parts))
    return figure_of(name, caption, figure)


def timeline(name: str, title: str, spans: pandas.DataFrame, caption: str = "", workers: int = 8) -> Figure:
    """What each worker does when, from a table of spans (docs/reference/results.md). The first `workers` of them; the title says so."""
    if (most := spans["worker"].max()) > workers:
        title += f": workers 1 to {workers} of {most}"
    spans = spans[spans["worker"] <= workers]
    kinds = ["render", "combine", "encode", "resolve", "transfer"]
    lanes = [
        (worker, lane)
        for worker in sorted(spans["worker"].unique())
        for lane in ["renders", "combines", "makes pictures", "receives"]
        if lane == "renders" or not spans[(spans["worker"] == worker) & (spans["lane"] == lane)].empty
    ]
    figure, plot = axes(title, "time (ms)", "", (7.2, 0.9 + 0.24 * len(lanes)))
    for kind, colour in zip(kinds, COLOURS):
        of_kind = spans[spans["stage"] == kind] if kind != "render" else spans[~spans["stage"].isin(kinds[1:])]
        labelled = False
        for place, (worker, lane) in enumerate(lanes):
            rows = of_kind[(of_kind["worker"] == worker) & (of_kind["lane"] == lane)]
            if rows.empty:
                continue
            pieces = [(b * 1e3, (e - b) * 1e3) for b, e in zip(rows["begin"], rows["end"])]
            plot.broken_barh(pieces, (place - 0.38, 0.76), color=colour, linewidth=0, label=None if labelled else kind)
            labelled = True
    plot.set_yticks(range(len(lanes)))
    plot.set_yticklabels([f"worker {worker} {lane}" for worker, lane in lanes], fontsize=8)
    plot.invert_yaxis()
    _legend(plot, len(kinds))
    return figure_of(name, caption, figure)


def cuts(name: str, title: str, boxes: pandas.DataFrame, caption: str = "") -> Figure:
    """The render time of boxes on three cuts through the middle of the volume, from a table of boxes (docs/reference/results.md)."""
    figure, plots = matplotlib.pyplot.subplots(1, 3, figsize=(8.4, 3.2), layout="constrained")
    figure.suptitle(title, fontsize=11)
    most = boxes["seconds"].max() * 1e3
    colours = matplotlib.colormaps["viridis"]
    for plot, (across, right, up) in zip(plots, (("x", "y", "z"), ("y", "x", "z"), ("z", "x", "y"))):
        middle = boxes[f"n{across}"].iloc[0] // 2
        for _, box in boxes[(boxes[f"{across}0"] <= middle) & (boxes[f"{across}1"] > middle)].iterrows():
            corner = (box[f"{right}0"], box[f"{up}0"])
            size = (box[f"{right}1"] - corner[0], box[f"{up}1"] - corner[1])
            colour = colours(box["seconds"] * 1e3 / most if most > 0 else 0)
            plot.add_patch(matplotlib.patches.Rectangle(corner, *size, facecolor=colour, edgecolor="white", linewidth=0.6))
        plot.set_xlim(0, boxes[f"n{right}"].iloc[0])
        plot.set_ylim(0, boxes[f"n{up}"].iloc[0])
        plot.set_aspect("equal")
        plot.set_xlabel(right)
        plot.set_ylabel(up)
        plot.set_title(f"cut at the middle {across}", fontsize=9)
    scale = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(0, most), colours)
    figure.colorbar(scale, ax=plots, label="render time of a box (ms)", shrink=0.8)
    return figure_of(name, caption, figure)


def points_of(rows: pandas.DataFrame, x: str) -> list[tuple[float, Value]]:
    """(x, value) of rows of one metric."""
    return [(row[x], value_of(row)) for _, row in rows.iterrows()]


def _legend(plot, entries: int) -> None:
    if entries > 1:
        plot.legend(fontsize=8.5, frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1))
