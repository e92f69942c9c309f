"""Polyhedral grids of `experiment paper`: what the paper's section 2 says of them, measured."""
from __future__ import annotations

from .. import plots
from ..page import Section, Table
from ..ranking import decide
from ..results import Run
from ..value import Value, speed_text


def sections(run: Run) -> list[Section]:
    rows = run.narrowed(part="grids")
    partitions = {d: f"{d} by {rows.distinct('balance_by', decomposition=d)[0]}" for d in rows.distinct("decomposition")}
    workers = sorted(rows.distinct("workers"))

    def value(metric: str, decomposition: str, p: int, variant: str | None = None) -> Value:
        return rows.value(metric, decomposition=decomposition, workers=p, variant=variant)

    def efficiency(decomposition: str, p: int) -> Value:
        whole = value("render_time", decomposition, 1)
        return whole.over(value("longest_render_time", decomposition, p)).times(1 / p).percent()

    def held(decomposition: str, p: int) -> Value:
        cells = value("count", decomposition, p, "cells")
        return value("count", decomposition, p, "cells that workers hold").over(cells)

    table = [
        [
            partition,
            p,
            value("longest_render_time", d, p),
            value("imbalance", d, p),
            value("render_time", d, p).over(value("render_time", d, 1)),
            held(d, p),
            efficiency(d, p),
        ]
        for d, partition in partitions.items()
        for p in workers
    ]
    p = workers[-1]
    even, slabs = (next(d for d in partitions if d.startswith(name)) for name in ("kd-tree", "slab"))
    gain = value("longest_render_time", slabs, p).over(value("longest_render_time", even, p))
    outcome = decide({0: gain})[0]
    cells, volume = int(value("count", even, 1, "cells").value), rows.distinct("volume")[0]
    answer = (
        f"At p = {p}, workers together hold {held(even, p).text()} ({partitions[even]}) and {held(slabs, p).text()} ({partitions[slabs]}) times the "
        f"grid's cells; rendering has an efficiency of {efficiency(even, p).text()} and {efficiency(slabs, p).text()}. The slowest worker is, with "
        f"{partitions[even]}, {speed_text(gain, outcome, partitions[slabs])}."
    )
    return [
        Section(
            "Polyhedral grids",
            "The paper expects that any polyhedral grid can be rendered this way: a regular grid divides the space, and each processor renders what is "
            "clipped to its part (section 2). What is done twice, and does rendering shrink with p?",
            f"{volume}: a ball in a cube of {cells} tetrahedra, by slicing (Yagel and others, 1996), which the paper names. Boxes are boxes of voxels "
            "of a lattice under the grid. A worker holds every cell that touches its padded box, so cells at borders are held by several workers, and "
            "draws of each cell what lies in its box. Each box is rendered alone on one thread. Efficiency of rendering: the time of one worker over "
            "p times that of the slowest of p; combining is not in it.",
            answer,
            [
                Table(
                    "Grids among workers",
                    ["partition", "p", "slowest worker", "imbalance", "sum over p = 1", "cells held / cells", "efficiency of rendering"],
                    table,
                ),
                plots.lines(
                    "grids-efficiency",
                    "Efficiency of rendering a grid",
                    {partition: [(q, efficiency(d, q)) for q in workers] for d, partition in partitions.items()},
                    "workers p",
                    "efficiency",
                    **plots.LOG_X_FROM_ZERO,
                ),
            ],
        )
    ]
