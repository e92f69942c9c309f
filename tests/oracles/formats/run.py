#!/usr/bin/env python3
"""Holds the readers of volume files against other programs' (deploy/check formats).

Files that the packages of those programs carry, and files that they write here, are read by them and by `slabstream value`. Corners and
random voxels are asked for at the place in the world where the other program has them: so values, scales, axes, orientation and origin are
compared at once. A line for each family, and one for each file that differs. Exit status 1 if one did.
"""
import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

from case import Refused

FAMILIES = ["nifti", "dicom", "itk", "nrrd", "mrc", "tiff", "vtk", "hdf5", "xdmf"]
POINTS = 60


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="slabstream")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="default: the time")
    parser.add_argument("--family", action="append", choices=FAMILIES, help="only these; may be repeated")
    parser.add_argument("--random", type=int, default=20, metavar="COUNT", help="random files of a family (default 20)")
    parser.add_argument("--refused", action="store_true", help="a line for each file of a package that is refused, too")
    return parser.parse_args()


def run(program, *args):
    ran = subprocess.run([program, *args], capture_output=True, text=True, timeout=300, stdin=subprocess.DEVNULL, check=False)
    return ran.returncode, ran.stdout, (ran.stderr.strip().splitlines() or [""])[-1]


def voxels_of(case, random):
    """Corners, and some in between, each once."""
    last = np.array(case.voxels.shape[:3]) - 1
    corners = [last * [i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]
    return np.unique(np.array([*corners, *random.integers(0, last + 1, (POINTS, 3))]), axis=0)


def difference(program, case, random):
    """What is wrong with a file; "": nothing. A refusal begins with "refused: "."""
    source = f"{case.path}?{case.options}" if case.options else case.path
    if isinstance(case, Refused):
        status, _, line = run(program, "info", source)
        missing = [word for word in case.words if word not in line]
        return "is read" if status == 0 else f"the line lacks {missing}: {line}" if missing else ""
    wanted = voxels_of(case, random)
    places = (case.affine @ np.c_[wanted, np.ones(len(wanted))].T).T[:, :3]
    points = [word for place in places for word in ("--at", ",".join(repr(float(x)) for x in place))]
    status, out, line = run(program, "value", source, "--local", "--json", *points)
    if status != 0:
        return f"refused: {line}"
    for voxel, place, sample in zip(wanted, places, json.loads(out)):
        value = case.voxels[tuple(voxel)]
        if not sample["inside"]:
            return f"voxel {voxel.tolist()} at {place.tolist()} is outside the volume"
        got = np.nan if sample["value"] is None else sample["value"]
        exact = np.issubdtype(case.voxels.dtype, np.integer)
        same = int(got) == int(value) if exact and np.isfinite(got) else np.isclose(got, float(value), rtol=case.tolerance, atol=1e-30, equal_nan=True)
        if not same:
            return f"voxel {voxel.tolist()} at {place.tolist()} is {got}, must be {value}"
    return ""


def main():
    options = arguments()
    failed = 0
    print(f"seed {options.seed}", flush=True)
    for family in options.family or FAMILIES:
        random = np.random.default_rng([options.seed, FAMILIES.index(family)])
        compared, refused, wrong, skipped = 0, [], [], []
        with tempfile.TemporaryDirectory() as folder:
            for case in importlib.import_module(f"{family}_files").cases(random, folder, options.random, skipped):
                said = difference(options.program, case, random)
                compared += 1
                # A file of a package may need what Slabstream does not read; one that is written here must be read.
                if said.startswith("refused: ") and not case.path.startswith(folder):
                    refused.append(f"{case.name}: {said[9:]}")
                elif said:
                    wrong.append(f"{case.name} {case.options}: {said}")
        print(f"{family:6} {compared} files, {len(wrong)} differ, {len(refused)} of packages are refused"
              + "".join(f"; skipped: {why}" for why in skipped), flush=True)
        for line in wrong + (refused if options.refused else []):
            print(f"  {line}")
        failed += len(wrong)
    print(f"{failed} differ")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
