"""Documents name only what exists: files and folders, functions, types and fields, subcommands and options, and each other's sections."""
from __future__ import annotations

import fnmatch
import functools
import os
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *sorted((ROOT / "docs").rglob("*.md"))]
CODE = {".h", ".cpp", ".f90", ".py", ".ts", ".js", ".proto", ".cmake", ".txt", ".json", ".html", ".css", ".sh", ""}  # endings of files with names
TOOLS = {"slabstream", "slabstream-coordinator", "slabstream-worker", "slabstream-gateway", "slabstream-lab", "slabstream-laboratory"}

# What others name: Slurm, GDCM, FreeSurfer, Python, Catalyst, Ascent; and options of `unshare`, Google Benchmark, podman, kubectl, CMake
# and pkg-config.
FOREIGN = {
    "ConnectionError", "LookupError", "TimeoutError", "TypeError", "ValueError", "CancelledError",
    "GraceTime", "KillWait", "JobId", "StartTime", "FreeSurferColorLUT",
    "catalyst_initialize", "catalyst_execute", "catalyst_results", "catalyst_finalize", "ascent_ghosts",
}  # fmt: skip
FOREIGN_OPTIONS = {
    "--mount-proc", "--benchmark_filter", "--health-cmd", "--network", "--replicas", "--user", "--component", "--cflags", "--libs",
}  # fmt: skip
PREFIXES = "slabstream_|end_to_end_"  # that code puts before names: of metrics, of test programs


@functools.cache
def files() -> dict[str, str]:
    """Path from the root -> text, of all files but documents and what a build makes; of folders, '' and a path that ends in /."""
    found = {}
    for folder, folders, names in os.walk(ROOT):
        made = {f for f in folders if f.startswith("build-") or (ROOT / folder / f / "CMakeCache.txt").exists()} | {".git", "__pycache__", "node_modules"}
        folders[:] = [f for f in folders if f not in made]
        here = pathlib.Path(folder).relative_to(ROOT)
        found |= {f"{here / f}/": "" for f in folders}
        for name in names:
            path = here / name
            readable = path.suffix in CODE and (ROOT / path) not in DOCUMENTS and path != pathlib.Path(__file__).resolve().relative_to(ROOT)
            found[str(path)] = (ROOT / path).read_text(encoding="utf-8", errors="replace") if readable else ""
    return found


def words_in(text: str) -> set[str]:
    return set(re.findall(r"\w+", text))


@functools.cache
def units() -> dict[str, set[str]]:
    """Words by unit: a header and its source are one, without their endings."""
    found: dict[str, set[str]] = {}
    for path, text in files().items():
        found.setdefault(re.sub(r"(-inl)?\.(h|cpp)$", "", path), set()).update(words_in(text))
    return found


@functools.cache
def all_words() -> set[str]:
    return set().union(*units().values())


@functools.cache
def production() -> str:
    return "\n".join(text for path, text in files().items() if not path.startswith(("tests/", "docs/")))


def matching(path: str) -> list[str]:
    """Files or folders that a document may mean: from the root, or any that ends like it. NAME stands for any name."""
    pattern = re.sub(r"NAME", "*", path)
    if pattern in files():
        return [pattern]
    pattern = pattern.rstrip("/")
    return [f for f in files() if any(fnmatch.fnmatchcase(f.rstrip("/"), wanted) for wanted in (pattern, f"*/{pattern}"))]


def is_path(span: str) -> bool:
    if re.fullmatch(r"[\w.*<>-]+\.(h|cpp|ts|proto|cmake)", span):
        return True
    top = span.split("/")[0]
    return "/" in span and re.fullmatch(r"[\w.*<>/-]+", span) is not None and f"{top}/" in files()


def is_name(span: str) -> bool:
    """CamelCase, with_underscores, A::B, A.b, F(x): what no ordinary word looks like."""
    return re.fullmatch(r"[A-Za-z_][\w:.]*(\([\w&:, ]*\))?", span) is not None and bool(re.search(r"[a-z][A-Z]|::|_[a-z]|[A-Z]\w*\.", span))


def identifiers(span: str) -> set[str]:
    """The parts of a name that are no ordinary words."""
    ordinary = re.compile(r"[a-z]+|[A-Z]|\w*NAME|\w*_")
    return {word for word in re.findall(r"\w+", span) if not ordinary.fullmatch(word)} - FOREIGN


def exists(name: str) -> bool:
    """All its parts stand together in one unit."""
    whole = identifiers(name)
    wanted = {re.sub(f"^({PREFIXES})", "", word) for word in whole}
    wanted = {word for word in wanted if not word.islower() or "_" in word}
    return any(words.issuperset(wanted) or words.issuperset(whole) for words in units().values())


@functools.cache
def options() -> set[str]:
    """As they are typed; or, as options of requests may be made, fields of the schema and entries of a list, {"name", ...}."""
    fields = re.findall(r"\b([a-z_]+) = \d+", "\n".join(text for path, text in files().items() if path.endswith(".proto")))
    entries = re.findall(r'(?:\{|name(?: =|:) )"([a-z-]+)"', production())
    return set(re.findall(r"--[a-z][a-z-]*", production())) | {f"--{name.replace('_', '-')}" for name in fields + entries}


