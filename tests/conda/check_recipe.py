#!/usr/bin/env python3
"""Renders the recipe of deploy/conda and compares it with the sources: the version, and a package for each library (deploy/check conda)."""
from __future__ import annotations

import pathlib
import re
import unittest

import rattler_build

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECIPE = ROOT / "deploy" / "conda"
PLATFORMS = ("linux-64", "linux-aarch64")

# What CMake looks for -> the package of conda-forge that has it. None: every compiler or build environment has it.
PACKAGES = {
    "Threads": None, "PkgConfig": "pkg-config", "cppzmq": "cppzmq", "OpenSSL": "openssl", "Boost": "libboost-headers",
    "Protobuf": "libprotobuf", "CLI11": "cli11", "spdlog": "spdlog", "fmt": "fmt", "nlohmann_json": "nlohmann_json",
    "zstd": "zstd", "Eigen3": "eigen", "hwy": "libhwy", "TBB": "tbb-devel", "TIFF": "libtiff", "PNG": "libpng",
    "JPEG": "libjpeg-turbo", "EXPAT": "libexpat", "Freetype": "freetype", "ZLIB": "zlib", "BZip2": "bzip2",
    "LibLZMA": "liblzma-devel", "BROTLI": "brotli", "OPENJPEG": "openjpeg", "CURL": "libcurl", "BLOSC": "blosc",
    "ISAL": "isa-l", "LZ4": "lz4-c", "LZF": "liblzf", "ZIP": "libzip", "HDF5": "hdf5", "XXHASH": "xxhash", "OIIO": "openimageio",
    "WEBP": "libwebp-base", "CAIRO": "cairo",
    "GDCM_INCLUDE_DIR": "gdcm", "GDCM_${part}": "gdcm",
}  # fmt: skip


def wanted() -> set[str]:
    """What CMake looks for to build the programs: tests and benchmarks come last in the file, behind `if`."""
    text = (ROOT / "cmake" / "SlabstreamDependencies.cmake").read_text()
    return set(re.findall(r"^ *(?:find_\w+|pkg_check_modules)\((\S+)", text[: text.index("if(SLABSTREAM_TESTS)")], re.MULTILINE))


def rendered(platform: str) -> dict[str, rattler_build.Stage1Recipe]:
    """The packages by name."""
    variants = rattler_build.VariantConfig.from_file(RECIPE / "variants.yaml")
    config = rattler_build.RenderConfig(platform=rattler_build.PlatformConfig(target_platform=platform))
    recipe = rattler_build.Stage0Recipe.from_file(RECIPE / "recipe.yaml")
    return {variant.recipe.package.name: variant.recipe for variant in recipe.render(variants, config)}


class Recipe(unittest.TestCase):
    def test_each_library_has_its_package(self) -> None:
        self.assertEqual(wanted(), set(PACKAGES), "PACKAGES is the list of what CMake looks for")
        for platform in PLATFORMS:
            needs = rendered(platform)["slabstream"].requirements.to_dict()
            named = {need.split()[0] for need in needs["build"] + needs["host"]}
            self.assertEqual({package for package in PACKAGES.values() if package} - named, set(), platform)

    def test_the_version_is_the_projects(self) -> None:
        version = re.search(r"^project\(slabstream VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
        for platform in PLATFORMS:
            self.assertEqual({name: str(recipe.package.version) for name, recipe in rendered(platform).items()},
                             {"slabstream": version, "python-slabstream": version})  # fmt: skip

    def test_python_needs_what_pip_installs(self) -> None:
        listed = re.search(r"^dependencies = \[(.*)\]", (ROOT / "python" / "pyproject.toml").read_text(), re.MULTILINE)[1]
        dependencies = {name.replace(">=", " >=") for name in re.findall(r'"([^"]+)"', listed)}
        runs = rendered(PLATFORMS[0])["python-slabstream"].requirements.to_dict()["run"]
        self.assertEqual(dependencies - {need for need in runs if isinstance(need, str)}, set())


if __name__ == "__main__":
    unittest.main()
