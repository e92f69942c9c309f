"""Ways to keep workers evenly loaded while a view, a transfer function, a volume or a worker changes."""
from __future__ import annotations

from collections import Counter
from typing import Any, Mapping, Sequence

from .. import plots
from ..page import Page, Section, Table
from ..ranking import Ranking, decide, rankings, ties_text
from ..results import ResultsError, Run, values_by
from ..value import Value, speed_text

OURS = "kd-tree by occupied, dynamic"
STAYS = "kd-tree by occupied"  # the same boxes, which stay
BOUND = "shared out perfectly"
SOURCES = {
    "slab by voxels": "Yagel and Machiraju, 1995",
    "kd-tree by voxels": "boxes of equal volume",
    "kd-tree by bricks": "what the service does if nothing is asked for",
    STAYS: "boxes of equal occupied voxels, cut anew when the transfer function changes, which Zellmann, Schulze and Lang made quick, 2018",
    "kd-tree by occupied, planes": "after Marchesin, Mongenet and Dischler, 2006",
    "kd-tree by voxels, 4 boxes a worker, handover": "a simple form of Walldén, Markidis, Okita and Ino, 2019",
    OURS: "what the service does with --balance dynamic",
}

Case = tuple[str, str, int, str]  # volume, renderer, p and path


def page(run: Run) -> Page:
    cases = _cases(run)
    subjects = list(dict.fromkeys(case[:2] for case in cases))
    return Page(
        "Load balance along paths",
        "Where most voxels are empty, boxes of equal size take unequal times, and a frame waits for the worker that renders longest. "
        "Which way to divide a volume keeps that worker's time short while the view, the transfer function, the volume or a worker changes, "
        "and what does it move?",
        [
            _methods(run),
            _winners(run, cases),
            *[_paths(run, subject, [case for case in cases if case[:2] == subject]) for subject in subjects],
            _settling(run, cases),
        ],
    )


def _cases(run: Run) -> list[Case]:
    rows = run.select(part="path", metric="longest_render_time", variant=None)
    return list(dict.fromkeys((row["volume"], row["renderer"], int(row["workers"]), row["view"]) for _, row in rows.iterrows()))


def _method(row: Mapping[str, Any]) -> str:
    name = f"{row['decomposition']} by {row['balance_by']}"
    if row["groups"] > 1:
        name += f", {int(row['groups'])} boxes a worker"
    if row["assignment"] != "cyclic":
        name += f", {row['assignment']}"
    return name if row["balance"] == "static" else f"{name}, {row['balance']}"


def _values(run: Run, case: Case, metric: str, variant: str | None = None) -> dict[str, Value]:
    """By method."""
    volume, renderer, p, path = case
    rows = run.select(part="path", metric=metric, variant=variant, volume=volume, renderer=renderer, workers=p, view=path)
    return values_by(rows, _method)


def _text(case: Case) -> str:
    volume, renderer, p, path = case
    return f"{volume}, {renderer}, p = {p}, {path}"


def _of(count: int, all_: int) -> str:
    return f"{count} of {all_} case{'' if all_ == 1 else 's'}"


def _methods(run: Run) -> Section:
    rows = run.select(part="path", metric="longest_render_time", variant=None)
    named = dict.fromkeys(_method(row) for _, row in rows.iterrows())
    measured = "latency" in set(run.select(part="path", origin="measured")["metric"])
    how = (
        "Frames of a service with real processes, one in flight. "
        if measured
        else "The boxes of each frame are rendered alone on one thread. The times are learnt as a coordinator learns them, by its own table of "
        "layouts. A box that its worker did not draw in the frame before is rendered with all that must be made for it. "
    )
    return Section(
        "Methods and paths",
        "What is compared?",
        how + "The first frame of a path counts nowhere but in memory. Paths have small steps, since what one frame tells of the next depends "
        "on how far their views lie apart.",
        "",
        [Table("Methods", ["method", "where it comes from"], [[name, SOURCES.get(name, "of this program")] for name in named])],
    )


def _ahead_text(ranked: Sequence[Ranking]) -> str:
    """In how many cases one method alone is ahead, and which."""
    winners = Counter(found.ordered[0] for found in ranked if found.decided and len(found.best) == 1)
    undecided = sum(not found.decided for found in ranked)
    text = f"One method alone has the shortest longest render time in {_of(winners.total(), len(ranked))}"
    text += " (" + "; ".join(f"{name}: {count}" for name, count in winners.most_common()) + ")" if winners else ""
    return text + f"; several tie in {len(ranked) - winners.total() - undecided}; the repeats do not decide {undecided}."


def _winners(run: Run, cases: list[Case]) -> Section:
    ranked = rankings({case: _values(run, case, "longest_render_time") for case in cases})
    rows = []
    for case, found in ranked.items():
        first = found.ordered[0]
        later = [_values(run, case, metric) for metric in ("period", "latency")]
        least = [min(values, key=lambda name: values[name].value) if values else None for values in later]
        speed = speed_text(found.values[OURS].over(found.values[first]), found.outcome(first, OURS), OURS) if first != OURS else ""
        rows.append([*case, found.sentence(), speed, *least])
    return Section(
        "Which method wins where",
        "With which method does the slowest worker render shortest?",
        "Methods are ranked by the longest render time of a frame, in its mean over the path (in parentheses), which is measured. Period and "
        "latency follow from it and from combining; their columns name the method with the least value, whether it ties or not.",
        f"{_ahead_text(list(ranked.values()))} {ties_text(ranked)}." if rows else "",
        [
            Table(
                "Shortest longest render time",
                ["volume", "renderer", "p", "path", "shortest", "the first is", "least period", "least latency"],
                rows,
            )
        ],
    )


