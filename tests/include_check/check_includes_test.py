"""The include check finds what it should: planted violations in a small tree of its own."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).parents[2] / "cmake" / "check_includes.py"


class CheckIncludes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def write(self, name, text=""):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text)

    def check(self, *targets):
        """Each target: name, folder, sources, what it links publicly, what privately."""
        lines = []
        for name, folder, sources, public, private in targets:
            only = [f"$<LINK_ONLY:{link}>" for link in private]
            lines.append("|".join([name, str(self.root / folder), ";".join(sources), ";".join(public + private), ";".join(public + only)]))
        (self.root / "targets.txt").write_text("\n".join(lines))
        done = subprocess.run([sys.executable, CHECK, self.root, self.root / "targets.txt"], capture_output=True, text=True, check=False)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout

    def tree(self, top_links, middle_private=()):
        self.write("base/base.h")
        self.write("base/base.cpp", '#include "base/base.h"\n')
        self.write("middle/middle.h")
        self.write("middle/middle.cpp", '#include "middle/middle.h"\n#include <vector>\n#include "base/base.h"\n')
        self.write("top/top.cpp", '#include "middle/middle.h"\n\n#include "base/base.h"\n')
        public = [] if middle_private else ["x::base"]
        return self.check(("x_base", "base", ["base.cpp"], [], []), ("x_middle", "middle", ["middle.cpp"], public, list(middle_private)),
                          ("x_top", "top", ["top.cpp"], top_links, []))

    def test_links_and_their_public_links_may_be_used(self):
        self.assertEqual(self.tree(["x::middle"])[0], 0)
        self.assertEqual(self.tree(["x::middle", "x::base"], ["x::base"])[0], 0)

    def test_what_is_not_linked_may_not(self):
        status, text = self.tree([])
        self.assertEqual(status, 1)
        self.assertIn("top/top.cpp:1: middle/middle.h is of x_middle, which x_top does not link", text)

    def test_private_links_of_links_may_not(self):
        status, text = self.tree(["x::middle"], ["x::base"])
        self.assertEqual(status, 1)
        self.assertEqual(text, "top/top.cpp:3: base/base.h is of x_base, which x_top does not link\n")

    def test_the_header_of_a_sealed_library_is_for_one_target(self):
        self.write("json/json.cpp", "#include <nlohmann/json.hpp>\n")
        self.write("top/top.cpp", "#include <vector>\n#include <nlohmann/json_fwd.hpp>\n")
        status, text = self.check(("slabstream_json", "json", ["json.cpp"], [], []), ("x_top", "top", ["top.cpp"], [], []))
        self.assertEqual(status, 1)
        self.assertEqual(text, "top/top.cpp:2: nlohmann/json_fwd.hpp is for slabstream_json alone\n")

    def test_a_header_that_others_include_needs_public_links(self):
        self.write("base/base.h")
        self.write("middle/middle.h", '#include "base/base.h"\n')
        self.write("middle/middle.cpp", '#include "middle/middle.h"\n')
        self.write("top/top.cpp", "")
        targets = (("x_base", "base", [], [], []), ("x_middle", "middle", ["middle.cpp"], [], ["x::base"]),
                   ("x_top", "top", ["top.cpp"], ["x::middle"], []))
        self.assertEqual(self.check(*targets)[0], 0)
        self.write("top/top.cpp", '#include "middle/middle.h"\n')
        status, text = self.check(*targets)
        self.assertEqual(status, 1)
        self.assertIn("middle/middle.h:1: base/base.h is of x_base, which x_middle does not link publicly", text)

    def test_a_header_without_source_belongs_to_its_folder(self):
        self.write("base/inner/only.h")
        self.write("top/top.cpp", '#include "base/inner/only.h"\n')
        self.assertEqual(self.check(("x_base", "base", [], [], []), ("x_top", "top", ["top.cpp"], [], []))[0], 1)

    def test_threads_are_shared_out_by_one_target(self):
        self.write("loops/loops.h")
        self.write("loops/loops.cpp", "#include <tbb/parallel_for.h>\n")
        self.write("top/top.cpp", '#include <oneapi/tbb.h>\n#include "loops/loops.h"\n')
        status, text = self.check(("slabstream_parallel", "loops", ["loops.cpp"], [], []),
                                  ("x_top", "top", ["top.cpp"], ["slabstream::parallel"], []))
        self.assertEqual(status, 1)
        self.assertEqual(text, "top/top.cpp:1: oneapi/tbb.h is for slabstream_parallel alone\n")

    def test_renderers_do_not_link_each_other(self):
        self.write("worker/renderers/fog/fog.cpp")
        for kind, links in (("common/renderers/fog", ["x::shared"]), ("common/renderers/rain", []), ("worker/renderers/snow", [])):
            half = (f"x_{kind.replace('/', '_')}", kind, [], [], [])
            fog = ("x_fog", "worker/renderers/fog", ["fog.cpp"], links, [half[0].replace("x_", "x::", 1)])
            status, text = self.check(half, fog, ("x_shared", "worker/rays", [], [], []))
            other = not kind.endswith("fog")
            self.assertEqual(status, int(other), text)
            self.assertEqual(text == f"worker/renderers/fog: x_fog links {half[0]}, which is of another renderer\n", other)


if __name__ == "__main__":
    unittest.main()
