"""NIfTI and FreeSurfer: templates of Debian's mricron-data, the test files of nibabel, and headers at random; nibabel reads them."""
import glob
import os

import nibabel
import numpy as np

from case import Case, samples, turned

TEMPLATES = "/usr/share/mricron/templates/*.nii.gz"


def read(path, image=None):
    """Several times: the last one. Slabstream's axes are at right angles, so slanted files are left out."""
    image = image or nibabel.load(path)
    voxels, affine = np.asanyarray(image.dataobj), image.affine
    sides = affine[:3, :3] / np.linalg.norm(affine[:3, :3], axis=0)
    if np.abs(sides.T @ sides - np.eye(3)).max() > 1e-4 or voxels.dtype.fields or voxels.dtype.kind == "c":
        return None
    while voxels.ndim > 3 and voxels.shape[-1] == 1:
        voxels = voxels[..., 0]
    if voxels.ndim == 3:
        return Case(os.path.basename(path), path, voxels, affine)
    if voxels.ndim != 4:
        return None
    return Case(os.path.basename(path), path, voxels[..., -1], affine, f"time={voxels.shape[-1] - 1}")


def packaged(skipped):
    templates = sorted(glob.glob(TEMPLATES))
    if not templates:
        skipped.append("no mricron-data")
    data = os.path.join(os.path.dirname(nibabel.__file__), "tests", "data")
    for path in templates + sorted(glob.glob(data + "/*.nii") + glob.glob(data + "/*.nii.gz") + glob.glob(data + "/*.mg[hz]")):
        try:
            case = read(path)
        except Exception:  # nibabel's tests hold files that are wrong on purpose
            continue
        if case:
            yield case


def matrix(random):
    affine = np.eye(4)
    affine[:3, :3] = turned(random) * random.uniform(0.3, 4, 3) * random.choice([-1, 1], 3)
    affine[:3, 3] = random.normal(scale=100, size=3)
    return affine


def written(random, folder, number):
    kinds = [nibabel.Nifti1Image, nibabel.Nifti2Image, nibabel.Nifti1Pair, nibabel.Nifti2Pair]
    kind = kinds[random.integers(len(kinds))]
    shape = tuple(random.integers(2, 7, 3 + random.integers(2)))
    dtype = random.choice([np.uint8, np.int16, np.int32, np.float32, np.float64, np.int8, np.uint16, np.uint32])

    image = kind(samples(random, shape, dtype), matrix(random), dtype=dtype)
    image.header.set_data_dtype(np.dtype(dtype).newbyteorder(random.choice(["<", ">"])))
    image.set_sform(matrix(random), int(random.integers(0, 5)))
    image.set_qform(matrix(random), int(random.integers(0, 5)))
    if random.random() < 0.3 and np.issubdtype(dtype, np.integer):
        image.header.set_slope_inter(0.5, -3)
    end = random.choice([".nii", ".nii.gz"]) if kind in kinds[:2] else ".img"
    path = os.path.join(folder, f"{number}{end}")
    nibabel.save(image, path)
    case = read(path, nibabel.load(path))
    if not image.header["sform_code"] and not image.header["qform_code"]:
        return None  # without a matrix programs choose an origin as they like
    return case and Case(f"random {number}{end} sform {image.header['sform_code']} qform {image.header['qform_code']}", *list(vars(case).values())[1:])


def qforms(random, folder, number):
    """A header whose fields are not quite right, and, of a header with both matrices, the other one."""
    voxels = samples(random, tuple(random.integers(2, 7, 3)), np.int16)
    image = nibabel.Nifti1Image(voxels, None)
    image.header.set_qform(matrix(random), 1)
    path = os.path.join(folder, f"q{number}.nii")
    nibabel.save(image, path)
    with open(path, "r+b") as file:
        for i in range(4):
            if random.random() < 0.4:
                file.seek(76 + 4 * i)  # pixdim
                file.write(np.float32(0 if i == 0 or random.random() < 0.5 else -random.uniform(1, 3)).tobytes())
    yield Case(f"odd pixdim {number}", path, voxels, nibabel.load(path).affine)
    image.set_sform(matrix(random), 4)
    path = os.path.join(folder, f"b{number}.nii")
    nibabel.save(image, path)
    yield Case(f"both matrices {number}", path, voxels, nibabel.load(path).header.get_qform(), "matrix=qform")


def surfer(random, folder, number):
    image = nibabel.MGHImage(samples(random, tuple(random.integers(2, 7, 3)), np.int16).astype(np.float32), matrix(random))
    path = os.path.join(folder, f"s{number}{random.choice(['.mgh', '.mgz'])}")
    nibabel.save(image, path)
    return read(path)


def cases(random, folder, count, skipped):
    yield from packaged(skipped)
    for number in range(count):
        yield from filter(None, [written(random, folder, number), surfer(random, folder, number)])
        yield from qforms(random, folder, number)