@functools.cache
def subcommands() -> set[str]:
    return set(re.findall(r'(?:AddCommand\(|DeclareAbout\(line,|Command = \{)\s*"([a-z-]+)"', production()))


class Text:
    """A document without its listings, and with them."""

    def __init__(self, path: pathlib.Path) -> None:
        self.name = str(path.relative_to(ROOT))
        self.text = path.read_text(encoding="utf-8")
        fenced = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
        self.prose = "\n".join(line for line in fenced.sub("", self.text).split("\n") if not line.startswith("    "))
        self.spans = [span.replace("\n", " ") for span in re.findall(r"`([^`]+)`", self.prose)]
        self.defined = set(re.findall(r"^def (\w+)", self.text, re.MULTILINE))  # by its own example
        self.listings = [line.strip() for line in fenced.sub("", self.text).split("\n") if line.startswith("    ")]

    def anchors(self) -> set[str]:
        headings = re.findall(r"^#+ (.*)$", self.text, re.MULTILINE)
        return {re.sub(r"[^\w\- ]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()).replace(" ", "-") for heading in headings}

    def commands(self) -> list[str]:
        """Command lines of our own programs."""
        lines = [line.split("#")[0] for line in self.listings] + self.spans
        parts = [part.strip() for line in lines for part in re.split(r"&&|\|| -- |\$\(", line)]
        ours = ("deploy/", "bench/", "build/bin/")
        return [part for part in parts if part.startswith(ours) or part.split() and part.split()[0] in TOOLS]


class Names(unittest.TestCase):
    def check(self, wrong: list[str]) -> None:
        self.assertEqual(wrong, [], "\n" + "\n".join(wrong))

    def test_files_and_folders_exist(self) -> None:
        self.check([f"{t.name}: {s}" for t in texts() for s in t.spans if is_path(s) and not s.startswith("build/") and not matching(s)])

    def test_functions_types_and_fields_exist(self) -> None:
        self.check([f"{t.name}: {s}" for t in texts() for s in t.spans
                    if is_name(s) and not is_path(s) and s not in t.defined and not exists(s)])  # fmt: skip

    def test_functions_are_in_the_files_that_are_named_with_them(self) -> None:
        """`A`, `B`, `file.cpp` and `file.cpp`: `A`, `B`: one file in a row of names is where they are."""
        wrong = []
        for t in texts():
            for row in re.findall(r"`[^`]+`(?:(?:, |: | in |,? and | \()`[^`]+`)+", t.prose.replace("\n", " ")):
                spans = re.findall(r"`([^`]+)`", row)
                paths = [s for s in spans if is_path(s) and s.endswith((".h", ".cpp"))]
                if len(paths) != 1 or "NAME" in paths[0]:
                    continue
                wanted = {word for s in spans if is_name(s) and not is_path(s) for word in identifiers(s)} - {"State", "Impl"}
                there = [units()[re.sub(r"(-inl)?\.(h|cpp)$", "", path)] for path in matching(paths[0])]
                if wanted and not any(words.issuperset(wanted) for words in there):
                    wrong.append(f"{t.name}: {paths[0]}: {sorted(wanted - set().union(*there))}")
        self.check(wrong)

    def test_options_exist(self) -> None:
        option = re.compile(r"(?:^|[\s\[(])(--[a-z][a-z_-]*)")
        ours = [(t.name, o) for t in texts() for s in t.spans + t.commands() for o in option.findall(s)]
        self.check(sorted({f"{name}: {option}" for name, option in ours if option not in FOREIGN_OPTIONS and option not in options()}))

    def test_subcommands_exist(self) -> None:
        self.check([f"{t.name}: {c}" for t in texts() for c in t.commands()
                    if (m := re.match(r"(?:build/bin/)?slabstream ([a-z][\w-]*)", c)) and m[1] not in subcommands()])

    def test_what_does_not_exist_is_found(self) -> None:
        self.assertEqual(matching("common/volume/no_such.h"), [])
        self.assertFalse(exists("FramePlan::NoSuchMember") or exists("no_such_field"))
        self.assertNotIn("--no-such-option", options())
        self.assertNotIn("no-such-subcommand", subcommands())
        self.assertTrue(matching("frame_plan.h") and exists("FramePlan") and "--frames" in options() and "render" in subcommands())

    def test_links_lead_somewhere(self) -> None:
        wrong = []
        for t in texts():
            here = (ROOT / t.name).parent
            for target in re.findall(r"\]\(([^)\s]+)\)", t.text):
                file, _, anchor = target.partition("#")
                if re.match(r"\w+:", target):
                    continue
                page = (here / file).resolve() if file else ROOT / t.name
                if not page.exists() or anchor and anchor not in Text(page).anchors():
                    wrong.append(f"{t.name}: {target}")
        self.check(wrong)


@functools.cache
def texts() -> list[Text]:
    return [Text(path) for path in DOCUMENTS]


if __name__ == "__main__":
    unittest.main()
