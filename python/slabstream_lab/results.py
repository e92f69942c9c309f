"""Reads the folder of an experiment."""
from __future__ import annotations

import json
import pathlib
from typing import Any, Callable

import pandas

from .value import Value

VERSION = 1
TEXTS = (
    "experiment part volume view renderer decomposition axis balance_by assignment balance combine link variant stage metric unit noise origin "
    "commit machine"
).split()
NUMBERS = "version n occupancy workers pixels groups teams share active k box value low high repeats".split()


class ResultsError(Exception):
    """A folder that cannot be read, or a question that it has no answer to: one line that says which."""


class Run:
    """results: a DataFrame of all rows (docs/reference/results.md). info: run.json."""

    def __init__(self, results: pandas.DataFrame, info: dict[str, Any], folder: pathlib.Path | None = None):
        self.results = results
        self.info = info
        self.folder = folder

    def select(self, **columns: Any) -> pandas.DataFrame:
        """The rows with these values. A list: any of them; None: an empty column."""
        rows = self.results
        for name, wanted in columns.items():
            if name not in rows:
                raise ResultsError(f"results have no column '{name}'")
            if wanted is None:
                rows = rows[rows[name].isna()]
            elif isinstance(wanted, (list, tuple, set)):
                rows = rows[rows[name].isin(list(wanted))]
            else:
                rows = rows[rows[name] == wanted]
        return rows

    def narrowed(self, **columns: Any) -> "Run":
        """Of the rows with these values alone."""
        return Run(self.select(**columns), self.info, self.folder)

    def find(self, metric: str, **columns: Any) -> Value | None:
        """The only value of a case, or None if there is none. ResultsError if there are several."""
        rows = self.select(metric=metric, **columns)
        if len(rows) > 1:
            distinct = [name for name in rows if name not in ("value", "low", "high", "each") and rows[name].nunique(dropna=False) > 1]
            raise ResultsError(f"{len(rows)} values of {metric} for {columns}; they differ in {', '.join(distinct)}")
        return None if rows.empty else value_of(rows.iloc[0])

    def value(self, metric: str, **columns: Any) -> Value:
        """Like find, but ResultsError if there is none."""
        value = self.find(metric, **columns)
        if value is None:
            raise ResultsError(f"no value of {metric} for {columns}")
        return value

    def distinct(self, column: str, **columns: Any) -> list:
        """The values of a column in the order of their first mention."""
        found = self.select(**columns)[column].dropna().unique().tolist()
        return [int(x) if isinstance(x, float) and x.is_integer() else x for x in found]

    def only(self, column: str, **columns: Any) -> Any:
        """The one value that a column has in these rows. ResultsError if there are none or several."""
        found = self.distinct(column, **columns)
        if len(found) != 1:
            raise ResultsError(f"{len(found)} values of '{column}' for {columns}, where one is expected")
        return found[0]

    def attached(self, name: str) -> pandas.DataFrame:
        """The table NAME.csv beside the results."""
        if self.folder is None or not (self.folder / f"{name}.csv").exists():
            raise ResultsError(f"no table '{name}' beside the results")
        return pandas.read_csv(self.folder / f"{name}.csv")


def value_of(row: pandas.Series) -> Value:
    noise = row["noise"] if isinstance(row["noise"], str) else ""
    each = tuple(row["each"]) if isinstance(row["each"], list) else ()
    return Value(row["value"], row["low"], row["high"], int(row["repeats"]), row["unit"], row["origin"], noise, each)


def values_by(rows: pandas.DataFrame, name: Callable[[pandas.Series], Any]) -> dict[Any, Value]:
    """The values of rows, each by its name."""
    return {name(row): value_of(row) for _, row in rows.iterrows()}


def read(folder: str | pathlib.Path) -> Run:
    folder = pathlib.Path(folder)
    try:
        info = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        results = pandas.read_json(folder / "results.jsonl", lines=True, dtype=False)
    except (OSError, ValueError) as error:
        raise ResultsError(f"'{folder}' has no results of an experiment: {error}") from None
    for name in [*TEXTS, *NUMBERS, "each"]:
        if name not in results:
            results[name] = None
    for name in NUMBERS:
        results[name] = pandas.to_numeric(results[name])
    if not (results["version"] == VERSION).all():
        raise ResultsError(f"'{folder}' has results of version {results['version'].max()}; this program reads version {VERSION}")
    return Run(results, info, folder)
