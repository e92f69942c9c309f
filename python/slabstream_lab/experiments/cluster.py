"""A time-dilated cluster (bench/cluster): real processes on up to 16 hosts, measured and simulated side by side."""
from __future__ import annotations

from ..page import Page, Section, Table
from ..results import Run
from ..value import Value
from .scaling import efficiency, times

CLOSE = 0.15  # relative error of a simulated time that is good enough
CHECKED = (4, 8, 16)  # numbers of workers at which the simulation is checked
# Throughput efficiency in % at p = 16, and latency of one frame at p = 8 as a share of p = 1, of class II at 10 Gbit/s.
AIMED_AT = {"splat": 85, "raycast": 90}
AIMED_LINK, AIMED_WORKERS, AIMED_LATENCY_WORKERS, AIMED_LATENCY_SHARE = "10gbit:0,10", 16, 8, 0.2


def page(run: Run) -> Page:
    sections = [_aims(run), _dilation(run), _simulation(run), _causes(run)]
    for i, part in enumerate(run.distinct("part", origin="measured")):
        for j, link in enumerate(run.distinct("link", part=part, origin="measured")):
            sections.append(_scaling(run, part, link, f"cluster-{i + 1}-{j + 1}"))
    return Page(
        "Time-dilated cluster",
        "A service with keys on hosts that are namespaces of one machine, each with a share s of a core and of its network's rate; measured "
        "times are multiplied by s.",
        [section for section in sections if section is not None],
    )


def _series(run: Run, metric: str, **case) -> dict[int, Value]:
    """By workers, at the largest share that was measured, which is dilated least. Simulated values have no share."""
    found = {}
    for p in sorted(run.distinct("workers", metric=metric, **case)):
        shares = run.distinct("share", metric=metric, workers=p, **case)
        found[p] = run.value(metric, workers=p, share=max(shares) if shares else None, **case)
    return found


def _efficiency(periods: dict[int, Value], p: int) -> Value | None:
    return efficiency(periods[1], periods[p], p, 1) if 1 in periods and p in periods else None


def _aims(run: Run) -> Section | None:
    rows = []
    case = {"link": AIMED_LINK, "origin": "measured"}
    for part in run.distinct("part", **case):
        renderer = run.only("renderer", part=part)
        if not part.startswith("class2") or renderer not in AIMED_AT:
            continue
        for policy in run.distinct("variant", part=part, **case):
            of = {"part": part, "variant": policy, **case}
            found = _efficiency(_series(run, "period", **of), AIMED_WORKERS)
            latency = _series(run, "latency", **of)
            if found is not None:
                rows.append([part, policy, "efficiency at p = 16, %", found.text(unit=False), f"at least {AIMED_AT[renderer]}", found.value >= AIMED_AT[renderer]])
            if 1 in latency and AIMED_LATENCY_WORKERS in latency:
                share = latency[AIMED_LATENCY_WORKERS].over(latency[1])
                rows.append([part, policy, "latency at p = 8 over p = 1", share.text(), f"at most {AIMED_LATENCY_SHARE}", share.value <= AIMED_LATENCY_SHARE])
    if not rows:
        return None
    reached = sum(row[-1] for row in rows)
    cells = [[*row[:-1], "reached" if row[-1] else "missed"] for row in rows]
    return Section(
        "Aims",
        "Are 16 workers as good as they should be?",
        f"Class II at {AIMED_LINK}. Efficiency from picture to picture, against one worker of the same policy; latency of a frame alone.",
        f"{reached} of {len(rows)} aims are reached.",
        [Table("Aims", ["case", "policy", "what", "measured", "aim", ""], cells)],
    )


def _dilation(run: Run) -> Section | None:
    """Cases that were measured at several shares."""
    rows, worst = [], 0.0
    for (part, policy, p, link), cases in run.select(metric="period", origin="measured").groupby(["part", "variant", "workers", "link"], sort=False):
        shares = sorted(cases["share"].unique(), reverse=True)
        if len(shares) < 2:
            continue
        of = {"part": part, "variant": policy, "workers": p, "link": link, "origin": "measured"}
        for share in shares:
            values = {metric: run.value(metric, share=share, **of) for metric in ("latency", "period")}
            errors = {m: v.value / run.value(m, share=shares[0], **of).value - 1 for m, v in values.items()}
            worst = max(worst, *map(abs, errors.values()))
            rows.append([part, policy, int(p), link, f"{share:.3g}", values["latency"], _signed(errors["latency"]), values["period"], _signed(errors["period"])])
    if not rows:
        return None
    return Section(
        "How well dilation holds",
        "Is a time the same at every share, once it is multiplied by it?",
        "The same case at several shares of a core, against the largest of them.",
        f"Times differ by at most {worst * 100:.0f} %.",
        [Table("Dilation", ["case", "policy", "p", "link", "s", "latency", "off by", "period", "off by"], rows)],
    )


def _signed(error: float) -> str:
    return f"{error * 100:+.1f} %"


