#!/usr/bin/env python3
"""Checks that every file includes only headers of targets that its own target links, that renderers do not link each other, and that no
two headers define types of one name in one namespace, which a program that links both would mix up.

    check_includes.py ROOT TARGETS

TARGETS is written by SlabstreamIncludeCheck.cmake. A file may use what its target links, what those targets link publicly, and so
on. A header that other targets include may use only what its target links publicly. A header belongs to the target that compiles
the source of the same name; if none does, to the targets of its folder, or of the next folder above that has any. Headers without
a source below tests/ belong to whoever includes them. Headers of SEALED libraries, which take long to compile, are for one target. A
renderer is a folder of common/renderers or worker/renderers. Prints a line for each violation; exit status 1 if there is any.
"""
import re
import sys
from pathlib import Path

INCLUDE = re.compile(r'\s*#\s*include\s*"([^"]+)"')
# Folder of headers: the target that may include them.
SEALED = {
    "CLI": "slabstream_cli",
    "boost/beast": "slabstream_http",
    "nlohmann": "slabstream_json",
    "oneapi/tbb": "slabstream_parallel",
    "tbb": "slabstream_parallel",
}
SEALED_INCLUDE = re.compile(rf'\s*#\s*include\s*<(({"|".join(SEALED)})[/.][^>]*)>')
NAMESPACE = re.compile(r"namespace (\S+) {")
TYPE = re.compile(r"(?:class|struct|enum class) ([A-Z]\w*)\b(?!::|;)")
GENERATED = "slabstream/v1/"  # headers made from the folder proto


class Target:
    def __init__(self, line, root):
        self.name, folder, sources, links, interface = line.split("|")
        self.folder = Path(folder).relative_to(root)
        self.sources = {self.folder / source for source in sources.split(";") if source and not Path(source).is_absolute()}
        self.public = names(interface)  # without $<LINK_ONLY:...>, the private links of a static library
        self.links = names(links) | self.public

    def renderer(self):
        """None: the target is no half of a renderer."""
        above, name = self.folder.parent, self.folder.name
        return name if above in (Path("common/renderers"), Path("worker/renderers")) else None


def names(links):
    return {link.replace("::", "_") for link in links.split(";") if link and "<" not in link}


class Check:
    def __init__(self, root, lines):
        self.root = root
        self.targets = {target.name: target for target in (Target(line, root) for line in lines)}
        files = {source for target in self.targets.values() for source in target.sources}
        folders = {target.folder for target in self.targets.values() if target.folder != Path(".")}
        files |= {header.relative_to(root) for folder in folders for header in (root / folder).rglob("*.h")}
        self.files = sorted(file for file in files if file.suffix in (".h", ".cpp") and (root / file).is_file())

    def owners(self, file):
        source = file.with_suffix(".cpp")
        found = {name for name, target in self.targets.items() if source in target.sources}
        folder = file.parent
        while not found and folder != Path(".") and file.parts[0] != "tests":
            found = {name for name, target in self.targets.items() if target.folder == folder}
            folder = folder.parent
        return found

    def usable(self, links):
        """These targets and all that they link publicly."""
        found, rest = set(), list(links)
        while rest:
            name = rest.pop()
            if name in self.targets and name not in found:
                found.add(name)
                rest.extend(self.targets[name].public)
        return found

    def includes(self, file):
        """Line number, text and owners of each header of ours."""
        for number, line in enumerate((self.root / file).read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if match and match.group(1).startswith(GENERATED):
                yield number, match.group(1), self.owners(Path("proto/generated.h"))
            elif match and (self.root / match.group(1)).is_file():
                yield number, match.group(1), self.owners(Path(match.group(1)))

    def sealed(self):
        for file in self.files:
            for number, line in enumerate((self.root / file).read_text().splitlines(), 1):
                match = SEALED_INCLUDE.match(line)
                if match and SEALED[match.group(2)] not in self.owners(file):
                    yield f"{file}:{number}: {match.group(1)} is for {SEALED[match.group(2)]} alone"

    def linked_renderers(self):
        halves = {name: target for name, target in self.targets.items() if target.renderer()}
        for name, target in halves.items():
            for link in sorted(target.links & halves.keys()):
                if halves[link].renderer() != target.renderer():
                    yield f"{target.folder}: {name} links {link}, which is of another renderer"

    def repeated_types(self):
        first = {}
        for file in (file for file in self.files if file.suffix == ".h" and file.parts[0] not in ("tests", "bench")):
            within = []
            for line in (self.root / file).read_text().splitlines():
                if namespace := NAMESPACE.match(line):
                    within.append(namespace.group(1))
                elif found := TYPE.match(line):
                    name = "::".join((*within, found.group(1)))
                    if first.setdefault(name, file) != file:
                        yield f"{file}: {name} is a type of {first[name]}, too"

    def violations(self):
        yield from self.linked_renderers()
        yield from self.repeated_types()
        yield from self.sealed()
        shared = {text for file in self.files for _, text, of in self.includes(file) if not self.owners(file) & of}
        for file in self.files:
            own = self.owners(file)
            links = [t.public if str(file) in shared else t.links for t in (self.targets[name] for name in own)]
            usable = [self.usable(some) for some in links]
            for number, text, of in self.includes(file):
                if own and of and not of & own and not any(of & some for some in usable):
                    publicly = " publicly" if str(file) in shared else ""
                    yield f"{file}:{number}: {text} is of {'/'.join(sorted(of))}, which {'/'.join(sorted(own))} does not link{publicly}"


def main():
    check = Check(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).read_text().splitlines())
    found = list(check.violations())
    print("\n".join(found) or f"{len(check.files)} files include only what their targets link")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