def _paths(run: Run, subject: tuple[str, str], cases: list[Case]) -> Section:
    columns = {
        "longest": ("longest_render_time", None),
        "95 % of frames": ("longest_render_time", "95 % of frames"),
        "worst frame": ("longest_render_time", "worst frame"),
        "sum": ("render_time", None),
        "imbalance": ("imbalance", None),
        "period": ("period", None),
        "latency": ("latency", None),
        "moved a frame": ("voxel_bytes", None),
        "time to move": ("move_share", None),
        "fullest worker": ("memory", None),
    }
    speeds: dict[tuple[Case, str], Value] = {}
    found: dict[Case, dict[str, dict[str, Value]]] = {}
    for case in cases:
        found[case] = {name: _values(run, case, *of) for name, of in columns.items()}
        longest = found[case]["longest"]
        changing = [name for name in longest if name.startswith(STAYS) and name != STAYS]
        speeds |= {(case, name): longest[STAYS].over(longest[name]) for name in changing if STAYS in longest}
    outcomes = decide(speeds)
    rows, blocks = [], []
    for case, by_column in found.items():
        for method in by_column["longest"]:
            values = {name: by_method.get(method) for name, by_method in by_column.items()}
            shared = values.pop("sum")
            if values["time to move"] is not None:
                values["time to move"] = values["time to move"].percent()
            text = speed_text(speeds[case, method], outcomes[case, method], "boxes that stay") if (case, method) in speeds else ""
            bound = shared.times(1 / case[2]) if shared is not None else None
            rows.append([case[3], case[2], method, values.pop("longest"), bound, *values.values(), text])
    most_usual = cases[0][2]
    for case in cases:
        if case[2] == most_usual:
            blocks += _plots(run, subject, case)
    names = ["path", "p", "method", "longest", BOUND, *[name for name in columns if name not in ("longest", "sum")], "it is"]
    return Section(
        f"Paths: {subject[0]}, {subject[1]}",
        "What do boxes that change gain over boxes that stay, and what do they move?",
        f"Render times and the bytes that all workers fetch are means over the frames. “{BOUND}”: the sum over the boxes, shared out among "
        "the workers without any loss; work stealing cannot be better with these boxes. “Time to move”: the share of the path's time in which the "
        "worker that receives most receives voxels, at the link's rate, while rendering waits. Latency and period are means over every "
        "twelfth frame.",
        _against_boxes_that_stay(outcomes) if outcomes else "",
        blocks + [Table(f"{subject[0]}: paths", names, rows)],
    )


def _against_boxes_that_stay(outcomes: Mapping[tuple[Case, str], str]) -> str:
    texts = []
    for method in dict.fromkeys(name for _, name in outcomes):
        counts = Counter(outcome for (_, name), outcome in outcomes.items() if name == method)
        balance = method.rpartition(", ")[2]
        text = f"With balance {balance} the longest render time is shorter than with boxes that stay in {_of(counts['faster'], counts.total())}, "
        text += f"longer in {counts['slower']}, as long (ties) in {counts['tie']}"
        texts.append(text + (f"; {counts['open']} are not ranked" if counts["open"] else "") + ".")
    return " ".join(texts)


def _plots(run: Run, subject: tuple[str, str], case: Case) -> list[Any]:
    try:
        steps = run.attached(f"path-{subject[0]}-{subject[1]}-{case[3]}")
    except ResultsError:
        return []
    name = f"path-{subject[0]}-{subject[1]}-{case[3]}".replace(".", "-")
    series = {
        method: [(row["step"], Value.exact(row["longest_render_time"], "s")) for _, row in rows.iterrows() if row["step"] > 0]
        for method, rows in steps.groupby(steps.apply(_method, axis=1), sort=False)
    }
    title = f"{_text(case)}: longest render time"
    return [plots.lines(name, title, series, "frame", "longest render time", "Medians over the repeats.", log_y=True, markers=False)]


def _settling(run: Run, cases: list[Case]) -> Section:
    rows: list[Sequence[Any]] = []
    ours = []
    methods = list(dict.fromkeys(_method(row) for _, row in run.select(part="path", metric="settling_frames").iterrows()))
    for case in cases:
        values = _values(run, case, "settling_frames")
        if not values:
            continue
        rows.append([*case, *[values.get(method) for method in methods]])
        if OURS in values:
            ours.append(values[OURS].value)
    answer = ""
    if ours:
        least, most = min(ours), max(ours)
        answer = f"Dynamic balance settles after {least:.0f}" + (f" to {most:.0f}" if most > least else "") + " frames in the median of the repeats."
    return Section(
        "Frames until balanced again",
        "After a change in the middle of a path, how many frames does a method take to settle?",
        "Frames from the change on, until the longest render time stays within a tenth of its median in the last quarter of the path for three "
        "frames. A method that keeps its boxes settles at once, at whatever imbalance it has then.",
        answer,
        [Table("Frames", ["volume", "renderer", "p", "path", *methods], rows)] if rows else [],
    )

