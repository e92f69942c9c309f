"""What a family of files gives the runner: a file, and the volume that another program reads from it."""
import dataclasses

import numpy as np

LPS = np.diag([-1.0, -1.0, 1.0, 1.0])  # from left, posterior, superior to right, anterior, superior


@dataclasses.dataclass
class Case:
    """`voxels`: indices x, y, z. `affine`: from those to the world that Slabstream shows. `options`: what the source's name ends in."""
    name: str
    path: str
    voxels: np.ndarray
    affine: np.ndarray
    options: str = ""
    tolerance: float = 2e-6  # relative, of floats: more than float32 rounds


@dataclasses.dataclass
class Refused:
    """A file that the other program reads and that Slabstream must refuse in one line with these words."""
    name: str
    path: str
    words: tuple
    options: str = ""


def scaled(spacing, origin=(0, 0, 0)):
    affine = np.diag([*map(float, spacing), 1.0])
    affine[:3, 3] = origin
    return affine


def turned(random):
    """A rotation, as the direction of a scan."""
    matrix, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


def samples(random, shape, dtype):
    """Values of the whole range of a type, or normal ones, which float32 holds."""
    if np.issubdtype(dtype, np.floating):
        return random.normal(scale=100, size=shape).astype(np.float32).astype(dtype)
    limits = np.iinfo(dtype)
    return random.integers(limits.min, limits.max, shape, dtype=dtype, endpoint=True)
