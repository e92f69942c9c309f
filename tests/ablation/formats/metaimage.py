"""MetaImage by ITK: each line of the header is a node."""

import re

import numpy as np
import SimpleITK
import vtk
from vtk.util import numpy_support

from ablation import Answer, CannotWrite, Change, Sample
from documents import LinesDocument

FOREIGN_READER_CRASHES = True  # ITK does, on some headers

KINDS = {
    "Comment": "comment",
    "Name": "comment",
    "ID": "identifier",
    "ParentID": "identifier",
    "AcquisitionDate": "date",
    "ITK_InputFilterName": "comment",
}
ROLES = {
    "ElementSpacing": "spacing",
    "ElementSize": "spacing",
    "Offset": "affine",
    "Position": "affine",
    "Origin": "affine",
    "TransformMatrix": "affine",
    "Rotation": "affine",
    "CenterOfRotation": "affine",
    "DistanceUnits": "unit",
    "ElementToIntensityFunctionSlope": "scale",
    "ElementToIntensityFunctionOffset": "offset",
}
NAMES = {
    "DimSize": ("size", "bytes", "truncated", "samples"),
    "NDims": ("dimension", "DimSize"),
    "ElementType": ("type", "bytes", "truncated"),
    "BinaryData": ("binary", "text"),
    "CompressedData": ("compress", "inflat", "zlib", "truncated"),
    "CompressedDataSize": ("compress", "bytes"),
    "ElementNumberOfChannels": ("channels", "components", "bytes"),
    "HeaderSize": ("header", "bytes"),
    "ElementDataFile": ("file",),
    "ObjectType": ("ObjectType", "Image"),
    "TransformMatrix": ("matrix", "axes", "directions"),
    "ElementSpacing": ("spacing",),
}
WORDS = {
    "ElementType": ("MET_UCHAR", "MET_SHORT", "MET_USHORT", "MET_FLOAT", "MET_DOUBLE", "MET_LONG"),
    "BinaryDataByteOrderMSB": ("True", "False"),
    "ElementByteOrderMSB": ("True", "False"),
    "BinaryData": ("True", "False"),
    "CompressedData": ("True", "False"),
    "AnatomicalOrientation": ("RAI", "LPS", "RAS", "???"),
    "DistanceUnits": ("mm", "um", "cm", "m"),
    "ObjectType": ("Image", "Mesh", "Tube"),
}
TYPES = (SimpleITK.sitkUInt8, SimpleITK.sitkInt32, SimpleITK.sitkFloat32, SimpleITK.sitkFloat64)


class Header(LinesDocument):
    """Lines up to ElementDataFile, which is the last."""

    def __init__(self, path, name):
        super().__init__(path, name, "=")
        data = path.read_bytes()
        end = re.search(rb"ElementDataFile *=[^\n]*\n", data).end()
        self.lines, self.tail = data[:end].decode("latin-1").split("\n"), data[end:]
        self.whole = False

    def nodes(self):
        nodes = super().nodes()
        for node in nodes:
            key = node.path.split("/")[-1]
            node.kind, node.role, node.names, node.words = KINDS.get(key, ""), ROLES.get(key, ""), NAMES.get(key, ()), WORDS.get(key, ())
            if key == "ElementType":
                node.more = [
                    Change(f"samples are {SimpleITK.GetPixelIDValueAsString(t)}", lambda t=t: self._encode(t), same=True) for t in TYPES
                ]
            elif key == "CompressedData":
                node.more = [Change("compressed or not", self._compress, same=True)]
            elif key == "BinaryDataByteOrderMSB":
                node.more = [Change("the other byte order", self._swap, same=True)]
            elif key == "TransformMatrix":
                node.more = [Change("axes exchanged", lambda n=node: self._exchange(n))]
        return nodes

    def _image(self):
        if any("AnatomicalOrientation = ?" in line or "DistanceUnits" in line for line in self.lines):
            raise CannotWrite("ITK writes other axes, and no unit")
        return SimpleITK.ReadImage(str(self.path))

    def _encode(self, kind):
        image = self._image()
        if image.GetNumberOfComponentsPerPixel() > 1:
            raise CannotWrite("components")
        SimpleITK.WriteImage(SimpleITK.Cast(image, kind), str(self.path))
        self.whole = True

    def _compress(self):
        packed = "CompressedData = True" not in "\n".join(self.lines)
        SimpleITK.WriteImage(self._image(), str(self.path), useCompression=packed)
        self.whole = True

    def _swap(self):
        image = SimpleITK.ReadImage(str(self.path))
        array = SimpleITK.GetArrayFromImage(image)
        if self.path.suffix != ".mha" or "CompressedData = True" in "\n".join(self.lines):
            raise CannotWrite("not in the file")
        big = "BinaryDataByteOrderMSB = True" in "\n".join(self.lines)
        self.lines = [line.replace(f"MSB = {big}", f"MSB = {not big}") for line in self.lines]
        self.tail = array.astype(array.dtype.newbyteorder("<" if big else ">")).tobytes()

    def _exchange(self, node):
        numbers = node.value.split()
        side = round(len(numbers) ** 0.5)
        node.set(" ".join(numbers[side : 2 * side] + numbers[:side] + numbers[2 * side :]))

    def place(self, at):
        """Before the line of the data."""
        return next(i for i, line in enumerate(self.lines) if line and line.startswith("ElementDataFile"))

    def add(self, path, value):
        if any(line and line.split("=")[0].strip() == path.split("/")[-1] for line in self.lines):
            raise CannotWrite(path)
        super().add(path, value)

    def save(self):
        if not self.whole:
            super().save()


