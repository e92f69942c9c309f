"""MetaImage, NRRD and ITK's HDF5, NIfTI: random volumes that SimpleITK writes, of three and four dimensions."""
import os

import numpy as np
import SimpleITK

from case import LPS, Case, samples, turned


def by_hand(random, folder, number):
    """A MetaImage with the synonyms that MetaIO knows, and without letters."""
    voxels, spacing = samples(random, tuple(random.integers(2, 7, 3)), np.int16), random.uniform(0.3, 4, 3)

    def line(names, values):
        return f"{random.choice(names)} = {' '.join(repr(float(value)) for value in values)}\n"

    lines = [line(["Offset", "Position", "Origin"], random.normal(scale=100, size=3)), line(["ElementSpacing", "ElementSize"], spacing)]
    if random.random() < 0.8:
        lines.append(line(["TransformMatrix", "Rotation", "Orientation"], turned(random).ravel()))
    if random.random() < 0.5:
        lines.append(f"AnatomicalOrientation = {random.choice(['RAI', 'LPS', 'ASL'])}\n")
    random.shuffle(lines)
    path = os.path.join(folder, f"h{number}.mha")
    with open(path, "wb") as file:
        file.write(("ObjectType = Image\nNDims = 3\nBinaryData = True\n" + "".join(lines) + f"DimSize = {' '.join(map(str, voxels.shape))}\n"
                    "ElementType = MET_SHORT\nElementDataFile = LOCAL\n").encode() + voxels.tobytes("F"))
    image = SimpleITK.ReadImage(path)
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return Case(f"by hand {number}.mha", path, voxels, LPS @ affine)


def cases(random, folder, count, skipped):
    for number in range(count):
        yield by_hand(random, folder, number)
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
