"""Folders of results with known answers, as experiments write them."""
from __future__ import annotations

import itertools
import json
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python"))
from slabstream_lab.value import interval_of  # noqa: E402

REPEATS = 16
UNITS = {"imbalance": "1", "idle_share": "1", "image_bytes": "B", "assignment_bytes": "B", "memory": "B", "count": "1", "other_load": "1", "drift": "1"}
FIGURES = ("latency", "preview", "period", "imbalance", "idle_share", "image_bytes")


def repeats_round(value: float, spread: float, repeats: int, case: str) -> list[float]:
    """With this median, in an order that the case decides: half of them below, half above, by up to `spread`."""
    draw = random.Random(case)
    above = [draw.uniform(0.2, 1) * spread for _ in range(repeats // 2)]
    errors = above + [-error for error in above] + [0.0] * (repeats % 2)
    draw.shuffle(errors)
    return [value * (1 + error) for error in errors]


def row(metric: str, value: float, spread: float = 0.01, repeats: int = REPEATS, origin: str = "simulated", noise: str = "", **of) -> dict:
    """`spread`: how far repeats are from the value, over it. `repeats` 0: counted."""
    each = repeats_round(value, spread, repeats, f"{metric} {origin} {of}")
    low, high = interval_of(each) if each else (value, value)
    found = {"metric": metric, "unit": UNITS.get(metric, "s"), "value": value, "low": low, "high": high, "repeats": repeats, "noise": noise}
    found |= {"origin": origin, "commit": "abc", "machine": "one core"} | ({"each": each} if each else {})
    return {"version": 1, "experiment": "synthetic", **of, **found}


def figures(seconds: float, repeats: int = REPEATS, **of) -> list[dict]:
    """The figures of a frame whose latency is this; its period is half of it."""
    values = {"latency": seconds, "preview": seconds / 2, "period": seconds / 2, "imbalance": 1.1, "idle_share": 0.2, "image_bytes": 1e6}
    return [row(metric, values[metric], repeats=repeats, **of) for metric in FIGURES]


def write(folder: pathlib.Path, rows: list[dict], experiment: str = "streaming", **info) -> pathlib.Path:
    folder.mkdir(parents=True, exist_ok=True)
    machine = {"cpu": "one", "cores": 1, "simd": "none", "kernel": "Linux", "governor": "", "compiler": "GCC"}
    run = {"experiment": experiment, "version": "0", "commit": "abc", "command": "slabstream <x> & y", "machine": machine}
    run |= {"seed": 1, "repeats": REPEATS, "quick": True, "scale": 0.15, "date": "today"} | info
    (folder / "run.json").write_text(json.dumps(run))
    (folder / "results.jsonl").write_text("".join(json.dumps(r) + "\n" for r in rows))
    return folder


def streaming(folder: pathlib.Path, repeats: int = REPEATS) -> pathlib.Path:
    rows = []
    for p, g in [(1, 1), *itertools.product((2, 8), (1, 2, 4))]:
        of = {"volume": "class1-20", "workers": p, "groups": g, "pixels": 77}
        rows += figures(1 / p, repeats, link="10gbit", **of)
        rows.append(row("memory", 1e6 / g, repeats=0, origin="measured", link="10gbit", **of))
        if p == 2:
            rows.append(row("latency", 1.0, origin="measured", link="host", **of))
    write(folder, rows, "streaming", repeats=repeats)
    spans = "worker,lane,frame,group,stage,begin,end\n1,renders,1,1,render,0,0.5\n1,combines,1,1,combine,0.5,0.6\n"
    (folder / "timeline-class1-20.csv").write_text(spans)
    return folder


def combining(folder: pathlib.Path, repeats: int = REPEATS, times: dict[str, float] | None = None, faults: int = 0) -> pathlib.Path:
    """`times`: seconds of each scheme on 8 full images of one size; they grow with workers, size and active pixels."""
    times = times or {"fan-in": 2e-3, "chain": 3e-3, "radix-k": 1e-3}
    rows = []
    for scheme, seconds in times.items():
        of = {"combine": scheme}

        def add(part: str, p: int, side: int, share: float, link: str, of: dict = of, seconds: float = seconds) -> None:
            value = seconds * p / 8 * side / 100 * share
            rows.append(row("combine_time", value, repeats=repeats, part=part, workers=p, pixels=side, active=share, link=link, **of))

        for p, share in itertools.product((2, 8), (1.0, 0.2)):
            case = {"part": "operators", "workers": p, "pixels": 100, "active": share, **of}
            rows.append(row("run_time", seconds * p / 8 * share, repeats=repeats, origin="measured", variant="operators", **case))
            rows.append(row("count", faults, 0, 0, "measured", variant="page faults", **case))
            add("over workers", p, 100, share, "10gbit")
        for side in (50, 100):
            add("over sizes", 16, side, 1.0, "10gbit")
        for share in (0.05, 0.2, 1.0):
            add("over active pixels", 16, 100, share, "10gbit")
        for p, link in itertools.product((64, 128), ("10gbit", "fat-tree")):
            add("over links", p, 100, 1.0, link)
    return write(folder, rows, "combining", repeats=repeats)


def scaling(folder: pathlib.Path, repeats: int = REPEATS, ideal: bool = True) -> pathlib.Path:
    """Ideal speed-up, or none at all."""
    rows = []
    for part, renderer, variant, p in itertools.product(("strong", "weak"), ("splat", "zbuffer"), ("slab", "kd-tree"), (1, 8)):
        n = 20 * (2 if part == "weak" and p == 8 else 1)
        work = (n / 20) ** 3
        of = {"part": part, "renderer": renderer, "variant": variant, "workers": p, "volume": f"class1-{n}", "n": n, "pixels": 77}
        rows += figures(work / (p if ideal else 1), repeats, link="10gbit", **of)
    return write(folder, rows + many_workers(), "scaling", repeats=repeats)


def many_workers() -> list[dict]:
    """At p = 64 the coordinator's time is half of the latency, and the latency without it three quarters."""
    rows = []
    for scheme, p in itertools.product(("fan-in", "radix-k"), (16, 64)):
        of = {"part": "many workers", "combine": scheme, "workers": p, "volume": "class1-20", "n": 20, "pixels": 77, "link": "10gbit"}
        one, no_time = of | {"variant": "one coordinator"}, of | {"variant": "a coordinator that takes no time"}
        rows += [row("latency", 0.4, repeats=1, **one), row("latency", 0.3, repeats=1, **no_time)]
        rows.append(row("hand_out_time", 0.2 * p / 64, repeats=1, **one))
        rows += [row(metric, 1e-3, origin="measured", **one) for metric in ("plan_time", "assignment_time", "hearing_time")]
        rows.append(row("assignment_bytes", 100.0 * p, repeats=1, origin="measured", **one))
    return rows


def sweep(folder: pathlib.Path, repeats: int = REPEATS, times: dict[str, float] | None = None) -> pathlib.Path:
    """`times`: latency of each policy with one worker."""
    rows = []
    for (variant, seconds), p, link in itertools.product((times or {"a & b": 1.0, "c": 2.0}).items(), (1, 4), ("10gbit", "1gbit")):
        policy = {"decomposition": "slab", "balance_by": "voxels", "assignment": "cyclic", "balance": "static", "combine": "fan-in"}
        of = {"part": "brain, splat, view 1", "volume": "brain", "renderer": "splat", "view": "view 1", "variant": variant, **policy}
        of |= {"workers": p, "groups": 1, "teams": 1, "pixels": 77}
        rows += figures(seconds / p, repeats, link=link, **of)
        if p == 1 and link == "10gbit":
            rows.append(row("latency", seconds, repeats=repeats, origin="measured", link="host", **of))
    write(folder, rows, "sweep", repeats=repeats)
    (folder / "sweep.csv").write_text('title\n"Mine, & <yours>"\n')
    return folder


def cluster(folder: pathlib.Path, repeats: int = REPEATS, ideal: bool = True, error: float = 0.0, drift: float = 0.0) -> pathlib.Path:
    """`error`: of simulated times; `drift`: of times at half the share."""
    rows = []
    for p, (share, off) in itertools.product((1, 8, 16), ((0.5, 0.0), (0.25, drift))):
        of = {"part": "class2-512, splat, view 1", "volume": "class2-512", "renderer": "splat", "variant": "kd-tree", "link": "10gbit:0,10"}
        of |= {"workers": p, "pixels": 77}
        seconds = 1 / (p if ideal else 1)
        metrics = figures(seconds * (1 + off), repeats, **of) + [row("longest_render_time", seconds, repeats=repeats, **of)]
        rows += [r | {"origin": "measured", "share": share} for r in metrics]
        if share == 0.5:
            rows += [r | {"origin": "simulated"} for r in figures(seconds * (1 + error), repeats, **of)]
    return write(folder, rows, "cluster", repeats=repeats)


def service_frames(sizes: tuple[int, ...] = (8, 10, 20), table_size: int = 20) -> list[dict]:
    """The frames of the paper by real processes, as bench/cluster_paper adds them to the results of `experiment paper --scale 0.1`."""
    rows = []
    for renderer, n, p in itertools.product(("splat", "zbuffer"), sizes, (1, 2, 5)):
        kinds = [{"axis": "view", "combine": "fan-in"}]
        if n == table_size and p > 1:
            kinds += [{"axis": "view", "combine": "centralized"}, {"axis": "auto", "combine": "fan-in"}]
        for kind in kinds:
            of = {"part": "service frames", "renderer": renderer, "n": n, "workers": p, "volume": f"class1-{n}", "share": 1 / p, **kind}
            metrics = {"latency": 1e-2, "picture_time": 1e-3, "longest_render_time": 4e-3 / p, "period": 1e-2 / p}
            rows += [row(metric, value, origin="measured", **of) for metric, value in metrics.items()]
            rows.append(row("stage_time", 1e-3 / p, origin="measured", stage="transform", **of))
    return rows


MAKERS = {"streaming": streaming, "combining": combining, "scaling": scaling, "sweep": sweep, "cluster": cluster}
