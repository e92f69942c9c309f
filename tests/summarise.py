#!/usr/bin/env python3
"""Says what a run of ctest came to. The last line is `90 passed, 0 failed, 3 skipped`, where ctest's tests are counted; the line before
it names all that was skipped, and why: tests of ctest, and single tests of programs that otherwise ran.

    summarise.py FILE       FILE: what `ctest --output-junit FILE --test-output-size-passed 1000000` wrote
"""
import re
import sys
from xml.etree import ElementTree

# What GoogleTest and `python -m unittest -v` print of a test that skips itself, and what our Python programs print before exit status 77.
GOOGLE_TEST = re.compile(r": Skipped\n(?P<why>[^\n]*)\n+\[  SKIPPED \] (?P<name>\S+)")
UNITTEST = re.compile(r"^(?P<name>\w+) \([^)]*\)(?:\n[^\n]*)? \.\.\. skipped (?P<quote>['\"])(?P<why>.*)(?P=quote)$", re.MULTILINE)
PROGRAM = re.compile(r"^skipped: (?P<why>.*)$", re.MULTILINE)


def skips(case, whole):
    """(name, why) of what one of ctest's tests skipped: all of it, or some of its own tests."""
    name, output = case.get("name"), case.findtext("system-out", "")
    if case.get("status") == "disabled":  # the build names it NAME_needs_PACKAGES
        test, needs, packages = re.match(r"(.*?)(_needs?_|$)(.*)", name).groups()
        return [(test, "needs " + packages.replace("_", ", ") if needs else "disabled")]
    found = [match.group("name", "why") for pattern in (GOOGLE_TEST, UNITTEST) for match in pattern.finditer(output)]
    if not whole:
        return [(f"{name}: {single}", why) for single, why in found]
    said = PROGRAM.search(output)
    return [(name, said["why"] if said else found[0][1] if found else "it does not say why")]


def main():
    passed, failed, skipped = 0, 0, []
    for case in ElementTree.parse(sys.argv[1]).getroot().iter("testcase"):
        left_out = case.find("skipped")  # also of programs that could not be started
        whole = case.get("status") == "disabled" or (left_out is not None and left_out.get("message", "").startswith("SKIP_"))
        passed += case.get("status") == "run"
        failed += case.get("status") != "run" and not whole
        skipped += skips(case, whole)
    if skipped:
        print(f"{len(skipped)} skipped: " + ", ".join(f"{name} ({why})" for name, why in skipped))
    print(f"{passed} passed, {failed} failed, {len(skipped)} skipped")


if __name__ == "__main__":
    main()
