"""Writes the slices of a NIfTI file of 8-bit voxels as a DICOM series: series.py IN.nii.gz FOLDER. For pictures, not for patients."""
import gzip
import pathlib
import struct
import sys

with gzip.open(sys.argv[1]) as file:
    data = file.read()
columns, rows, slices = struct.unpack_from("<3h", data, 42)
begin = int(struct.unpack_from("<f", data, 108)[0])
to_right, to_anterior, to_superior = (struct.unpack_from("<4f", data, 280 + 16 * axis) for axis in range(3))
folder = pathlib.Path(sys.argv[2])
folder.mkdir(parents=True)


def element(group: int, number: int, kind: str, value: bytes | str | int) -> bytes:
    if isinstance(value, int):
        value = struct.pack("<H", value)
    elif isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b"\0" if kind == "UI" else b" "
    length = struct.pack("<HI", 0, len(value)) if kind in ("OB", "OW") else struct.pack("<H", len(value))
    return struct.pack("<HH", group, number) + kind.encode() + length + value


def numbers(*values: float) -> str:
    return "\\".join(f"{value:g}" for value in values)


# DICOM's patient axes run to the left, to posterior and to superior.
def axis(voxel: int) -> tuple[float, float, float]:
    step = (-to_right[voxel], -to_anterior[voxel], to_superior[voxel])
    length = sum(part * part for part in step) ** 0.5
    return tuple(part / length + 0.0 for part in step)


def spacing(voxel: int) -> float:
    return sum(row[voxel] ** 2 for row in (to_right, to_anterior, to_superior)) ** 0.5


root, syntax, kind = "2.25.7", "1.2.840.10008.1.2.1", "1.2.840.10008.5.1.4.1.1.4"
for k in range(slices):
    place = (-(to_right[2] * k + to_right[3]), -(to_anterior[2] * k + to_anterior[3]), to_superior[2] * k + to_superior[3])
    about = element(2, 2, "UI", kind) + element(2, 3, "UI", f"{root}.2.{k + 1}") + element(2, 0x10, "UI", syntax)
    image = [
        element(8, 0x16, "UI", kind),
        element(8, 0x18, "UI", f"{root}.2.{k + 1}"),
        element(8, 0x60, "CS", "MR"),
        element(8, 0x103E, "LO", "A head"),
        element(0x18, 0x50, "DS", numbers(spacing(2))),
        element(0x20, 0xD, "UI", root),
        element(0x20, 0xE, "UI", f"{root}.1"),
        element(0x20, 0x11, "IS", "1"),
        element(0x20, 0x13, "IS", str(k + 1)),
        element(0x20, 0x32, "DS", numbers(*place)),
        element(0x20, 0x37, "DS", numbers(*axis(0), *axis(1))),
        element(0x28, 2, "US", 1),
        element(0x28, 4, "CS", "MONOCHROME2"),
        element(0x28, 0x10, "US", rows),
        element(0x28, 0x11, "US", columns),
        element(0x28, 0x30, "DS", numbers(spacing(1), spacing(0))),
        element(0x28, 0x100, "US", 8),
        element(0x28, 0x101, "US", 8),
        element(0x28, 0x102, "US", 7),
        element(0x28, 0x103, "US", 0),
        element(0x7FE0, 0x10, "OW", data[begin + k * rows * columns : begin + (k + 1) * rows * columns]),
    ]
    length = struct.pack("<HH2sHI", 2, 0, b"UL", 4, len(about))
    # Names say nothing of the order, as in many archives.
    name = f"{k * 37 % slices:03d}.dcm"
    (folder / name).write_bytes(bytes(128) + b"DICM" + length + about + b"".join(image))
