"""Combining schemes over workers, picture sizes, active pixels and links."""
from __future__ import annotations

import itertools
import math
from typing import Sequence

from .. import plots
from ..page import Figure, Page, Section, Table
from ..ranking import Ranking, rankings, ties_text
from ..results import ResultsError, Run
from ..value import Value, speed_text

SIMULATED = (
    "Schedules in virtual time, on machines of this one's speed: once for each repeat of the calibration of its operators. All images are "
    "ready at once; the time ends when one worker holds the combined image. Empty pixels do not travel; a pixel has 16 bytes. "
)


def page(run: Run) -> Page:
    return Page(
        "Combining schemes compared",
        "Each worker has rendered its part; how do these images become one? Every scheme over workers, picture sizes, active pixels and "
        "links.",
        [_operators(run), _over_workers(run), _over_pictures(run), _over_links(run)],
    )


def _percent(share: float) -> str:
    return f"{share * 100:g} %"


def _by_scheme(run: Run, **case) -> dict[str, Value]:
    """The times of a case, by scheme."""
    metric = "run_time" if case["part"] == "operators" else "combine_time"
    return {scheme: run.value(metric, combine=scheme, **case) for scheme in run.distinct("combine", metric=metric, **case)}


def _fan_in(run: Run, metric: str, shares: Sequence[float], **case) -> dict[str, Value]:
    """The times of fan-in, by active pixels."""
    return {f"fan-in with {_percent(share)}": run.value(metric, combine="fan-in", active=share, **case) for share in shares}


def _gain(found: Ranking) -> str:
    """What images with few active pixels gain over those with many, from a ranking of _fan_in."""
    few, many = found.values
    return f"F{few[1:]} active is {speed_text(found.values[many].over(found.values[few]), found.outcome(few, many), many)}."


def _sorted(run: Run, column: str, part: str) -> list:
    found = sorted(run.distinct(column, part=part))
    if not found:
        raise ResultsError(f"no results of '{part}'")
    return found


def _over(run: Run, name: str, title: str, column: str, label: str, caption: str, **case) -> Figure:
    """A line a scheme, over the values of a column."""
    series: dict[str, list[tuple[float, Value]]] = {}
    for at in _sorted(run, column, case["part"]):
        for scheme, value in _by_scheme(run, **{column: at}, **case).items():
            series.setdefault(scheme, []).append((at * 100 if column == "active" else at, value))
    log = column != "active"
    return plots.lines(name, title, series, label, "time", caption, log_x=log, log_y=log, from_zero=not log, marks=log)


def _table(run: Run, title: str, part: str) -> Table:
    cases = run.select(part=part)[["workers", "pixels", "active", "link"]].drop_duplicates().sort_values("workers", kind="stable")
    return Table(
        title,
        ["scheme", "p", "side (pixels)", "active", "link", "time"],
        [
            [scheme, int(case.workers), int(case.pixels), _percent(case.active), case.link, value]
            for case in cases.itertuples(index=False)
            for scheme, value in _by_scheme(run, part=part, **case._asdict()).items()
        ],
    )


def _operators(run: Run) -> Section:
    part = "operators"
    workers, shares, pixels = _sorted(run, "workers", part), _sorted(run, "active", part), run.only("pixels", part=part)
    p, sparse, full = workers[-1], shares[0], shares[-1]
    rows = [
        [scheme, q, pixels, _percent(share), value, run.value("count", part=part, combine=scheme, workers=q, active=share)]
        for share in (full, sparse)
        for q in workers
        for scheme, value in _by_scheme(run, part=part, variant=part, workers=q, active=share).items()
    ]
    disturbed = sum(row[-1].value > 0 for row in rows)
    least = rankings(
        {share: _by_scheme(run, part=part, variant=part, workers=p, active=share) for share in (full, sparse)}
        | {"fan-in": _fan_in(run, "run_time", (sparse, full), part=part, workers=p)}
    )
    return Section(
        "What combining computes",
        "Images without a link between them: what do the operators alone take, along each schedule's critical path?",
        "Every step of a schedule on real images in this process, in processor time of one thread. The time of a round is that of its "
        "busiest worker. Encoding belongs to who sends, combining to who receives. As in a worker, memory is kept from run to run: in each "
        "repeat the first run is not timed, and the median of the others counts. The last column counts page faults in all timed runs.",
        f"Least time at p = {p}, {_percent(full)} active: {least[full].sentence()}; {_percent(sparse)} active: {least[sparse].sentence()}. "
        f"{_gain(least['fan-in'])} "
        + (f"Page faults fell into timed runs of {disturbed} of {len(rows)} cases." if disturbed else "No page fault was timed."),
        [
            _over(
                run,
                f"operators-{name}",
                f"Computing, {pixels} x {pixels} pixels, {_percent(share)} active",
                "workers",
                "workers",
                "Along the critical path, without links. Both axes logarithmic.",
                part=part,
                variant=part,
                active=share,
            )
            for name, share in (("full", full), ("sparse", sparse))
        ]
        + [Table("What combining computes, without links", ["scheme", "p", "side (pixels)", "active", "time", "page faults"], rows)],
    )


