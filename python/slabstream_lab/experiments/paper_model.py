"""The models of `experiment paper`: the paper's machine, and the constants of both pipelines."""
from __future__ import annotations

import math
from typing import Callable, Mapping

from .. import plots
from ..page import Section, Table
from ..results import Run, value_of
from ..value import Value, number_text
from .paper_frames import TITLES, Frames, rounded, size_text

GOOD = 0.10  # an error up to which a model gives a number back
Units = Callable[[int, int, float], float]  # of N, p and I²
OCCUPANCY, FILTER = 0.05, 5  # C of our spheres; k of the paper's filter


def sections(run: Run) -> list[Section]:
    frames = Frames(run)
    return [_machine(run), _constants(run, frames), _equations(run, frames)]


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
        "T(p) = T(1)/p + u rounds(p), with ceil(log2 p) rounds of hierarchical and p - 1 of centralised combining. T(1) is printed: "
        "72.89 s (splatting) and 8.46 s (Z-buffer). One u a renderer, 0.20 s and 0.13 s, is fitted by hand: the time to write, read and "
        "composite an image, which rounds do not wait for (Eq. 18, not Eq. 19). Simulations below use this machine: a round takes the "
        "same share of a frame on one processor, for a whole image; an image with fewer pixels takes less.",
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
            if stage == "combine":
                here = run.find("constant", part="combining-pixel", renderer=renderer)
            bound = run.find("constant", part="printed", variant=printed_table, stage=symbol.replace("_", ""))
            gain = from_times.over(here) if from_times and here else None
            rows.append([symbol, equation, unit, here, largest, from_times, bound, gain, *_own_unit(frames, renderer, stage)])
            if gain:
                found.append(f"{symbol} of {TITLES[renderer]} {number_text(gain.value, 3)}")
            if bound and from_times:
                bounds.append((bound.value / from_times.value, f"{symbol} of {TITLES[renderer]}"))
        number = printed_table.split()[1]
        blocks.append(
            Table(
                f"Table {number}. Constants of {TITLES[renderer]} in the paper's units",
                [
                    "constant",
                    "Eq.",
                    "a unit is a",
                    "here, p = 1",
                    "here, largest of all N, p",
                    "paper: from its times",
                    "paper: printed bound",
                    "its times / here",
                    "our unit is a",
                    "here, p = 1, our unit",
                ],
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
        "Tables 3 and 4: a stage's time of the worker that renders longest, over the units that the paper's equation gives it: C = 5 %, "
        "k = 5, I² the pixels of a whole image (the paper: I = N, at p = 1, and p = 30 for combining). Our pipeline skips empty space "
        "and filters separably, so a unit is not the same work. c_co here is measured: to find a pixel of an image, copy it and composite "
        "it, or compare its depth. c_t of the Z-buffer is part of c_z here. Below them our own units: a model fitted to every slab of every N and p (least "
        "squares of relative residuals, none below 0, 95 % intervals); the last column is the mean error for slabs that the fit has not "
        "seen, over their mean time.",
        answer,
        blocks,
    )


def _equations(run: Run, frames: Frames) -> Section:
    n, tables, texts = frames.table_n, [], []
    for renderer, equation, bounds, times in (("splat", "20 and 21", "table 3", "table 5"), ("zbuffer", "25", "table 4", "table 6")):
        terms = [(symbol, stage, units) for symbol, _, _, stage, units in _terms(renderer) if stage != "combine"]
        found = [(_constant(frames, renderer, stage, units, n, 1), units) for _, stage, units in terms]
        errors = {}
        for size in frames.sizes:
            for p in frames.workers:
                pixels = size**3 / p / frames.grain(renderer, size, p)
                expected = sum(constant.value * units(size, p, pixels) for constant, units in found if constant)
                combining = frames.find("combine_time", renderer, size, p)
                slab = frames.time(renderer, size, p).value - (combining.value if combining else 0)
                errors[size, p] = expected / slab - 1
        title = f"Eq. {equation}, {TITLES[renderer]}: error in % of the slowest slab's time, from the constants of N = {n}, p = 1"
        rows = [[size, *(f"{100 * errors[size, p]:+.0f}" for p in frames.workers)] for size in frames.sizes]
        tables.append(Table(title, ["N", *(f"p = {p}" for p in frames.workers)], rows))
        text = f"{TITLES[renderer][0].upper()}{TITLES[renderer][1:]} (Eq. {equation}): errors up to "
        text += _worst_text({case: error for case, error in errors.items() if case[0] == n})
        if other := {case: error for case, error in errors.items() if case[0] != n}:
            text += f", and with other N up to {_worst_text(other)}"
        texts.append(text + ".")
        printed = [(run.find("constant", part="printed", variant=bounds, stage=symbol.replace("_", "")), units) for symbol, _, units in terms]
        seconds = sum(constant.value * units(200, 1, 200**2) for constant, units in printed if constant)
        whole = frames.printed("frame_time", times, 1)
        if whole:
            texts.append(
                f"With the constants of {bounds} it gives {number_text(seconds, 3)} s for N = 200, p = 1, "
                f"{number_text(seconds / whole.value, 2)} times the printed {rounded(whole)}."
            )
    return Section(
        "Frames from the constants: equations 20, 21 and 25",
        "Do constants of one frame predict the frames of other sizes and numbers of workers, as the equations say?",
        "The sum of all terms but the last, with C = 5 %, k = 5 and the constants found here at the tables' N and p = 1, against the "
        "slowest slab: the frame less its combining. Combining is that of the paper's machine, whose round is fitted, so the last term "
        "would confirm itself. Eq. 21 is Eq. 20 with m for N³/p, so it gives the same numbers. Below 0: the equation promises too little.",
        " ".join(texts),
        tables,
    )


def _worst_text(errors: Mapping[tuple[int, int], float]) -> str:
    n, p = max(errors, key=lambda case: abs(errors[case]))
    return f"{100 * abs(errors[n, p]):.0f} % (N = {n}, p = {p})"


def _terms(renderer: str) -> list[tuple[str, str, str, str, Units]]:
    """Symbol, equation, unit, stage, and the number of units of N, p and I²."""
    occupied = lambda n, p, pixels: OCCUPANCY * n**3 / p  # noqa: E731
    combine = ("pixel and round", "combine", lambda n, p, pixels: pixels * math.ceil(math.log2(p)))
    transform = ("c_t", "12", "voxel", "transform", lambda n, p, pixels: n**3 / p)
    if renderer == "splat":
        return [
            transform,
            ("c_sh", "13", "occupied voxel", "shade", occupied),
            ("c_sp", "14", "occupied voxel and entry of the filter", "splat", lambda n, p, pixels: occupied(n, p, pixels) * FILTER**2),
            ("c_cp", "17", "pixel and slice", "composite", lambda n, p, pixels: n * pixels / p),
            ("c_co", "18", *combine),
        ]
    return [
        transform,
        ("c_z", "22", "occupied voxel", "z_buffer", occupied),
        ("c_sh", "23", "share C of the pixels", "shade", lambda n, p, pixels: OCCUPANCY * pixels),
        ("c_co", "24", *combine),
    ]


def _constant(frames: Frames, renderer: str, stage: str, units: Units, n: int, p: int) -> Value | None:
    if stage == "combine":
        return None
    value = frames.find("stage_time", renderer, n, p, stage=stage)
    if value is None:
        return None
    pixels = n**3 / p / frames.grain(renderer, n, p)
    return value.times(1 / units(n, p, pixels))


def _own_unit(frames: Frames, renderer: str, stage: str) -> tuple[str, Value | None]:
    """What the stage works on here, and its time a unit, of a frame on one worker."""
    units = {("splat", "shade"): "drawn voxel", ("splat", "splat"): "drawn voxel", ("zbuffer", "z_buffer"): "drawn voxel"}
    unit = {**units, ("zbuffer", "shade"): "covered pixel"}.get((renderer, stage), "")
    time = frames.find("stage_time", renderer, frames.table_n, 1, stage=stage)
    count = frames.find("count", renderer, frames.table_n, 1, variant=f"{unit}s of the worker that renders longest") if unit else None
    return unit, time.times(1 / count.value) if time and count and count.value > 0 else None


def _fit_table(run: Run, renderer: str) -> Table:
    rows = []
    for stage in run.distinct("stage", part="fit", renderer=renderer):
        fitted = run.select(part="fit", renderer=renderer, stage=stage)
        errors = {row["variant"]: 100 * row["value"] for _, row in fitted[fitted["metric"] == "error"].iterrows()}
        for i, (_, row) in enumerate(fitted[fitted["metric"] == "constant"].iterrows()):
            rows.append([stage if i == 0 else "", row["variant"], value_of(row), *(f"{e:.0f}" if i == 0 else "" for e in errors.values())])
    return Table(
        f"Our own model of {TITLES[renderer]}, fitted",
        ["stage", "a unit is a", "time a unit", "residual (%)", "error of prediction (%)"],
        rows,
    )