def _simulation(run: Run) -> Section | None:
    rows, close = [], 0
    for (part, policy, link), _ in run.select(origin="simulated").groupby(["part", "variant", "link"], sort=False):
        of = {"part": part, "variant": policy, "link": link}
        for metric in ("latency", "period"):
            measured, simulated = (_series(run, metric, origin=origin, **of) for origin in ("measured", "simulated"))
            for p in CHECKED:
                if p not in measured or p not in simulated:
                    continue
                error = simulated[p].value / measured[p].value - 1
                close += abs(error) <= CLOSE
                rows.append([part, policy, link, p, metric, measured[p], simulated[p], _signed(error)])
    if not rows:
        return None
    return Section(
        "The simulation against it",
        "Does the simulation find the times that are measured?",
        "The same cases simulated from boxes rendered alone on this machine, for hosts of one core that encrypt what they send.",
        f"{close} of {len(rows)} simulated times are within {CLOSE * 100:.0f} % of the measured ones.",
        [Table("Measured and simulated", ["case", "policy", "link", "p", "time", "measured", "simulated", "off by"], rows)],
    )


def _causes(run: Run) -> Section | None:
    """Where the simulation of a frame alone goes wrong: rendering, the picture, or the rest."""
    rows = []
    shares: dict[str, list[float]] = {"rendering": [], "the picture": [], "the rest": []}
    for (part, policy, link), _ in run.select(origin="simulated", metric="picture_time").groupby(["part", "variant", "link"], sort=False):
        of = {"part": part, "variant": policy, "link": link}
        times = {
            origin: {metric: _series(run, metric, origin=origin, **of) for metric in ("latency", "longest_render_time", "picture_time")}
            for origin in ("measured", "simulated")
        }
        for p, latency in times["measured"]["latency"].items():
            if any(p not in series for by_metric in times.values() for series in by_metric.values()):
                continue
            found = {}
            for origin, by_metric in times.items():
                whole, longest, picture = (by_metric[metric][p] for metric in ("latency", "longest_render_time", "picture_time"))
                found[origin] = {"rendering": longest, "the picture": picture, "the rest": whole.minus(longest).minus(picture)}
            row = [part, policy, link, p, latency, _signed(times["simulated"]["latency"][p].value / latency.value - 1)]
            for cause in shares:
                missed = (found["simulated"][cause].value - found["measured"][cause].value) / latency.value
                shares[cause].append(missed)
                row += [found["measured"][cause], _signed(missed)]
            rows.append(row)
    if not rows:
        return None
    worst = max(shares, key=lambda cause: sum(map(abs, shares[cause])))
    listed = ", ".join(f"{cause} {100 * sum(map(abs, missed)) / len(missed):.0f} %" for cause, missed in shares.items())
    return Section(
        "The simulation's errors by cause",
        "Which part of a frame does the simulation get wrong?",
        "A frame alone, in three parts: the longest rendering of a worker; making the picture; and the rest, which is combining, planning, messages and "
        "the picture's way to the client. After each part: what the simulation has more or less of it, as a share of the measured latency. "
        "The three sum to the error of the latency.",
        f"Mean errors, without signs, as shares of the latency: {listed}. Most comes from {worst}.",
        [
            Table(
                "Errors of latency by cause",
                ["case", "policy", "link", "p", "latency", "off by", "rendering", "off by", "picture", "off by", "rest", "off by"],
                rows,
            )
        ],
    )


def _scaling(run: Run, part: str, link: str, name: str) -> Section:
    case = {"part": part, "link": link}
    policies = run.distinct("variant", origin="measured", **case)
    lines = {}
    for policy in policies:
        for origin in run.distinct("origin", variant=policy, metric="period", **case):
            label = policy if origin == "measured" else f"{policy}, simulated"
            lines[label] = list(_series(run, "period", variant=policy, origin=origin, **case).items())
    rows, best = [], []
    for policy in policies:
        of = {"variant": policy, "origin": "measured", **case}
        series = {m: _series(run, m, **of) for m in ("latency", "period", "longest_render_time", "imbalance", "idle_share", "image_bytes")}
        for p, period in series["period"].items():
            idle = series["idle_share"][p].percent()
            seen = [series[m][p] for m in ("longest_render_time", "imbalance")]
            rows.append([policy, p, series["latency"][p], period, _efficiency(series["period"], p), *seen, idle, series["image_bytes"][p]])
        most = max(series["period"])
        if most > 1 and (found := _efficiency(series["period"], most)) is not None:
            best.append((found.value, f"{policy}: {found.text()} at p = {most}"))
    return Section(
        f"{part}, {link}",
        "How much faster are more hosts?",
        "Latency: one frame in flight. Period: from picture to picture, with more frames requested ahead than the service has under way. "
        "Efficiency by period, against one worker of the same policy.",
        f"Efficiency: {'; '.join(text for _, text in sorted(best, reverse=True))}." if best else "",
        [
            times(name, f"From picture to picture, {link}", lines),
            Table(part, ["policy", "p", "latency", "period", "efficiency", "rendering, longest", "imbalance", "idle", "image bytes"], rows),
        ],
    )