def values(shape, dtype=np.int16):
    return np.random.default_rng(5).integers(1, 120, shape).astype(dtype)


def image(dtype=np.int16, turned=True, components=0, keys=()):
    made = SimpleITK.GetImageFromArray(values((7, 6, 5) + ((components,) if components else ()), dtype), isVector=components > 0)
    made.SetSpacing((1.5, 2.0, 2.5)), made.SetOrigin((10, -20, 30))
    angle = np.deg2rad(8) if turned else 0
    made.SetDirection((np.cos(angle), -np.sin(angle), 0, np.sin(angle), np.cos(angle), 0, 0, 0, 1))
    for key, value in keys:
        made.SetMetaData(key, value)
    return made


def with_lines(path, lines, replaced=()):
    """Lines of other writers, which ITK reads."""
    header = Header(path, "header")
    header.lines = [next((new for key, new in replaced if line.startswith(key)), line) for line in header.lines]
    at = header.place(0)
    header.lines[at:at] = lines
    header.lines = [line for line in header.lines if line is not None]
    header.save()


def itk(folder):
    SimpleITK.WriteImage(image(keys=[("Modality", "MET_MOD_CT"), ("ITK_InputFilterName", "MetaImageIO")]), str(folder / "a.mha"))


def packed(folder):
    SimpleITK.WriteImage(image(np.uint16), str(folder / "a.mha"), useCompression=True)


def spelled(folder):
    """As other programs of MetaIO write it: comments, names, units, sizes of elements, intensities."""
    SimpleITK.WriteImage(image(np.uint8), str(folder / "a.mha"))
    with_lines(
        folder / "a.mha",
        [
            "ElementMin = 1",
            "ElementMax = 119",
            "ElementSize = 1.5 2 2.5",
            "DistanceUnits = um",
            "Modality = MET_MOD_MR",
            "ElementToIntensityFunctionSlope = 1",
            "ElementToIntensityFunctionOffset = 0",
        ],
    )
    with_lines(
        folder / "a.mha",
        [],
        [
            ("CenterOfRotation", "CenterOfRotation = 1 2 3"),
            ("ObjectType", "Comment = made by a scanner\nObjectType = Image"),
            ("NDims", "ObjectSubType = Image\nName = head\nID = 1\nParentID = 0\nAcquisitionDate = 2024.01.02\nColor = 1 0 0 1\nNDims = 3"),
        ],
    )


def sized(folder):
    """ElementSize instead of ElementSpacing, Position instead of Offset, as old writers have them."""
    SimpleITK.WriteImage(image(np.int16, False), str(folder / "a.mha"))
    with_lines(
        folder / "a.mha",
        [],
        [
            ("ElementSpacing", "ElementSize = 1.5 2 2.5"),
            ("Offset", "Position = 10 -20 30"),
            ("TransformMatrix", "Orientation = 1 0 0 0 1 0 0 0 1"),
            ("CenterOfRotation", None),
        ],
    )


def by_vtk(folder):
    data = vtk.vtkImageData()
    data.SetDimensions(5, 6, 7), data.SetSpacing(1.5, 2.0, 2.5), data.SetOrigin(10, -20, 30)
    data.GetPointData().SetScalars(numpy_support.numpy_to_vtk(values((210,), np.float32), deep=True))
    writer = vtk.vtkMetaImageWriter()
    writer.SetInputData(data), writer.SetFileName(str(folder / "a.mhd")), writer.SetRAWFileName(
        str(folder / "a.raw")
    ), writer.SetCompression(False)
    writer.Write()
    with_lines(folder / "a.mhd", [], [("ElementDataFile", "ElementDataFile = a.raw")])


