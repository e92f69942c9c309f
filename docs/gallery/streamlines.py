"""Lines along which smoke would drift: across the slope of its density, and upwards where it is dense. VTK traces them.

    python3 streamlines.py sim_smoke.nrrd smoke.vtp
"""
import gzip
import sys

import numpy as np
import vtk
from scipy.ndimage import gaussian_filter
from vtk.util.numpy_support import numpy_to_vtk

source, target = sys.argv[1:]
with open(source, "rb") as file:
    head, body = file.read().split(b"\n\n", 1)
fields = dict(line.split(": ") for line in head.decode().splitlines()[1:] if ": " in line and not line.startswith("#"))
size, spacing = fields["sizes"].split(), fields["spacings"].split()
density = np.frombuffer(gzip.decompress(body), "<f4").reshape([int(n) for n in reversed(size)])
smooth = gaussian_filter(density, 5)
_, slope_y, slope_x = np.gradient(smooth)
drift = np.stack([slope_y, -slope_x, 0.4 * np.abs(slope_y) + 0.02 * smooth], axis=-1).reshape(-1, 3)

image = vtk.vtkImageData()
image.SetDimensions(*(int(n) for n in size))
image.SetSpacing(*(float(s) for s in spacing))
vectors, values = numpy_to_vtk(drift, deep=True), numpy_to_vtk(density.ravel(), deep=True)
vectors.SetName("drift")
values.SetName("density")
image.GetPointData().SetVectors(vectors)
image.GetPointData().SetScalars(values)
seeds = vtk.vtkPointSource()
seeds.SetCenter(25, 52, 25)
seeds.SetRadius(30)
seeds.SetNumberOfPoints(140)
tracer = vtk.vtkStreamTracer()
tracer.SetInputData(image)
tracer.SetSourceConnection(seeds.GetOutputPort())
tracer.SetMaximumPropagation(60)
tracer.SetIntegrationDirectionToBoth()
tracer.Update()
writer = vtk.vtkXMLPolyDataWriter()
writer.SetFileName(target)
writer.SetInputConnection(tracer.GetOutputPort())
writer.Write()
