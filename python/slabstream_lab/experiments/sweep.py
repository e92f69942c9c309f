"""A user's own cases, as a file names them."""
from __future__ import annotations

from .. import plots
from ..page import Page, Section, Table
from ..ranking import ranking
from ..results import Run
from ..value import Value

VARIED = {"volume": "volumes", "view": "views", "variant": "policies", "workers": "numbers of workers", "link": "links"}


def page(run: Run) -> Page:
    counts = [f"{name}: {len(run.distinct(column, origin='simulated'))}" for column, name in VARIED.items()]
    return Page(
        str(run.attached("sweep")["title"].iloc[0]),
        f"Every combination of the values that a file lists ({', '.join(counts)}). A section for each volume, renderer and view.",
        [_section(run, part, f"sweep-{i + 1}") for i, part in enumerate(run.distinct("part", origin="simulated"))],
    )


def _policy(row) -> str:
    """The policy as it was made, with what was left open."""
    teams = f", {int(row.teams)} teams" if row.teams > 1 else ""
    return f"{row.decomposition} by {row.split}, {row.assignment}, {row.balance}, {int(row.groups)} groups, {row.combine}{teams}"


def _section(run: Run, part: str, name: str) -> Section:
    case = {"part": part, "origin": "simulated"}
    links, policies = run.distinct("link", **case), run.distinct("variant", **case)
    workers = sorted(run.distinct("workers", **case))

    def get(metric: str, policy: str, p: int, link: str) -> Value:
        return run.value(metric, variant=policy, workers=p, link=link, **case)

    def served(policy: str, p: int) -> Value | None:
        return run.find("latency", part=part, variant=policy, workers=p, origin="measured")

    lines = {}
    for policy in policies:
        for link in links:
            label = policy if len(links) == 1 else f"{policy}, {link}"
            lines[label] = [(p, get("latency", policy, p, link)) for p in workers]
        if here := [(p, value) for p in workers if (value := served(policy, p)) is not None]:
            lines[f"{policy}, service here"] = here
    table = Table(
        part,
        ["policy", "p", "link", "as made", "latency", "period", "first preview", "imbalance", "idle", "image bytes", "latency, service"],
        [
            [
                row.variant,
                int(row.workers),
                row.link,
                _policy(row),
                *(get(metric, row.variant, row.workers, row.link) for metric in ("latency", "period", "preview", "imbalance")),
                get("idle_share", row.variant, row.workers, row.link).percent(),
                get("image_bytes", row.variant, row.workers, row.link),
                served(row.variant, row.workers) if row.link == links[0] else None,
            ]
            for row in run.select(metric="latency", **case).itertuples(index=False)
        ],
    )
    p = workers[-1]
    least = [
        f"{link}: latency, {ranking({policy: get('latency', policy, p, link) for policy in policies}).sentence()}; from picture to picture, "
        f"{ranking({policy: get('period', policy, p, link) for policy in policies}).sentence()}"
        for link in links
    ]
    return Section(
        part,
        "Which policy is quickest, with how many workers?",
        "Every box rendered alone on one thread; frames simulated from their costs, with all that a service does around a frame; up to two "
        "workers also by the service in this process, whose workers share one machine (policies that were left open: as chosen for "
        f"{links[0]}). With dynamic balance boxes are those that some frames of the same view have led to.",
        f"Least times at p = {p}, {'. '.join(least)}.",
        [
            plots.lines(
                name,
                part,
                lines,
                "workers",
                "latency",
                "A frame that was not requested ahead. Both axes logarithmic.",
                log_x=True,
                log_y=True,
                marks=True,
            ),
            table,
        ],
    )
