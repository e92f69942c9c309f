"""NRRD: random volumes that pynrrd writes: encodings, kinds of a fourth axis, spaces."""
import os

import nrrd
import numpy as np

from case import LPS, Case, Refused, samples, turned

SPACES = {"right-anterior-superior": np.eye(4), "left-posterior-superior": LPS, "left-anterior-superior": np.diag([-1.0, 1, 1, 1])}


def cases(random, folder, count, skipped):
    for number in range(count):
        space = random.choice(list(SPACES))
        extra = random.choice(["", "first", "last", "between"])
        shape = [int(side) for side in random.integers(2, 7, 3)]
        whole = {"": shape, "first": [4, *shape], "last": [*shape, 3], "between": [shape[0], 4, *shape[1:]]}[extra]
        voxels = samples(random, whole, random.choice([np.uint8, np.int16, np.uint16, np.float32, np.int32]))
        directions, origin = turned(random) * random.uniform(0.3, 4, (3, 1)), random.normal(scale=100, size=3)
        nan = np.full((1, 3), np.nan)
        header = {"space": space, "space origin": origin, "encoding": random.choice(["raw", "gzip", "bzip2"]),
                  "space directions": {"": directions, "first": np.r_[nan, directions], "last": np.r_[directions, nan],
                                       "between": np.r_[directions[:1], nan, directions[1:]]}[extra]}
        if extra in ("first", "last") and random.integers(2):
            header["kinds"] = {"first": ["vector"] + ["domain"] * 3, "last": ["domain"] * 3 + ["list"]}[extra]
        path = os.path.join(folder, f"{number}.nrrd")
        nrrd.write(path, voxels, header)
        if extra == "between":
            yield Refused(f"random {number}.nrrd", path, ("lies between axes of space",), "time=1")
            continue
        affine = np.eye(4)
        affine[:3, :3], affine[:3, 3] = directions.T, origin
        part, option = {"": (voxels, ""), "first": (voxels[-1] if extra == "first" else None, "channel=3"),
                        "last": (voxels[..., -1], "time=2")}[extra]
        yield Case(f"random {number}.nrrd {header['encoding']} {extra}", path, part, SPACES[space] @ affine, option)
