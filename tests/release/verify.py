"""Whether what deploy/release made is whole: verify.py DIST PYTHON

PYTHON has the packages of requirements.txt, beside this file. Checked are the sums; that each list of contents is valid SPDX; and that each
library in an image or a wheel belongs to a package of its list, whose licence text is there, too.
"""
from __future__ import annotations

import io
import json
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile

OWN = re.compile(r"(^|/)(libslabstream|slabstream)[^/]*$")


class Archive:
    """Files by path; and those that hold the list of contents, descriptions and licences."""

    def __init__(self, path: pathlib.Path, files: dict[str, bytes]):
        self.path, self.files = path, files

    def sbom(self) -> bytes:
        found = [name for name in self.files if name.endswith("slabstream.spdx.json")]
        assert len(found) == 1, f"{self.path.name}: lists of contents: {found}"
        return self.files[found[0]]

    def libraries(self) -> list[str]:
        return [name for name in self.files if re.search(r"\.so(\.[0-9.]+)?$", name) and self.files[name].startswith(b"\x7fELF")]


def image(path: pathlib.Path) -> Archive:
    files = {}
    with tarfile.open(path) as outer:
        names = json.load(outer.extractfile("./manifest.json"))  # type: ignore[arg-type]
        for layer in names[0]["Layers"]:
            with tarfile.open(fileobj=io.BytesIO(outer.extractfile(f"./{layer}").read())) as inner:  # type: ignore[union-attr]
                for member in inner:
                    if member.isfile():
                        files[member.name.removeprefix("./")] = inner.extractfile(member).read()  # type: ignore[union-attr]
    return Archive(path, files)


def wheel(path: pathlib.Path) -> Archive:
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return Archive(path, {name: archive.read(name) for name in archive.namelist()})


def owner_of(library: str) -> str:
    """The Debian package that this machine has it from. In an image it lies at the same place, in a wheel under the same name."""
    places = [f"/{library}", f"/{library}".replace("/usr/lib/", "/lib/"), f"*/{pathlib.PurePath(library).name}"]
    for place in places:
        said = subprocess.run(["dpkg-query", "--search", place], capture_output=True, text=True).stdout
        owners = [line.partition(": ")[0].partition(":")[0] for line in said.splitlines() if not line.startswith("diversion")]
        if owners:
            return owners[0]
    raise AssertionError(f"no package has {library}")


def check(archive: Archive, python: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "list.spdx.json")
        file.write_bytes(archive.sbom())
        subprocess.run([python, "-m", "spdx_tools.spdx.clitools.pyspdxtools", "--infile", str(file)], check=True)
    listed = {package["name"] for package in json.loads(archive.sbom())["packages"]}
    licensed = {pathlib.PurePath(name).parts[-2] for name in archive.files if name.endswith("/copyright")}
    libraries = [name for name in archive.libraries() if not OWN.search(name)]
    assert libraries, f"{archive.path.name} has no libraries"
    for library in libraries:
        owner = owner_of(library)
        assert owner in listed, f"{archive.path.name}: {library} is of package {owner}, which is not in the list of contents"
    missing = {name for name in listed if not name.startswith("slabstream")} - licensed
    assert not missing, f"{archive.path.name}: no licence text of {sorted(missing)}"
    print(f"{archive.path.name}: {len(libraries)} libraries of {len(listed) - 1} packages, all listed, with licences")


def main(dist: pathlib.Path, python: str) -> None:
    subprocess.run(["sha256sum", "--check", "--quiet", "--strict", "SHA256SUMS"], cwd=dist, check=True)
    images = sorted(dist.glob("*.oci.tar"))
    wheels = sorted(dist.glob("*manylinux*.whl"))
    assert len(images) == 2 and len(wheels) == 1, f"images: {images}, wheels: {wheels}"
    for path in images:
        check(image(path), python)
    for path in wheels:
        check(wheel(path), python)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), sys.argv[2])
