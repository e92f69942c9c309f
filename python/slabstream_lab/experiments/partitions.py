"""Ways to divide sparse volumes and to combine their images, for one view."""
from __future__ import annotations

import statistics
from typing import Any

import pandas

from .. import plots
from ..page import Page, Section, Table
from ..ranking import rankings
from ..results import Run, value_of, values_by
from ..value import Value, number_text

LINK, SCHEME = "10gbit", "radix-k"

Subject = tuple[str, str]  # volume and renderer


def page(run: Run) -> Page:
    subjects: list[Subject] = [
        (volume, renderer)
        for volume in run.distinct("volume", part="policy")
        for renderer in run.distinct("renderer", part="policy", volume=volume)
    ]
    return Page(
        "Ways to divide sparse volumes",
        "Where most voxels are empty, boxes of equal size take unequal times, and a frame waits for the slowest worker. How much does that "
        "cost for one view, and which way to divide a volume avoids it? The experiment `balance` compares what happens while views move.",
        [
            _recommended(run, subjects),
            _efficiency(run, subjects),
            _assignments(run, subjects),
            _owners(run, subjects),
        ],
    )


def _partition(row: pandas.Series) -> str:
    return f"{row['decomposition']} by {row['balance_by']}"


def _shared(run: Run, part: str, subject: Subject) -> list[int]:
    """The numbers of workers, above one."""
    return [p for p in sorted(run.distinct("workers", part=part, volume=subject[0], renderer=subject[1])) if p > 1]


def _slug(run: Run, subject: Subject) -> str:
    """Of the names of plots: the renderer only where there are several."""
    return "-".join(subject if len(run.distinct("renderer", part="policy")) > 1 else subject[:1]).replace(".", "-")


def _workers_of(run: Run, part: str) -> int:
    return run.distinct("workers", part=part)[0]


def _latencies(run: Run, subject: Subject, p: int) -> dict[str, Value]:
    """Of the partitions with one group in the view of the partition section."""
    of = {"part": "policy", "metric": "latency", "volume": subject[0], "renderer": subject[1]}
    return values_by(run.select(workers=p, groups=1, combine=SCHEME, link=LINK, **of), _partition)


