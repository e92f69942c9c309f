"""MetaImage, NRRD and ITK's HDF5, NIfTI: random volumes that SimpleITK writes, of three and four dimensions."""
import os

import numpy as np
import SimpleITK

from case import LPS, Case, samples, turned


def cases(random, folder, count, skipped):
    for number in range(count):
        shape = tuple(int(side) for side in random.integers(2, 7, 3 + random.integers(2)))
        dtype = random.choice([np.uint8, np.int8, np.int16, np.uint16, np.int32, np.uint32, np.float32, np.float64])
        voxels = samples(random, shape, dtype)
        image = SimpleITK.GetImageFromArray(voxels, isVector=False)
        axes = len(shape)
        direction, spacing, origin = np.eye(axes), random.uniform(0.3, 4, axes), random.normal(scale=100, size=axes)
        direction[:3, :3] = turned(random)
        image.SetDirection(direction.ravel().tolist())
        image.SetSpacing(spacing.tolist())
        image.SetOrigin(origin.tolist())
        affine = np.eye(4)
        affine[:3, :3] = direction[:3, :3] * spacing[:3]
        affine[:3, 3] = origin[:3]
        for end in [".mha", ".mhd", ".nrrd", ".nhdr"] + ([".h5", ".nii.gz"] if axes == 3 else []):
            path = os.path.join(folder, f"{number}{end}")
            SimpleITK.WriteImage(image, path, useCompression=bool(random.integers(2)))
            time = f"time={shape[0] - 1}" if axes == 4 else ""
            yield Case(f"random {number}{end}", path, (voxels[-1] if axes == 4 else voxels).transpose(2, 1, 0), LPS @ affine, time)
