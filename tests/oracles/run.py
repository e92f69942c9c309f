#!/usr/bin/env python3
"""Holds the readers and writers of chunked volumes against other programs' (deploy/check stores).

Other programs write volumes, and each is read at all of its levels, in boxes of a random size; `slabstream convert` writes volumes, and
others read them. Voxels are compared exactly: samples of 8 and 16 bits as their values, wider ones rounded to float32, as they are kept.
A line for each family of cases, and one for each case that fails, with its command. Exit status 1 if one did.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

import hdf5_cases
import n5_cases
import ome_zarr_cases
import precomputed_cases
import s3_cases
import tiff_cases
import written_cases
import zarr_cases

FAMILIES = {"zarr": zarr_cases, "ome-zarr": ome_zarr_cases, "hdf5": hdf5_cases, "n5": n5_cases, "precomputed": precomputed_cases,
            "tiff": tiff_cases, "s3": s3_cases}
EVERY = 8  # so many cases apart the program itself converts one, too


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="slabstream")
    parser.add_argument("--reader", required=True, help="the program of read_levels.cpp")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="default: the time")
    parser.add_argument("--random", type=int, default=60, metavar="COUNT",
                        help="random cases of a family beside the fixed ones (default 60)")
    parser.add_argument("--family", action="append", choices=[*FAMILIES, "written"], help="only these; may be repeated")
    parser.add_argument("--keep", action="store_true", help="leave the files of cases that pass, too")
    return parser.parse_args()


class Reader:
    def __init__(self, program, folder):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.output = os.path.join(folder, "read")

    def read(self, source, box):
        """The answer, and the voxels of each level as values."""
        self.process.stdin.write(json.dumps({"source": source, "output": self.output, "box": box}) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            return {"error": f"the reader ended with status {self.process.wait()}"}, []
        answer = json.loads(line)
        levels = []
        for number, level in enumerate(answer.get("levels", [])):
            stored = np.fromfile(f"{self.output}.{number}", level["type"]).reshape(level["size"][::-1])
            levels.append(stored if level["type"] == "float32" else stored * level["scale"] + level["offset"])
        return answer, levels


def as_kept(array):
    """Wider samples become float32."""
    small = array.dtype == bool or (array.dtype.kind in "iu" and array.dtype.itemsize <= 2)
    return array.astype("float64" if small else "float32")


def difference(number, found, expected):
    expected = as_kept(expected)
    if found.shape != expected.shape:
        return f"level {number} is {found.shape}, must be {expected.shape} (z, y, x)"
    if np.array_equal(found, expected, equal_nan=True):
        return None
    wrong = np.argwhere(~((found == expected) | (np.isnan(found) & np.isnan(expected))))
    at = tuple(wrong[0])
    place = [int(i) for i in at[::-1]]
    return f"level {number}: {len(wrong)} voxels differ, the first at {place} (x, y, z): {found[at]}, must be {expected[at]}"


def what_is_wrong(case, answer, levels):
    """None: nothing."""
    error = answer.get("error")
    if case.refused:
        return None if error and case.refused in error and "\n" not in error else f"must be refused with '{case.refused}', but: {error}"
    if error:
        return error
    if len(levels) != len(case.levels):
        return f"has {len(levels)} levels, must have {len(case.levels)}"
    for number, (found, expected) in enumerate(zip(levels, case.levels)):
        if wrong := difference(number, found, expected):
            return wrong
    for key, expected in (("spacing", case.spacing), ("origin", case.origin)):
        found = [level[key] for level in answer["levels"]]
        if expected is not None and not np.allclose(found, expected, rtol=1e-6, atol=1e-6):
            return f"{key} is {found}, must be {expected}"
    return None


def converted(program, case, folder):
    """What is wrong with the finest level as the program converts it."""
    path = os.path.join(folder, "converted.npy")
    done = subprocess.run([program, "convert", case.source, path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return f"convert: {done.stderr.strip()}"
    wrong = difference(0, as_kept(np.load(path)), case.levels[0])
    return f"convert: {wrong}" if wrong else None


def remove(path):
    if os.path.isdir(path):
        shutil.rmtree(path)
    elif os.path.exists(path):  # it is no address
        os.remove(path)


def run_family(name, a, folder, seed):
    """How many cases there were and failed."""
    os.mkdir(folder)
    random = np.random.default_rng(seed)
    count = failed = 0
    began = time.monotonic()
    if name == "written":
        results = written_cases.cases(a.program, folder, random)
    else:
        reader = Reader(a.reader, folder)
        def read_all():
            for number, case in enumerate(FAMILIES[name].cases(folder, random, a.random)):
                box = [int(side) for side in random.integers(1, 48, 3) + 16]
                wrong = what_is_wrong(case, *reader.read(case.source, box))
                if not wrong and not case.refused and number % EVERY == 0:
                    wrong = converted(a.program, case, folder)
                yield f"{case.name}: {case.source}", wrong
                if not wrong and not a.keep:
                    remove(case.source.split("?")[0].split("/labels/")[0])
        results = read_all()
    for title, wrong in results:
        count += 1
        if wrong:
            failed += 1
            print(f"  FAILED {name}: {title}: {wrong}", flush=True)
    print(f"{name:12s} {count:4d} cases, {failed} failed, {time.monotonic() - began:.0f} s", flush=True)
    return count, failed


def main():
    a = arguments()
    print(f"seed {a.seed} (--seed {a.seed} makes the same cases again)", flush=True)
    folder = tempfile.mkdtemp(prefix="slabstream-stores-")
    counts = [run_family(name, a, os.path.join(folder, name), a.seed) for name in a.family or [*FAMILIES, "written"]]
    cases, failed = (sum(numbers) for numbers in zip(*counts))
    if failed == 0 and not a.keep:
        shutil.rmtree(folder)
    else:
        print(f"the files are in {folder}")
    print(f"{cases} cases, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
