"""Writes the values of an NRRD file and how steep they are as two channels: edges.py IN.nrrd OUT.ome.zarr. Needs numpy.

Values become 0 to 255 of the range from the 1st percentile to the largest; the second channel is the magnitude of the gradient, likewise."""
import gzip
import sys

import numpy
from ome_zarr import blurred, write

with open(sys.argv[1], "rb") as file:
    header, data = file.read().split(b"\n\n", 1)
fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line)
shape, spacing = [int(n) for n in fields["sizes"].split()][::-1], [float(s) for s in fields["spacings"].split()][::-1]
types = {"uint8": "u1", "uint16": "<u2", "float": "<f4"}
volume = numpy.frombuffer(gzip.decompress(data), types[fields["type"]]).reshape(shape).astype(float)
steep = numpy.sqrt(sum(part**2 for part in numpy.gradient(blurred(volume, 0.7), *spacing)))


def codes(values):
    low = numpy.percentile(values, 1)
    return 255 * ((values - low) / (values.max() - low)).clip(0, 1) + 0.5


write(sys.argv[2], [numpy.stack([codes(volume), codes(steep)])], spacing, None,
      [("Value", "ffb347", 60, 230), ("Edges", "4fd8ff", 30, 160)])
