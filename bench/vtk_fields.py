"""The peer of bench/fields: how much longer vtkMultiVolume takes for several volumes than for the first one alone, as a line of JSON.

    python3 bench/vtk_fields.py channels|overlay FOLDER VIEWS          # FOLDER: that of bench/fields, with its .npy files
"""
import json
import pathlib
import statistics
import sys
import time

import numpy as np
import vtkmodules.all as vtk
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers what draws volumes)
from vtkmodules.util.numpy_support import numpy_to_vtk

COLOURS = [(1, 0, 1), (0, 1, 0), (0, 1, 1), (1, 1, 0)]


def volume_of(array, length, turn, points):
    """`points`: value, red, green, blue, opacity. The centre of the volume is that of the world."""
    image = vtk.vtkImageData()
    image.SetDimensions(*array.shape[::-1])
    image.SetSpacing(length, length, length)
    image.SetOrigin(*(-(side - 1) * length / 2 for side in array.shape[::-1]))
    image.GetPointData().SetScalars(numpy_to_vtk(array.ravel()))
    colour, opacity, volume = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction(), vtk.vtkVolume()
    for value, red, green, blue, alpha in points:
        colour.AddRGBPoint(value, red, green, blue)
        opacity.AddPoint(value, alpha)
    volume.GetProperty().SetColor(colour)
    volume.GetProperty().SetScalarOpacity(opacity)
    volume.GetProperty().SetScalarOpacityUnitDistance(length)
    volume.GetProperty().SetInterpolationTypeToLinear()
    volume.GetProperty().ShadeOn()
    volume.RotateZ(turn)
    return image, volume


def volumes_of(kind, folder):
    if kind == "overlay":
        ct, pet = np.load(folder / "ct.npy"), np.load(folder / "pet.npy")
        yield volume_of(ct, 500 / ct.shape[2], 0, [(150, 0.8, 0.5, 0.3, 0), (700, 1, 1, 0.9, 0.5)])
        yield volume_of(pet, 500 / pet.shape[2], 10, [(2, 0.6, 0, 0, 0), (10, 1, 1, 0.6, 0.5)])
        return
    for channel, colour in enumerate(COLOURS):
        array = np.load(folder / f"channel-{channel}.npy")
        shown = array[::4, ::4, ::4][array[::4, ::4, ::4] > 0]
        low, high = np.percentile(shown, [10, 99.5])
        yield volume_of(array, 1, 0, [(low, *colour, 0), (high, *colour, 0.25)])


def milliseconds(given, views):
    """The median of a turn."""
    window, renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
    window.SetOffScreenRendering(1)
    window.SetSize(512, 512)
    window.AddRenderer(renderer)
    mapper, several = vtk.vtkGPUVolumeRayCastMapper(), vtk.vtkMultiVolume()
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetSampleDistance(given[0][0].GetSpacing()[0])
    for port, (image, volume) in enumerate(given):
        if len(given) == 1:
            mapper.SetInputDataObject(image)
            volume.SetMapper(mapper)
        else:
            mapper.SetInputDataObject(port, image)
            several.SetVolume(volume, port)
    several.SetMapper(mapper)
    renderer.AddVolume(given[0][1] if len(given) == 1 else several)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    renderer.ResetCamera()
    took, pixels = [], vtk.vtkUnsignedCharArray()
    for _ in range(views + 1):  # the first one loads
        begin = time.perf_counter()
        camera.Azimuth(360 / views)
        window.Render()
        window.GetPixelData(0, 0, 511, 511, 0, pixels, 0)
        took.append(1000 * (time.perf_counter() - begin))
    return statistics.median(took[1:])


def main():
    kind, folder, views = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
    given = list(volumes_of(kind, folder))
    less, more = milliseconds(given[:1], views), milliseconds(given, views)
    print(json.dumps({"less": less, "more": more, "ratio": more / less, "version": vtk.vtkVersion().GetVTKVersion()}))


if __name__ == "__main__":
    main()
