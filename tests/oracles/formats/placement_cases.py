"""Where volumes lie: NIfTI, pairs and MGH by nibabel, MetaImage and NRRD by SimpleITK and pynrrd, with random headers.

Each case names voxels by their places in the world of the oracle (right, anterior, superior) and says what must be found there.
"""
import dataclasses
import os

import nibabel
import nrrd
import numpy as np
import SimpleITK

POINTS = 6
RAS_FROM_LPS = np.diag([-1.0, -1, 1, 1])


@dataclasses.dataclass
class Placed:
    name: str
    source: str  # as users name it, with options
    points: list  # (x, y, z, value)
    refused: str = ""  # what the error says instead; "": it is read


def rotation(random):
    """Proper or mirrored."""
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


def affine(random):
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(random) @ np.diag(random.uniform(0.5, 3, 3))
    matrix[:3, 3] = random.uniform(-100, 100, 3)
    return matrix


def points(random, volume, matrix):
    """Of voxels of a volume with indices x, y, z."""
    found = []
    for _ in range(POINTS):
        at = [int(random.integers(0, side)) for side in volume.shape]
        found.append((*(matrix @ [*at, 1])[:3], float(volume[tuple(at)])))
    return found


def volume(random, dtype=np.int16):
    shape = [int(random.integers(3, 9)) for _ in range(3)]
    return np.arange(np.prod(shape), dtype=dtype).reshape(shape)


def nifti(folder, random, number):
    data = volume(random)
    kind = [nibabel.Nifti1Image, nibabel.Nifti2Image, nibabel.Nifti1Pair, nibabel.Nifti2Pair][int(random.integers(4))]
    image = kind(data, None)
    codes = [int(code) for code in random.integers(0, 5, 2)]
    if not any(codes):
        codes[int(random.integers(2))] = 1
    sform, qform = affine(random), affine(random)
    image.header["pixdim"][0] = 1
    image.header.set_qform(qform, codes[0])
    image.header.set_sform(sform, codes[1])
    if random.random() < 0.5:
        image = kind(image.dataobj, None, image.header.as_byteswapped())
    pair = kind in (nibabel.Nifti1Pair, nibabel.Nifti2Pair)
    path = os.path.join(folder, f"{number}{'.img' if pair else '.nii'}{'.gz' if random.random() < 0.3 else ''}")
    nibabel.save(image, path)
    loaded = nibabel.load(path)
    name = f"{kind.__name__} qform {codes[0]} sform {codes[1]}"
    yield Placed(name, path, points(random, data, loaded.affine))
    if all(codes):
        yield Placed(name + " by the qform", path + "?matrix=qform", points(random, data, loaded.header.get_qform()))


def qforms(folder, random, number):
    """Of a header whose fields are not quite right."""
    data = volume(random)
    image = nibabel.Nifti1Image(data, None)
    image.header.set_qform(affine(random), 1)
    path = os.path.join(folder, f"{number}.nii")
    nibabel.save(image, path)
    with open(path, "r+b") as file:
        for i in range(4):
            if random.random() < 0.4:
                file.seek(76 + 4 * i)
                file.write(np.float32(0 if i == 0 or random.random() < 0.5 else -random.uniform(1, 3)).tobytes())
    yield Placed("NIfTI with odd pixdim", path, points(random, data, nibabel.load(path).affine))


def mgh(folder, random, number):
    data = volume(random, [np.uint8, np.int16, np.int32, np.float32][int(random.integers(4))])
    path = os.path.join(folder, f"{number}{['.mgh', '.mgz'][int(random.integers(2))]}")
    nibabel.save(nibabel.MGHImage(data, affine(random)), path)
    yield Placed("MGH", path, points(random, data, nibabel.load(path).affine))


