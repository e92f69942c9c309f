"""MRC: random volumes that mrcfile writes."""
import os

import mrcfile
import numpy as np

from case import Case, samples, scaled


def cases(random, folder, count, skipped):
    for number in range(count):
        stack = random.random() < 0.3
        voxels = samples(random, tuple(random.integers(2, 7, 4 if stack else 3)),
                         random.choice([np.int8, np.int16, np.uint16, np.float32, np.float16]))
        spacing, end = random.uniform(0.5, 3), random.choice([".mrc", ".map", ".mrcs", ".st", ".ali", ".rec"])
        path = os.path.join(folder, f"{number}{end}")
        with mrcfile.new(path) as file:
            file.set_data(voxels)
            file.voxel_size = spacing
            spacing = float(file.voxel_size.x)
        part = voxels[-1] if stack else voxels
        yield Case(f"random {number}{end} {voxels.dtype}", path, part.transpose(2, 1, 0), scaled([spacing] * 3),
                   f"time={len(voxels) - 1}" if stack else "")