def times(folder):
    joined = SimpleITK.JoinSeries([image(turned=False) + k for k in range(3)])
    joined.SetSpacing((1.5, 2.0, 2.5, 0.5)), joined.SetOrigin((10, -20, 30, 0))
    SimpleITK.WriteImage(joined, str(folder / "a.mha"))


def detached(folder, lines=(), front=b"", file="a.raw"):
    SimpleITK.WriteImage(image(), str(folder / "a.mhd"))
    raw = folder / "a.raw"
    raw.write_bytes(front + raw.read_bytes())
    with_lines(folder / "a.mhd", list(lines))


def listed(folder, line):
    detached(folder)
    raw = (folder / "a.raw").read_bytes()
    for k in range(7):
        (folder / f"s{k:03d}.raw").write_bytes(raw[60 * k : 60 * (k + 1)])
    (folder / "a.raw").unlink()
    with_lines(folder / "a.mhd", [], [("ElementDataFile", line)])


def ultrasound(folder):
    """As PLUS writes sequences: a key for each frame."""
    SimpleITK.WriteImage(image(np.int16, False), str(folder / "a.mha"))
    with_lines(
        folder / "a.mha",
        [
            "UltrasoundImageOrientation = MFA",
            "UltrasoundImageType = BRIGHTNESS",
            "ElementByteOrderMSB = False",
            "Seq_Frame0000_ImageStatus = OK",
            "Seq_Frame0000_Timestamp = 1.5",
            "Seq_Frame0000_ProbeToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
            "Kinds = domain domain list",
        ],
    )


# The foreign reader.


def read(path):
    """By ITK: left, posterior, superior. A file without a matrix, an origin and letters has no orientation, and VTK's is a scene."""
    loaded = SimpleITK.ReadImage(str(path))
    head = path.read_bytes().split(b"ElementDataFile")[0].decode("latin-1")
    array = SimpleITK.GetArrayFromImage(loaded).astype(float)
    parts = loaded.GetNumberOfComponentsPerPixel()
    dimension = loaded.GetDimension()
    if dimension == 4 and parts == 1:
        fields = {(t, 0): array[t].transpose(2, 1, 0) for t in range(array.shape[0])}
    elif dimension == 3:
        fields = {(0, c): (array[..., c] if parts > 1 else array).transpose(2, 1, 0) for c in range(parts)}
    else:
        raise ValueError("dimensions")
    affine = np.eye(4)
    affine[:3, :3] = (np.array(loaded.GetDirection()).reshape(dimension, dimension) @ np.diag(loaded.GetSpacing()))[:3, :3]
    affine[:3, 3] = loaded.GetOrigin()[:3]
    placed = re.search(r"^(TransformMatrix|Orientation|Rotation|Offset|Position|Origin|AnatomicalOrientation) *=", head, re.M)
    scene = not placed or (dimension == 3 and re.search(r"^AnatomicalOrientation *= *\?", head, re.M))
    return Answer(fields=fields, affine=affine if scene else np.diag([-1, -1, 1, 1]) @ affine)


def sample(name, write, file="a.mha", sidecars=()):
    return Sample(name, file, write, lambda folder: [Header(folder / file, "header")], lambda folder: read(folder / file), sidecars)


def samples(_):
    return [
        sample("itk", itk),
        sample("packed", packed),
        sample("spelled", spelled),
        sample("sized", sized),
        sample("by-vtk", by_vtk, "a.mhd", ("a.raw",)),
        sample("floats", lambda folder: SimpleITK.WriteImage(image(np.float64), str(folder / "a.mha"))),
        sample("vectors", lambda folder: SimpleITK.WriteImage(image(np.float32, components=3), str(folder / "a.mha"))),
        sample("times", times),
        sample("ultrasound", ultrasound),
        sample("detached", detached, "a.mhd", ("a.raw",)),
        sample("front", lambda folder: detached(folder, ["HeaderSize = 24"], b"\1" * 24), "a.mhd"),
        sample("from-the-end", lambda folder: detached(folder, ["HeaderSize = -1"], b"\1" * 24), "a.mhd"),
        sample("pattern", lambda folder: listed(folder, "ElementDataFile = s%03d.raw 0 6 1"), "a.mhd", ("s003.raw",)),
        sample("list", lambda folder: listed(folder, "ElementDataFile = LIST\n" + "\n".join(f"s{k:03d}.raw" for k in range(7))), "a.mhd"),
    ]