def _efficiency(run: Run, subjects: list[Subject]) -> Section:
    table = Table(
        "Efficiency and its factors",
        "volume,renderer,p,partition,imbalance,efficiency,= balance,x extra work,x combining,voxels of a worker".split(","),
        [],
    )
    blocks: list[Any] = []
    most: dict[tuple[str, str], dict[str, Value]] = {}  # imbalances at the greatest p
    for volume, renderer in subjects:
        of = {"volume": volume, "renderer": renderer}
        name = _slug(run, (volume, renderer))
        whole = run.value("render_time", part="partition", workers=1, **of)
        alone = run.value("latency", part="policy", workers=1, link=LINK, **of)
        shared = _shared(run, "partition", (volume, renderer))
        imbalances: dict[str, dict[int, Value]] = {}
        efficiencies: dict[str, dict[int, Value]] = {}
        for p in shared:
            latencies = _latencies(run, (volume, renderer), p)
            columns = {
                metric: values_by(run.select(part="partition", metric=metric, workers=p, **of), _partition)
                for metric in ("imbalance", "render_time", "longest_render_time", "memory")
            }
            for partition, latency in latencies.items():
                total, longest = columns["render_time"][partition], columns["longest_render_time"][partition]
                efficiency = alone.over(latency).times(1 / p).percent()
                imbalances.setdefault(partition, {})[p] = columns["imbalance"][partition]
                efficiencies.setdefault(partition, {})[p] = efficiency
                table.rows.append(
                    [
                        volume,
                        renderer,
                        p,
                        partition,
                        columns["imbalance"][partition],
                        efficiency,
                        total.over(longest).times(1 / p).percent(),
                        whole.over(total).percent(),
                        longest.over(latency).over(whole.over(alone)).percent(),
                        columns["memory"][partition],
                    ]
                )
            if p == shared[-1]:
                most[volume, renderer] = columns["imbalance"]
        for split, equal in (("voxels", "voxels"), ("bricks", "work, by bricks"), ("occupied", "work, by counted voxels")):
            blocks.append(
                plots.lines(
                    f"imbalance-{name}-{split}",
                    f"{volume}, {renderer}: imbalance, boxes of equal {equal}",
                    {q: list(by_p.items()) for q, by_p in imbalances.items() if q.endswith(split)},
                    "workers",
                    "longest / mean render time",
                    "1 is perfect. A worker whose box shows nothing counts with no time.",
                    **plots.LOG_LOG,
                )
            )
        blocks.append(
            plots.lines(
                f"efficiency-{name}",
                f"{volume}, {renderer}: efficiency, boxes of equal occupied voxels",
                {q: list(by_p.items()) for q, by_p in efficiencies.items() if q.endswith("occupied") or q == "slab by voxels"},
                "workers",
                "efficiency",
                "Latency of one worker over p times the latency of p workers.",
                **plots.LOG_X_FROM_ZERO,
            )
        )
        for partition, decomposition in (("slab by voxels", "slab"), ("kd-tree by occupied", "kd-tree")):
            boxes = run.attached(f"boxes-{volume}-{renderer}-{decomposition}")
            title = f"{volume}, {renderer}: {partition}, p = {_workers_of(run, 'assignment')}"
            caption = "Render time of every box that the cut meets."
            blocks.append(plots.cuts(f"boxes-{name}-{partition.replace(' ', '-')}", title, boxes, caption))
    view = run.distinct("view", part="partition")[0]
    pixels = run.distinct("pixels", part="partition")[0]
    return Section(
        "Partitions: imbalance and efficiency",
        "Which partition gives workers equal work, and what is lost to imbalance, to extra work and to combining?",
        f"One view (azimuth/elevation {view}), {pixels} x {pixels} pixels, one box a worker. Every box is rendered alone on one thread. "
        "Imbalance is the longest of the workers' render times over their mean. Efficiency is the latency of one worker, T(1), over p "
        f"times that of p workers, T(p), simulated on a network of 10 Gbit/s and combined by {SCHEME}. In each repeat its three factors "
        "multiply exactly: balance is mean over longest render time; extra work is the render time of the whole volume by one worker over "
        "the sum of the boxes' render times; combining is the rest: the share of the frame in which the slowest worker renders, over the "
        "same share with one worker. A factor above 100 % is a gain. The table has medians over the repeats, whose product may differ a "
        "little. The voxels of a worker include the halo and are those of the fullest.",
        _least_imbalance(f"Least imbalance at p = {shared[-1]}", most) if most else "",
        blocks + [table],
    )


def _least_imbalance(what: str, cases: dict[tuple[str, str], dict[str, Value]]) -> str:
    ranked = rankings(cases)
    return f"{what}: " + "; ".join(f"{volume} ({renderer}): {found.sentence()}" for (volume, renderer), found in ranked.items()) + "."


