#!/usr/bin/python3
"""Draws a scene of `slabstream bench --export` with one of VTK's volume mappers and times it; bench/against_vtk and bench/viewer run it.

Needs python3-vtk9, python3-numpy and an X display (run it under xvfb-run). One frame is: move the camera, Render(), read the RGBA pixels
back. A frame of each projection warms up, then their turntables turn after turn, as `slabstream bench` does it. Prints one JSON object:
milliseconds of each frame in order, of the first one, and the peak of this process's memory. With --jpeg a frame ends with its JPEG file
in memory instead, as a server sends it. A scene whose views have "azimuths" shows these, in degrees, instead of a full turn.
"""
import argparse
import json
import math
import os
import resource
import time


def read_volume(vtk, path):
    reader = vtk.vtkMetaImageReader()
    reader.SetFileName(path)
    reader.Update()
    image = vtk.vtkImageData()
    image.ShallowCopy(reader.GetOutput())
    image.SetOrigin(0, 0, 0)
    return image


def make_property(vtk, scene, directory, smallest_spacing):
    """Colours, opacities (of a distance, as ours are of voxel lengths) and lighting: two-sided Phong with a light at infinity, as ours."""
    with open(os.path.join(directory, scene["transfer"]), encoding="utf-8") as stream:
        preset = json.load(stream)[0]
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    color.SetAllowDuplicateScalars(1)
    opacity.SetAllowDuplicateScalars(1)
    for i in range(0, len(preset["RGBPoints"]), 4):
        color.AddRGBPoint(*preset["RGBPoints"][i:i + 4])
    for i in range(0, len(preset["Points"]), 4):
        opacity.AddPoint(*preset["Points"][i:i + 4])
    prop = vtk.vtkVolumeProperty()
    prop.SetColor(color)
    prop.SetScalarOpacity(opacity)
    prop.SetScalarOpacityUnitDistance(scene["opacity_distance"] * smallest_spacing)
    prop.SetInterpolationTypeToLinear()
    prop.SetShade(1)
    prop.SetAmbient(scene["shading"]["ambient"])
    prop.SetDiffuse(scene["shading"]["diffuse"])
    prop.SetSpecular(scene["shading"]["specular"])
    prop.SetSpecularPower(scene["shading"]["shininess"])
    return prop


def make_mapper(vtk, kind, threads, sample_distance, renderer):
    """One sample a voxel length, one ray a pixel, and no trading of quality for speed."""
    if kind == "fixedpoint":
        mapper = vtk.vtkFixedPointVolumeRayCastMapper()
        mapper.SetNumberOfThreads(threads)
        mapper.SetInteractiveSampleDistance(sample_distance)
    else:
        mapper = vtk.vtkOpenGLGPUVolumeRayCastMapper()
        mapper.SetUseJittering(0)
        mapper.SetMaxMemoryInBytes(1 << 30)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(sample_distance)
    if renderer == "mip":
        mapper.SetBlendModeToMaximumIntensity()
    else:
        mapper.SetBlendModeToComposite()
    return mapper


