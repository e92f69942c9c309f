"""The page's modules (web/src) form no circle of imports, so each can be read after those that it imports."""
from __future__ import annotations

import graphlib
import pathlib
import re
import unittest

SOURCES = pathlib.Path(__file__).resolve().parents[2] / "web" / "src"


def imports(text: str) -> set[str]:
    """Names of the modules beside this one that a module imports or exports from, types included."""
    return set(re.findall(r'\bfrom "\./(\w+)"', text))


class Imports(unittest.TestCase):
    def test_modules_form_no_circle(self) -> None:
        modules = {path.stem: imports(path.read_text(encoding="utf-8")) for path in SOURCES.glob("*.ts")}
        self.assertGreater(len(modules["mount"]), 10)
        try:
            graphlib.TopologicalSorter(modules).prepare()
        except graphlib.CycleError as error:
            self.fail(" imports ".join(reversed(error.args[1])))


if __name__ == "__main__":
    unittest.main()
