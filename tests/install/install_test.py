"""What `cmake --install` makes, and what others can do with it: a list of files, components, symbols, and the examples.

    install_test.py CMAKE BUILD LIB VERSION [unittest arguments]

BUILD: a build with all programs. LIB: the folder of libraries in a prefix, such as lib. VERSION: of the project.
"""
from __future__ import annotations

import fnmatch
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python"))
from client_support import read_png  # noqa: E402

CMAKE, BUILD, LIB, VERSION = (sys.argv[1:5] + [""] * 4)[:4]
PROGRAMS = ("slabstream", "slabstream-coordinator", "slabstream-dicom-decoder", "slabstream-gateway", "slabstream-laboratory", "slabstream-worker")
EXAMPLES = "share/doc/slabstream/examples"
CLIENTS = ("cmake", "pkgconfig", "python", "curl")


def run(*command: object) -> str:
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(str(word) for word in command)}: exit status {done.returncode}\n{done.stdout}")
    return done.stdout


def expected() -> list[tuple[str, str]]:
    """(component, pattern)"""
    lines = [line.split() for line in (HERE / "files.txt").read_text().splitlines() if not line.startswith("#")]
    for place, text in (("LIB", LIB), ("VERSION", VERSION), ("MAJOR", VERSION.split(".")[0])):
        lines = [[component, re.sub(rf"\b{place}\b", text, path)] for component, path in lines]
    return [(component, path) for component, path in lines]


def files_in(folder: pathlib.Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        made = tempfile.TemporaryDirectory(prefix="slabstream-install-")
        cls.addClassCleanup(made.cleanup)
        cls.folder = pathlib.Path(made.name)
        cls.prefix = cls.folder / "prefix"
        run(CMAKE, "--install", BUILD, "--prefix", cls.prefix, "--strip")

    def check_files(self, prefix: pathlib.Path, patterns: list[str]) -> None:
        files = files_in(prefix)
        self.assertEqual([file for file in files if not any(fnmatch.fnmatchcase(file, pattern) for pattern in patterns)], [], "not expected")
        self.assertEqual([pattern for pattern in patterns if not fnmatch.filter(files, pattern)], [], "missing")

    def new_folder(self) -> pathlib.Path:
        return pathlib.Path(tempfile.mkdtemp(dir=self.folder))

    def test_files_are_those_of_the_list(self) -> None:
        self.check_files(self.prefix, [pattern for _, pattern in expected()])

    def test_each_component_has_its_files(self) -> None:
        for component in dict(expected()):
            with self.subTest(component=component):
                prefix = self.new_folder()
                run(CMAKE, "--install", BUILD, "--prefix", prefix, "--component", component)
                self.check_files(prefix, [pattern for other, pattern in expected() if other == component])

    def test_programs_are_stripped(self) -> None:
        for program in PROGRAMS:
            self.assertNotIn(".symtab", run("readelf", "--wide", "--sections", self.prefix / "bin" / program), program)

    def test_servers_need_no_openimageio(self) -> None:
        for program in ("slabstream-coordinator", "slabstream-worker"):
            self.assertNotIn("OpenImageIO", run("ldd", self.prefix / "bin" / program), program)

    def test_library_exports_its_namespace_and_the_interface_in_c(self) -> None:
        version = f"SLABSTREAM_{VERSION.split('.')[0]}"
        library = self.prefix / LIB / "libslabstream.so"
        symbols = [line.split(maxsplit=2)[2] for line in run("nm", "--dynamic", "--defined-only", library).splitlines()]
        self.assertIn(version, symbols)
        for symbol in symbols:
            self.assertRegex(symbol, rf"^({version}|slabstream_insitu_\w+@@{version}|_Z(TI|TS|TV|NK|N)?N?10slabstream2v0\w+@@{version})$")

    def test_headers_include_the_standard_library_alone(self) -> None:
        for header in ("slabstream/client.h", "slabstream_insitu.h"):
            for name in re.findall(r"^#include (.*)", (self.prefix / "include" / header).read_text(), re.MULTILINE):
                self.assertRegex(name, r"^<[a-z]+(int\.h)?>$")

    def test_nothing_names_the_folders_of_the_build(self) -> None:
        source = re.search(r"^CMAKE_HOME_DIRECTORY:INTERNAL=(.*)$", (pathlib.Path(BUILD) / "CMakeCache.txt").read_text(), re.MULTILINE).group(1)
        for file in files_in(self.prefix):
            if re.search(r"\.(cmake|pc|h)$", file):
                text = (self.prefix / file).read_text()
                self.assertNotIn(source, text, file)
                self.assertNotIn(str(self.prefix), text, file)

    def check_pictures(self, folder: pathlib.Path) -> None:
        picture = (folder / "commandline.png").read_bytes()
        for client in CLIENTS:
            file = folder / f"{client}.png"
            if client == "curl" and not shutil.which("curl"):
                print("skipped: the example with curl, which is missing")
            elif client == "python":
                self.assertTrue((read_png(file.read_bytes()) == read_png(picture)).all(), client)
            else:
                self.assertEqual(file.read_bytes(), picture, client)

    def test_owners_in_c_and_fortran_show_the_same_field(self) -> None:
        folder = self.new_folder()
        said = run(HERE / "owners.sh", self.prefix, LIB, HERE, folder)
        pictures = sorted(path.name for path in folder.glob("*.png"))
        self.assertEqual(pictures, ["c.png", "fortran.png"] if shutil.which("gfortran") else ["c.png"], said)
        if len(pictures) == 1:
            print("skipped: an owner in Fortran, because gfortran is missing")
        pixels = [read_png((folder / picture).read_bytes()) for picture in pictures]
        self.assertGreater(pixels[0][..., 3].max(), 100)
        self.assertTrue((pixels[0] == pixels[-1]).all())

    def test_examples_make_the_picture_of_the_command_line(self) -> None:
        folder = self.new_folder()
        said = run(HERE / "use_installed.sh", self.prefix, LIB, EXAMPLES, sys.executable, folder)
        self.assertIn('picture: no dataset "nothing"', said)
        self.check_pictures(folder)

    def test_examples_work_in_a_bare_root(self) -> None:
        unshare = ["unshare", "--mount", "--pid", "--fork", "--map-root-user"]
        if subprocess.run([*unshare, "mount", "-t", "tmpfs", "none", "/mnt"], capture_output=True).returncode != 0:
            self.skipTest("no mount namespaces: needs root, or user namespaces")
        folder = self.new_folder()
        shutil.copy(HERE / "use_installed.sh", folder)
        run(*unshare, HERE / "in_bare_root.sh", self.new_folder(), self.prefix, folder,
            "/work/use_installed.sh", "/opt/slabstream", LIB, EXAMPLES, sys.executable, "/work")  # fmt: skip
        self.check_pictures(folder)


if __name__ == "__main__":
    del sys.argv[1:5]
    unittest.main()