def itk_image(random, dimensions):
    """The image, its voxels with indices x, y, z, and their places."""
    data = volume(random)
    stored = data.transpose(2, 1, 0)
    matrix = affine(random)
    spacing, times = np.linalg.norm(matrix[:3, :3], axis=0), 1
    directions = matrix[:3, :3] / spacing
    time = 0
    if dimensions == 4:
        times, time = 3, int(random.integers(3))
        stored = np.stack([stored + 100 * (t - time) for t in range(times)])
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(stored), isVector=False)
    rest = dimensions - 3
    full = np.eye(dimensions)
    full[:3, :3] = directions
    image.SetSpacing([*spacing, *[1.0] * rest])
    image.SetOrigin([*matrix[:3, 3], *[0.0] * rest])
    image.SetDirection(full.ravel())
    return image, data, RAS_FROM_LPS @ matrix, time


def itk(folder, random, number):
    dimensions = int(random.integers(3, 5))
    image, data, matrix, time = itk_image(random, dimensions)
    ending = [".mha", ".mhd", ".nrrd", ".nhdr"][int(random.integers(4))]
    path = os.path.join(folder, f"{number}{ending}")
    SimpleITK.WriteImage(image, path, bool(random.integers(2)))
    yield Placed(f"SimpleITK {dimensions}D {ending}", path + (f"?time={time}" if dimensions == 4 else ""), points(random, data, matrix))


def meta_image(folder, random, number):
    """With the synonyms that MetaIO knows, and without letters."""
    data, matrix = volume(random), affine(random)
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    def pick(names):
        return names[int(random.integers(len(names)))]
    def line(name, values):
        return f"{name} = {' '.join(repr(float(value)) for value in values)}\n"
    lines = [line(pick(["Offset", "Position", "Origin"]), matrix[:3, 3]), line(pick(["ElementSpacing", "ElementSize"]), spacing)]
    if random.random() < 0.8:
        lines.append(line(pick(["TransformMatrix", "Rotation", "Orientation"]), (matrix[:3, :3] / spacing).T.ravel()))
    if random.random() < 0.5:
        lines.append(f"AnatomicalOrientation = {pick(['RAI', 'LPS', 'ASL'])}\n")
    random.shuffle(lines)
    path = os.path.join(folder, f"{number}.mha")
    with open(path, "wb") as file:
        file.write(("ObjectType = Image\nNDims = 3\nBinaryData = True\n" + "".join(lines) +
                    f"DimSize = {' '.join(map(str, data.shape))}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n").encode())
        file.write(data.tobytes("F"))
    image = SimpleITK.ReadImage(path)
    directions = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = directions, image.GetOrigin()
    yield Placed("MetaImage", path, points(random, data, RAS_FROM_LPS @ found))


def nrrd_axes(folder, random, number):
    """An axis that is none of space, anywhere; by pynrrd."""
    data, matrix = volume(random), affine(random)
    count, place = int(random.integers(2, 6)), int(random.integers(0, 4))
    chosen = int(random.integers(count))
    stored = np.stack([data + 100 * (i - chosen) for i in range(count)], place)
    directions = [list(matrix[:3, i]) for i in range(3)]
    directions.insert(place, [np.nan] * 3)
    header = {"space": "right-anterior-superior", "space directions": np.array(directions), "space origin": matrix[:3, 3],
              "encoding": ["raw", "gzip", "bzip2"][int(random.integers(3))]}
    if random.random() < 0.5:
        kinds = ["domain"] * 3
        kinds.insert(place, "list")
        header["kinds"] = kinds
    path = os.path.join(folder, f"{number}.{['nrrd', 'nhdr'][int(random.integers(2))]}")
    nrrd.write(path, stored, header)
    read, _ = nrrd.read(path)
    taken = np.take(read, chosen, place)
    if place in (1, 2):
        yield Placed("NRRD, an axis between those of space", path, [], "lies between axes of space")
    else:
        option = "channel" if place == 0 else "time"
        yield Placed(f"NRRD, axis {place} none of space", f"{path}?{option}={chosen}", points(random, taken, matrix))


FAMILIES = [nifti, qforms, mgh, itk, meta_image, nrrd_axes]


def cases(folder, random, count):
    """`count` files of each family."""
    for number in range(count):
        for family in FAMILIES:
            yield from family(folder, random, f"{family.__name__}{number}")