class Stage:
    """The window with the volume in it, and the turntable's camera: Slabstream's views (common/view/camera.h), in VTK's terms."""

    def __init__(self, vtk, scene, directory, mapper_kind, threads, jpeg=0):
        image = read_volume(vtk, os.path.join(directory, scene["volume"]))
        dims, spacing = image.GetDimensions(), image.GetSpacing()
        self.views, self.size = scene["views"], scene["size"]
        self.radius = 0.5 * math.sqrt(sum((n * s) ** 2 for n, s in zip(dims, spacing)))
        self.centre = [(n - 1) / 2 * s for n, s in zip(dims, spacing)]
        mapper = make_mapper(vtk, mapper_kind, threads, min(spacing), scene["renderer"])
        mapper.SetInputData(image)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(make_property(vtk, scene, directory, min(spacing)))
        self.renderer = vtk.vtkRenderer()
        self.renderer.SetBackground(0, 0, 0)
        self.renderer.AddVolume(volume)
        headlight = vtk.vtkLight()  # as VTK adds one by itself, but with ambient light, of which that has none
        headlight.SetLightTypeToHeadlight()
        headlight.SetAmbientColor(1, 1, 1)
        self.renderer.AddLight(headlight)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(self.size, self.size)
        self.window.SetDesiredUpdateRate(1e-6)
        self.window.AddRenderer(self.renderer)
        self.pixels = vtk.vtkUnsignedCharArray()
        self.azimuths = self.views.get("azimuths") or [360 * i / self.views["frames"] for i in range(self.views["frames"])]
        self.grab, self.encoder = None, None
        if jpeg:
            self.grab = vtk.vtkWindowToImageFilter()
            self.grab.SetInput(self.window)
            self.grab.ReadFrontBufferOff()
            self.grab.ShouldRerenderOff()
            self.encoder = vtk.vtkJPEGWriter()
            self.encoder.SetInputConnection(self.grab.GetOutputPort())
            self.encoder.WriteToMemoryOn()
            self.encoder.SetQuality(jpeg)

    def frame_ms(self, projection, index):
        azimuth = math.radians(self.azimuths[index])
        elevation, half_fov = math.radians(self.views["elevation_degrees"]), math.radians(self.views["fov_degrees"]) / 2
        perspective = projection == "perspective"
        distance = self.radius / math.sin(half_fov) if perspective else 2 * self.radius
        begin = time.perf_counter()
        camera = self.renderer.GetActiveCamera()
        camera.SetParallelProjection(0 if perspective else 1)
        camera.SetParallelScale(self.radius / self.views["zoom"])
        camera.SetViewAngle(2 * math.degrees(math.atan(math.tan(half_fov) / self.views["zoom"])))
        camera.SetFocalPoint(*self.centre)
        camera.SetPosition(self.centre[0] + distance * math.sin(azimuth) * math.cos(elevation),
                           self.centre[1] - distance * math.cos(azimuth) * math.cos(elevation),
                           self.centre[2] + distance * math.sin(elevation))
        camera.SetViewUp(0, 0, 1)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        if self.encoder:
            self.grab.Modified()
            self.encoder.Write()
        else:
            self.window.GetRGBACharPixelData(0, 0, self.size - 1, self.size - 1, 1, self.pixels)
        return (time.perf_counter() - begin) * 1e3


def write_picture(vtk, window, path):
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtk.vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(path)
    writer.Write()


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scene", help="a .scene.json")
    p.add_argument("--mapper", choices=["fixedpoint", "gpu"], default="fixedpoint")
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--jpeg", type=int, default=0, metavar="QUALITY", help="encode each frame")
    p.add_argument("--projection", choices=["orthographic", "perspective"], help="only this one")
    p.add_argument("--pictures", metavar="PREFIX", help="write the first view of each projection to PREFIX.PROJECTION.png")
    a = p.parse_args()
    os.environ["LP_NUM_THREADS"] = str(a.threads)  # of Mesa's software rasteriser, which draws for the gpu mapper; read when VTK is loaded
    import vtkmodules.all as vtk
    import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers what draws volumes)

    with open(a.scene, encoding="utf-8") as stream:
        scene = json.load(stream)
    stage = Stage(vtk, scene, os.path.dirname(a.scene), a.mapper, a.threads, a.jpeg)
    projections = [a.projection] if a.projection else scene["views"]["projections"]
    warm_up = [stage.frame_ms(projection, 0) for projection in projections]
    times = {projection: [] for projection in projections}
    for _ in range(scene["views"]["turns"]):
        for projection in projections:
            times[projection] += [stage.frame_ms(projection, i) for i in range(len(stage.azimuths))]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    if a.pictures:
        for projection in projections:
            stage.frame_ms(projection, 0)
            write_picture(vtk, stage.window, f"{a.pictures}.{projection}.png")
    print(json.dumps({"version": vtk.vtkVersion().GetVTKVersion(), "first_frame_ms": warm_up[0], "latency_ms": times,
                      "peak_rss_bytes": peak}))


if __name__ == "__main__":
    main()
