"""Makes what a PET of the head of a CT might look like, by formulas, on a grid of its own: pet.py CT.nrrd OUT.nrrd. Needs numpy.

No tracer was ever measured. The brain is an ellipsoid in the skull; its rind and two bodies in its middle take up much, and one spot most."""
import gzip
import sys

import numpy
from ome_zarr import blurred, noise

STEP = 3  # voxels of the CT from one voxel to the next
with open(sys.argv[1], "rb") as file:
    header, data = file.read().split(b"\n\n", 1)
fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line)
size, spacing = fields["sizes"].split(), fields["spacings"].split()
ct = numpy.frombuffer(gzip.decompress(data), numpy.uint8).reshape([int(n) for n in reversed(size)])
soft = blurred(ct.astype(float), 1.5)[::STEP, ::STEP, ::STEP]
random = numpy.random.default_rng(3)


def grown(mask):
    for axis in range(3):
        mask = mask | numpy.roll(mask, 1, axis) | numpy.roll(mask, -1, axis)
    return mask


# An ellipsoid by hand, as far as there is soft tissue.
z, y, x = (axis - middle for axis, middle in zip(numpy.indices(soft.shape), (23.5, 48, 21.2)))
brain = ((z / 18.5) ** 2 + (y / 28) ** 2 + (x / 12.5) ** 2 < 1) & (soft > 60) & (soft < 125)
depth, inner = numpy.zeros(brain.shape), brain
while inner.any():
    depth += inner
    inner = ~grown(~inner)
rind = numpy.exp(-(((depth - 2.2) / 1.8) ** 2)) * (1 + 0.35 * noise(random, brain.shape, 1.4))
bodies = sum(numpy.exp(-((z + 1) / 4) ** 2 - (y / 6) ** 2 - ((x - side) / 2) ** 2) for side in (-4, 4))
spot = numpy.exp(-(((z - 7) / 2.2) ** 2) - ((y - 9) / 2.4) ** 2 - ((x - 6) / 1.8) ** 2)
pet = blurred(brain * (1.5 + 5 * rind + 5 * bodies) + 16 * spot, 0.6).clip(0).astype("<f4")
lines = ["NRRD0004", "type: float", "dimension: 3", "sizes: " + " ".join(str(n) for n in reversed(pet.shape)), "encoding: gzip",
         "endian: little", "spacings: " + " ".join(str(STEP * float(s)) for s in spacing), "", ""]
with open(sys.argv[2], "wb") as file:
    file.write("\n".join(lines).encode() + gzip.compress(pet.tobytes()))
