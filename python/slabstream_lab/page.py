"""The page of an experiment: sections of text, tables and figures, in one HTML file that loads nothing."""
from __future__ import annotations

import base64
import dataclasses
import pathlib
import re
from typing import Any, Sequence, Union

import jinja2

from .ranking import LEVEL, MODEL_ERROR, least_repeats
from .results import Run
from .value import Value, scale_of


@dataclasses.dataclass
class Table:
    """Cells are Values, texts, numbers or None. A column of Values has one unit for all rows."""

    title: str
    columns: Sequence[str]
    rows: list[Sequence[Any]]

    def scales(self) -> list[tuple[float, str] | None]:
        scales: list[tuple[float, str] | None] = []
        for i in range(len(self.columns)):
            values = [row[i] for row in self.rows if isinstance(row[i], Value)]
            sizes = sorted(abs(v.value) for v in values if v.value != 0)
            middle = sizes[len(sizes) // 2] if sizes else 0
            scales.append(scale_of(values[0].unit, middle) if values else None)
        return scales


@dataclasses.dataclass
class Figure:
    name: str  # of its file: plots/NAME.svg
    svg: str
    caption: str


@dataclasses.dataclass
class Photo:
    name: str
    png: bytes
    caption: str

    @property
    def data(self) -> str:
        return base64.b64encode(self.png).decode()


@dataclasses.dataclass
class Section:
    title: str
    question: str
    method: str
    answer: str = ""  # from the tables below it, by a rule that states both outcomes
    blocks: list[Union[Table, Figure, Photo]] = dataclasses.field(default_factory=list)

    @property
    def anchor(self) -> str:
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclasses.dataclass
class Page:
    title: str
    summary: str
    sections: list[Section]


def doubts(run: Run) -> list[str]:
    """What speaks against the numbers of a run."""
    found = []
    load = run.find("other_load", part="conduct")
    if load is not None and load.high > 0.1:
        found.append(
            f"Other programs took up to {load.high * 100:.0f} % of the machine during a trial ({load.value * 100:.0f} % in the median)."
        )
    drift = run.find("drift", part="conduct")
    if drift is not None and (drift.high > 1.05 or drift.low < 0.95):
        found.append(f"A fixed loop took from {drift.low:.2f} to {drift.high:.2f} times as long as at the start of the run.")
    noisy = run.results["noise"].fillna("").ne("").sum()
    if noisy > 0.1 * len(run.results):
        found.append(f"{noisy} of {len(run.results)} values are noisy: their intervals are wide, or their repeats fall into two heaps.")
    if run.info["repeats"] < least_repeats(1):
        found.append(f"Repeats: {run.info['repeats']}. Nothing is ranked by fewer than {least_repeats(1)}.")
    if str(run.info["commit"]).endswith("-dirty"):
        found.append("The sources of the program were changed after their commit.")
    return found


def write(page: Page, run: Run, folder: pathlib.Path) -> pathlib.Path:
    """FOLDER/report.html and FOLDER/plots/*.svg."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.tests["value"] = lambda cell: isinstance(cell, Value)
    kinds = {Table: "table", Figure: "figure", Photo: "photo"}
    environment.filters["kind"] = lambda block: kinds[type(block)]
    html = environment.get_template("page.html").render(page=page, info=run.info, doubts=doubts(run), level=LEVEL, model_error=MODEL_ERROR)
    (folder / "plots").mkdir(parents=True, exist_ok=True)
    for section in page.sections:
        for block in section.blocks:
            if isinstance(block, Figure):
                (folder / "plots" / f"{block.name}.svg").write_text(block.svg, encoding="utf-8")
    path = folder / "report.html"
    path.write_text(html, encoding="utf-8")
    return path
