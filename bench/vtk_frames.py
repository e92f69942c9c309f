#!/usr/bin/python3
"""Times VTK's fixed-point ray caster on the views of `slabstream turntable`, for bench/against_vtk.

Needs python3-vtk9, python3-numpy and an X display (run it under xvfb-run). One frame is: move the camera, Render(), read the RGBA
pixels back. Prints one JSON object: milliseconds of every frame in order, and how many repeats of the turn they are.
"""
import argparse
import json
import math
import time

import numpy as np
import vtkmodules.all as vtk
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the mapper's factory)
from vtkmodules.util.numpy_support import vtk_to_numpy


def read_volume(path):
    if path.endswith((".nii", ".nii.gz")):
        reader = vtk.vtkNIFTIImageReader()
    elif path.endswith((".nrrd", ".nhdr")):
        reader = vtk.vtkNrrdReader()
    else:
        reader = vtk.vtkMetaImageReader()
    reader.SetFileName(path)
    reader.Update()
    image = vtk.vtkImageData()
    image.ShallowCopy(reader.GetOutput())
    image.SetOrigin(0, 0, 0)
    return image


def transfer(path, smallest_spacing):
    with open(path, encoding="utf-8") as stream:
        preset = json.load(stream)
    preset = preset[0] if isinstance(preset, list) else preset
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    rgb, points = preset["RGBPoints"], preset["Points"]
    for i in range(0, len(rgb), 4):
        color.AddRGBPoint(*rgb[i:i + 4])
    for i in range(0, len(points), 4):
        opacity.AddPoint(points[i], points[i + 1], points[i + 2], points[i + 3])
    prop = vtk.vtkVolumeProperty()
    prop.SetColor(color)
    prop.SetScalarOpacity(opacity)
    prop.SetScalarOpacityUnitDistance(smallest_spacing)
    prop.SetInterpolationTypeToLinear()
    prop.SetShade(1)
    prop.SetAmbient(0.3)
    prop.SetDiffuse(0.6)
    prop.SetSpecular(0.3)
    prop.SetSpecularPower(20)
    return prop


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("volume")
    p.add_argument("--transfer", required=True)
    p.add_argument("--size", type=int, default=512)
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--frames", type=int, default=12)
    p.add_argument("--turns", type=int, default=2)
    p.add_argument("--azimuth", type=float, default=0)
    p.add_argument("--elevation", type=float, default=20)
    p.add_argument("--zoom", type=float, default=1)
    p.add_argument("--projection", choices=["orthographic", "perspective"], default="orthographic")
    p.add_argument("--fov", type=float, default=30)
    p.add_argument("--png", help="writes the first view here")
    a = p.parse_args()

    image = read_volume(a.volume)
    dims, spacing = image.GetDimensions(), image.GetSpacing()
    radius = 0.5 * math.sqrt(sum((n * s) ** 2 for n, s in zip(dims, spacing)))
    centre = [(n - 1) / 2 * s for n, s in zip(dims, spacing)]

    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetNumberOfThreads(a.threads)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(min(spacing))
    mapper.SetInteractiveSampleDistance(min(spacing))
    mapper.SetBlendModeToComposite()
    mapper.SetInputData(image)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(transfer(a.transfer, min(spacing)))
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.AddVolume(volume)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(a.size, a.size)
    window.SetDesiredUpdateRate(1e-6)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    pixels = vtk.vtkUnsignedCharArray()

    def frame(k):
        az, el = math.radians(a.azimuth + 360 * k / a.frames), math.radians(a.elevation)
        begin = time.perf_counter()
        perspective = a.projection == "perspective"
        distance = radius / math.sin(math.radians(a.fov / 2)) if perspective else 2 * radius
        camera.SetParallelProjection(0 if perspective else 1)
        camera.SetParallelScale(radius / a.zoom)
        camera.SetViewAngle(2 * math.degrees(math.atan(math.tan(math.radians(a.fov / 2)) / a.zoom)))
        camera.SetFocalPoint(*centre)
        camera.SetPosition(centre[0] + distance * math.sin(az) * math.cos(el),
                           centre[1] - distance * math.cos(az) * math.cos(el),
                           centre[2] + distance * math.sin(el))
        camera.SetViewUp(0, 0, 1)
        renderer.ResetCameraClippingRange()
        window.Render()
        window.GetRGBACharPixelData(0, 0, a.size - 1, a.size - 1, 1, pixels)
        return (time.perf_counter() - begin) * 1e3

    frame(0)
    if a.png:
        data = vtk_to_numpy(pixels).reshape(a.size, a.size, 4)[::-1, :, :3]
        np.ascontiguousarray(data).tofile(a.png + ".rgb")
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(grab.GetOutputPort())
        writer.SetFileName(a.png)
        writer.Write()
    times = [frame(k) for _ in range(a.turns) for k in range(a.frames)]
    print(json.dumps({"version": vtk.vtkVersion().GetVTKVersion(), "dims": dims, "spacing": spacing, "turns": a.turns, "frame_ms": times}))


if __name__ == "__main__":
    main()