def _over_workers(run: Run) -> Section:
    part = "over workers"
    workers, shares = _sorted(run, "workers", part), _sorted(run, "active", part)[::-1]
    pixels, link = run.only("pixels", part=part), run.only("link", part=part)
    least = rankings({(share, p): _by_scheme(run, part=part, workers=p, active=share) for share in shares for p in workers})
    return Section(
        "Over workers",
        "Which scheme suits how many workers?",
        SIMULATED + f"Link {link}, {pixels} x {pixels} pixels.",
        "Least time: "
        + "; ".join(
            f"p = {p}, {_percent(share)} active: {found.sentence()}"
            for (share, p), found in least.items()
            if p in (workers[0], workers[-1])
        )
        + f". Over all numbers of workers {ties_text(least)}.",
        [
            _over(
                run,
                f"over-workers-{name}",
                f"{pixels} x {pixels} pixels, {_percent(share)} active, {link}",
                "workers",
                "workers",
                "Until the image is complete at one worker. Both axes logarithmic.",
                part=part,
                active=share,
            )
            for name, share in zip(("full", "sparse"), shares)
        ]
        + [
            Table(
                "Least time over workers",
                ["active", "p", "scheme"],
                [[_percent(share), p, found.sentence()] for (share, p), found in least.items()],
            ),
            _table(run, "Combining over workers", part),
        ],
    )


def _over_pictures(run: Run) -> Section:
    sizes, shares = _sorted(run, "pixels", "over sizes"), _sorted(run, "active", "over active pixels")
    p, link = run.only("workers", part="over sizes"), run.only("link", part="over sizes")
    pixels = run.only("pixels", part="over active pixels")
    least = rankings(
        {("side", side): _by_scheme(run, part="over sizes", pixels=side) for side in sizes}
        | {("share", share): _by_scheme(run, part="over active pixels", active=share) for share in shares}
        | {"fan-in": _fan_in(run, "combine_time", (shares[0], shares[-1]), part="over active pixels")}
    )
    by_size = {side: least["side", side].sentence() for side in sizes}
    by_share = {share: least["share", share].sentence() for share in shares}
    return Section(
        "Over pictures",
        "How does combining grow with the picture and with what images fill of it?",
        SIMULATED + f"Link {link}, p = {p}. Images of different sizes are full; active pixels are varied at {pixels} x {pixels}.",
        "Least time: "
        + "; ".join(f"{side} x {side} pixels: {by_size[side]}" for side in (sizes[0], sizes[-1]))
        + f"; {_percent(shares[0])} of {pixels} x {pixels} pixels active: {by_share[shares[0]]}. "
        + _gain(least["fan-in"]),
        [
            _over(
                run,
                "over-sizes",
                f"Over picture sizes, p = {p}, {link}",
                "pixels",
                "side of the picture (pixels)",
                "Full images. Both axes logarithmic.",
                part="over sizes",
            ),
            _over(
                run,
                "over-active-pixels",
                f"Over active pixels, p = {p}, {link}",
                "active",
                "active pixels of each image (%)",
                f"Each image fills a square somewhere in the frame of {pixels} x {pixels} pixels.",
                part="over active pixels",
            ),
            Table(
                "Least time over pictures",
                ["side (pixels)", "active", "scheme"],
                [[side, "100 %", text] for side, text in by_size.items()]
                + [[pixels, _percent(share), text] for share, text in by_share.items()],
            ),
            _table(run, "Combining over picture sizes", "over sizes"),
            _table(run, "Combining over active pixels", "over active pixels"),
        ],
    )


def _equal_links(times: dict[str, dict[str, Value]]) -> str:
    """Which links give the same simulated times, for which schemes."""
    texts = []
    for a, b in itertools.combinations(times, 2):
        same = [scheme for scheme in times[a] if math.isclose(times[a][scheme].value, times[b][scheme].value, rel_tol=1e-6)]
        if same:
            texts.append(f"{a} and {b} for {'every scheme' if len(same) == len(times[a]) else ', '.join(same)}")
    return f"Equal times: {'; '.join(texts)}" if texts else "No two links give equal times"


def _over_links(run: Run) -> Section:
    part = "over links"
    workers, links, pixels = _sorted(run, "workers", part), run.distinct("link", part=part), run.only("pixels", part=part)
    times = {p: {link: _by_scheme(run, part=part, workers=p, link=link) for link in links} for p in workers}
    least = rankings({(p, link): times[p][link] for p in workers for link in links})

    def relative(p: int, link: str) -> dict[str, Value]:
        of = times[p][link]
        return {scheme: value.times(1 / of[least[p, link].ordered[0]].value, "1") for scheme, value in of.items()}

    return Section(
        "Over links",
        "Which scheme suits which link?",
        SIMULATED + f"{pixels} x {pixels} pixels, all active.",
        " ".join(
            f"Least time at p = {p}: {'; '.join(f'{link}: {least[p, link].sentence()}' for link in links)}. {_equal_links(times[p])}."
            for p in workers
        ),
        [
            plots.bars(
                f"over-links-{p}",
                f"Over links, p = {p}, {pixels} x {pixels} pixels, all active",
                {link: relative(p, link) for link in links},
                "time over that of the link's lowest",
                "Full images. 1: the scheme with the lowest median on a link. The time axis is logarithmic.",
                log_y=True,
            )
            for p in workers
        ]
        + [_table(run, "Combining over links", part)],
    )
