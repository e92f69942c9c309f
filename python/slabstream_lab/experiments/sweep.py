"""A user's own cases, as a file names them."""
from __future__ import annotations

from .. import plots
from ..page import Page, Section, Table
from ..ranking import rankings
from ..results import Run
from ..value import Value

VARIED = {"volume": "volumes", "view": "views", "variant": "policies", "workers": "numbers of workers", "link": "links"}


def page(run: Run) -> Page:
    if run.select(metric="period", origin="simulated").empty:
        return _service_page(run)
    counts = [f"{name}: {len(run.distinct(column, origin='simulated'))}" for column, name in VARIED.items()]
    return Page(
        str(run.attached("sweep")["title"].iloc[0]),
        f"Every combination of the values that a file lists ({', '.join(counts)}). A section for each volume, renderer and view.",
        [_section(run, part, f"sweep-{i + 1}") for i, part in enumerate(run.distinct("part", origin="simulated"))],
    )


def _service_page(run: Run) -> Page:
    roster = run.attached("roster")
    table = Table("Roster", list(roster.columns), [list(row) for row in roster.itertuples(index=False)])
    sections = [_service_section(run, part, f"sweep-{i + 1}") for i, part in enumerate(run.distinct("part", metric="period"))]
    sections.append(Section("Roster", "Who rendered?", "The workers of the service when the run began.", blocks=[table]))
    return Page(
        str(run.attached("sweep")["title"].iloc[0]),
        f"Measured at a running service of {len(roster)} workers on {roster['host'].nunique()} hosts, as its client saw it. A section for each "
        "volume, renderer and view.",
        sections,
    )


def _service_section(run: Run, part: str, name: str) -> Section:
    policies = run.distinct("variant", part=part)

    least = rankings(
        {metric: {policy: run.value(metric, part=part, variant=policy) for policy in policies} for metric in ("latency", "period")}
    )
    metrics = ("latency", "period", "render_time", "longest_render_time", "imbalance")
    return Section(
        part,
        "Which policy is quickest at this service?",
        "Latency: one frame in flight. Period: from picture to picture, with more frames requested ahead than the service has under way.",
        f"Least times: latency, {least['latency'].sentence()}; from picture to picture, {least['period'].sentence()}.",
        [
            plots.bars(
                name,
                part,
                {policy: {metric: run.value(metric, part=part, variant=policy) for metric in ("latency", "period")} for policy in policies},
                "time",
            ),
            Table(
                part,
                ["policy", "asked for", "latency", "period", "rendering, all", "rendering, longest", "imbalance", "idle", "image bytes"],
                [
                    [
                        row.variant,
                        _policy(row),
                        *(run.value(metric, part=part, variant=row.variant) for metric in metrics),
                        run.value("idle_share", part=part, variant=row.variant).percent(),
                        run.value("image_bytes", part=part, variant=row.variant),
                    ]
                    for row in run.select(metric="latency", part=part).itertuples(index=False)
                ],
            )
        ],
    )


def _policy(row) -> str:
    """The policy as it was made, with what was left open."""
    teams = f", {int(row.teams)} teams" if row.teams > 1 else ""
    return f"{row.decomposition} by {row.balance_by}, {row.assignment}, {row.balance}, {int(row.groups)} groups, {row.combine}{teams}"


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
    ranked = rankings(
        {
            (link, metric): {policy: get(metric, policy, p, link) for policy in policies}
            for link in links
            for metric in ("latency", "period")
        }
    )
    least = [
        f"{link}: latency, {ranked[link, 'latency'].sentence()}; from picture to picture, {ranked[link, 'period'].sentence()}"
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
                **plots.LOG_LOG,
            ),
            table,
        ],
    )
