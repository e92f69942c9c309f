"""Production code names no renderer: what differs between renderers is in their planning halves, and is asked there."""
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIST = ROOT / "common/renderers/CMakeLists.txt"
FOLDERS = ("client", "common", "coordinator", "data", "gateway", "proto", "python/slabstream", "simulator", "web/src", "worker")
SUFFIXES = {".cpp", ".h", ".proto", ".py", ".ts"}

# File, name: what the name means there. An entry that is no longer needed is an error.
ALLOWED = {
    ("client/cli/client_commands.cpp", "slice"): "a command",
    ("client/cli/help_pages.cpp", "slice"): "a command",
    ("common/stats/report.cpp", "splat"): "a stage",
    ("common/wire/own_codecs.cpp", "slice"): "a field of a message",
    ("data/volume_io/page_layout.cpp", "slice"): "a page of a volume",
    ("gateway/gateway.cpp", "slice"): "a command",
    ("gateway/openapi.cpp", "slice"): "a command",
    ("gateway/page_message.cpp", "slice"): "a kind of picture",
    ("python/slabstream/drafts.py", "slice"): "a command",
    ("python/slabstream/image.py", "splat"): "a stage",
    ("python/slabstream/image.py", "zbuffer"): "a stage",
    ("python/slabstream/loading.py", "slice"): "a command",
    ("python/slabstream/options.py", "slice"): "a command",
    ("python/slabstream/service.py", "slice"): "a command",
    ("python/slabstream/volumes.py", "slice"): "an axis of a volume",
    ("web/src/session.ts", "slice"): "a kind of picture",
    ("web/src/slices.ts", "slice"): "a kind of picture",
}


def renderers():
    return re.search(r"^set\(SLABSTREAM_RENDERERS (.+)\)$", LIST.read_text(), re.MULTILINE).group(1).split()


def named_in(file, names):
    """The renderers that the code of a file names: as a text, by the namespace, or by the folder of an include."""
    code = re.sub(r"(?<!:)//.*" if file.suffix != ".py" else r"#.*", "", file.read_text())
    found = re.findall(rf"""(["'`])({names})\1|\b({names})::|renderers/({names})/""", code)
    own = file.relative_to(ROOT).parts[2] if file.relative_to(ROOT).parts[1] == "renderers" else None
    return {name for match in found for name in match[1:] if name} - {own}


class RendererNames(unittest.TestCase):
    maxDiff = None

    def test_production_code_names_no_renderer(self):
        names = "|".join(renderers())
        files = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*") if file.suffix in SUFFIXES]
        self.assertGreater(len(files), 500)
        found = {(str(file.relative_to(ROOT)), name) for file in files for name in named_in(file, names)}
        self.assertEqual(sorted(found - ALLOWED.keys()), [])
        self.assertEqual(sorted(ALLOWED.keys() - found), [], "no longer needed")


if __name__ == "__main__":
    unittest.main()