def _recommended(run: Run, subjects: list[Subject]) -> Section:
    rows, ratios = [], []
    for volume, renderer in subjects:
        for p in _shared(run, "default", (volume, renderer)):
            for link in run.distinct("link", part="default"):
                of = {"volume": volume, "renderer": renderer, "workers": p, "link": link}
                usual = value_of(run.select(part="default", metric="latency", **of).iloc[0])
                tried = values_by(run.select(part="policy", metric="latency", **of), _policy)
                best = min(tried, key=lambda name: tried[name].value)
                own = tried[best].value >= usual.value
                ratio = usual.over(usual if own else tried[best])
                ratios.append(ratio.value)
                rows.append([volume, renderer, p, link, "the default" if own else best, usual if own else tried[best], usual, ratio])
    answer = ""
    if rows:
        median, worst = statistics.median(ratios), max(range(len(ratios)), key=ratios.__getitem__)
        answer = (
            f"By the simulation, the latency of the default is {number_text(median, 3)} times that of the best policy in the median of "
            f"{len(ratios)} cases. It is {number_text(ratios[worst], 3)} times in the worst case: "
            f"{rows[worst][0]}, {rows[worst][1]}, p = {rows[worst][2]}, {rows[worst][3]}."
        )
    return Section(
        "Which policy is best",
        "Which policy makes a frame of these volumes soonest, and what is lost without asking for one?",
        "All policies of these lists are simulated with measured boxes: all partitions, 1 and 2 groups, cyclic, "
        f"{', '.join(run.distinct('combine', part='policy'))}; and what the service does if a request names nothing. "
        "The ratio is found repeat by repeat.",
        answer,
        [Table("The best policy and the default", "volume,renderer,p,link,the best,best,default,default / best".split(","), rows)],
    )


def _policy(row: pandas.Series) -> str:
    groups = int(row["groups"])
    return f"{_partition(row)}, {groups} group{'' if groups == 1 else 's'}, {row['assignment']}, {row['combine']}"


def _assignments(run: Run, subjects: list[Subject]) -> Section:
    rows, cases = [], {}
    for volume, renderer in subjects:
        found = run.select(part="assignment", metric="imbalance", volume=volume, renderer=renderer)
        values = values_by(found, lambda row: f"{_partition(row)}, {row['assignment']}")
        names = run.distinct("assignment", part="assignment")
        for partition in dict.fromkeys(found.apply(_partition, axis=1)):
            rows.append([volume, renderer, partition, *[values[f"{partition}, {name}"] for name in names]])
        cases[volume, renderer] = values
    p, groups = _workers_of(run, "assignment"), run.distinct("groups", part="assignment")[0]
    return Section(
        "Assignments",
        f"With {groups} boxes a worker, who should own which?",
        f"p = {p}, {groups} groups. Imbalance as above, from the workers' sums over their boxes.",
        _least_imbalance("Least imbalance", cases),
        [Table("Imbalance by assignment", ["volume", "renderer", "partition", *run.distinct("assignment", part="assignment")], rows)],
    )


def _owners(run: Run, subjects: list[Subject]) -> Section:
    rows, ratios = [], []
    for volume, renderer in subjects:
        for arrangement in run.distinct("assignment", part="owners", volume=volume, renderer=renderer):
            for p in _shared(run, "owners", (volume, renderer)):
                of = {"volume": volume, "renderer": renderer, "workers": p}
                owned = {"part": "owners", "assignment": arrangement, **of}
                counts = [run.value("count", variant=variant, **owned) for variant in ("boxes", "groups", "images")]
                latency = run.value("latency", link=LINK, **owned)
                ratio = latency.over(run.value("latency", part="default", link=LINK, **of))
                ratios.append(ratio.value)
                imbalance = run.value("imbalance", **owned)
                rows.append([volume, renderer, arrangement, p, *counts, imbalance, latency, ratio])
    answer = ""
    if ratios:
        answer = (
            f"By the simulation, a frame of voxels that stay takes {number_text(min(ratios), 3)} to {number_text(max(ratios), 3)} times as "
            f"long as one of boxes that are cut for the workers, in the median {number_text(statistics.median(ratios), 3)} times."
        )
    return Section(
        "Voxels that stay with their owners",
        "If processes hold voxels in parts of any shape, how many groups and images does an exact picture take, and how long?",
        "As many owners as workers. The volume is divided into cells, 32 or a few more for each owner, of which each has those that the "
        "arrangement gives it. Neighbours of one owner are one box. A group takes from each worker boxes that follow one another in "
        "visibility order, and these become one image before it travels.",
        answer,
        [
            Table(
                "Owners",
                "volume,renderer,arrangement,p,boxes,groups,images,imbalance,latency,latency / default".split(","),
                rows,
            )
        ],
    )
