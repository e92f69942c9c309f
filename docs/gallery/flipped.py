"""Writes a copy of a NIfTI file whose voxels run the other way along x: flipped.py IN.nii.gz OUT.nii.gz. The anatomy stays where it is."""
import gzip
import struct
import sys

with gzip.open(sys.argv[1]) as file:
    data = bytearray(file.read())
size = struct.unpack_from("<3h", data, 42)
bytes_a_voxel = struct.unpack_from("<h", data, 72)[0] // 8
begin, row = int(struct.unpack_from("<f", data, 108)[0]), size[0] * bytes_a_voxel
for at in range(begin, begin + row * size[1] * size[2], row):
    voxels = data[at : at + row]
    data[at : at + row] = b"".join(voxels[i : i + bytes_a_voxel] for i in range(row - bytes_a_voxel, -1, -bytes_a_voxel))
struct.pack_into("<h", data, 252, 0)  # no qform: the sform below counts
for axis in range(3):
    x, y, z, origin = struct.unpack_from("<4f", data, 280 + 16 * axis)
    struct.pack_into("<4f", data, 280 + 16 * axis, -x, y, z, origin + (size[0] - 1) * x)
with gzip.open(sys.argv[2], "wb") as file:
    file.write(data)
