#!/usr/bin/python3
"""Draws a scene of `slabstream bench --export` with one of VTK's volume mappers and times it; bench/against_vtk and bench/viewer run it.
A scene of the renderer `slice` has an unstructured grid, which VTK's mappers of such grids draw (GRID_MAPPERS).

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

# VTK's unstructured grid mappers that run on the processor: the class, and that of its ray integrator. "automatic" is VTK's own choice, which
# is vtkUnstructuredGridPreIntegration for one value a point and vtkUnstructuredGridHomogeneousRayIntegrator for values of cells. The ray
# caster's rays walk from face to face (Bunyk, Kaufman, Silva 1997). Only the ray caster has threads.
GRID_MAPPERS = {
    "raycast": ("vtkUnstructuredGridVolumeRayCastMapper", None),
    "raycast-linear": ("vtkUnstructuredGridVolumeRayCastMapper", "vtkUnstructuredGridLinearRayIntegrator"),
    "zsweep": ("vtkUnstructuredGridVolumeZSweepMapper", None),
}


def read_grid(vtk, grid):
    """The grid with the array to draw as its scalars: the named one, or the active one, or else the first with one component."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(grid["file"])
    reader.Update()
    mesh = reader.GetOutput()
    for data in (mesh.GetPointData(), mesh.GetCellData()):
        names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays()) if data.GetArray(i).GetNumberOfComponents() == 1]
        if grid["array"] in names:
            data.SetActiveScalars(grid["array"])
        elif not grid["array"] and data.GetScalars() is None and names:
            data.SetActiveScalars(names[0])
        if data.GetScalars() is not None and data.GetScalars().GetName() in names:
            break
    return mesh


def read_volume(vtk, path):
    reader = vtk.vtkMetaImageReader()
    reader.SetFileName(path)
    reader.Update()
    image = vtk.vtkImageData()
    image.ShallowCopy(reader.GetOutput())
    image.SetOrigin(0, 0, 0)
    return image


def attenuation(alpha):
    """What VTK's integrators of unstructured grids take for an opacity: alpha of a unit distance is 1 - exp(-attenuation) there. Between the
    points of a function the attenuation is linear, so ours gets its curve (linear_attenuation)."""
    return -math.log1p(-min(alpha, 0.9999))


def linear_attenuation(preset, pieces=16):
    """The preset with opacities between whose points the attenuation is linear, in as many linear pieces. VTK itself does worse with
    pieces: its exact integrator becomes brighter, by 0.007 with 32 of them."""
    points = [preset["Points"][i:i + 2] for i in range(0, len(preset["Points"]), 4)]
    curve = [points[0]]
    for (v0, a0), (v1, a1) in zip(points, points[1:]):
        t0, t1 = attenuation(a0), attenuation(a1)
        curve += [(v0 + (v1 - v0) * i / pieces, -math.expm1(-(t0 + (t1 - t0) * i / pieces))) for i in range(1, pieces + 1)]
    return {**preset, "Points": [number for value, alpha in curve for number in (value, alpha, 0.5, 0)]}


def make_property(vtk, scene, preset, smallest_spacing):
    """Colours, opacities (of a distance, as ours are of voxel lengths) and lighting: two-sided Phong with a light at infinity, as ours.
    Grids are drawn without lights, by us and by VTK."""
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    color.SetAllowDuplicateScalars(1)
    opacity.SetAllowDuplicateScalars(1)
    for i in range(0, len(preset["RGBPoints"]), 4):
        color.AddRGBPoint(*preset["RGBPoints"][i:i + 4])
    points = [preset["Points"][i:i + 2] for i in range(0, len(preset["Points"]), 4)]
    for value, alpha in points:
        opacity.AddPoint(value, attenuation(alpha) if "grid" in scene else alpha)
    prop = vtk.vtkVolumeProperty()
    prop.SetColor(color)
    prop.SetScalarOpacity(opacity)
    prop.SetScalarOpacityUnitDistance(scene["opacity_distance"] * smallest_spacing)
    prop.SetInterpolationTypeToLinear()
    lit = "grid" not in scene and scene["shading"] is not None
    prop.SetShade(int(lit))
    if lit:
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


def make_grid_mapper(vtk, kind, threads):
    """One ray a pixel, and no trading of quality for speed."""
    mapper_class, integrator = GRID_MAPPERS[kind]
    mapper = getattr(vtk, mapper_class)()
    if hasattr(mapper, "SetNumberOfThreads"):
        mapper.SetNumberOfThreads(threads)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1.0)
    if integrator:
        mapper.SetRayIntegrator(getattr(vtk, integrator)())
    return mapper


def make_mesh(vtk, scene, path, color):
    """An opaque mesh, lit as ours is: by the picture's shading."""
    reader = vtk.vtkPLYReader()
    reader.SetFileName(path)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(reader.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    prop, shading = actor.GetProperty(), scene["shading"]
    prop.SetColor(*(int(color[i:i + 2], 16) / 255 for i in (0, 2, 4)))
    prop.SetInterpolationToPhong()
    prop.SetAmbient(shading["ambient"])
    prop.SetDiffuse(shading["diffuse"])
    prop.SetSpecular(shading["specular"])
    prop.SetSpecularPower(shading["shininess"])
    return actor


class Stage:
    """The window with the volume in it, and the turntable's camera: Slabstream's views (common/view/camera.h), in VTK's terms."""

    def __init__(self, vtk, scene, image, preset, mapper_kind, threads, jpeg=0, mesh=None):
        dims, spacing = image.GetDimensions(), image.GetSpacing()
        self.views, self.size = scene["views"], scene["size"]
        self.rays_at_corners = "grid" in scene  # of pixels: where VTK's mappers of grids have them; ours, and its others, at their centres
        self.radius = 0.5 * math.sqrt(sum((n * s) ** 2 for n, s in zip(dims, spacing)))
        if "grid" in scene:  # the volume is the lattice that fills its bounding box
            grid = read_grid(vtk, scene["grid"])
            self.centre = grid.GetCenter()
            mapper = make_grid_mapper(vtk, mapper_kind, threads)
            mapper.SetInputData(grid)
        else:
            self.centre = [(n - 1) / 2 * s for n, s in zip(dims, spacing)]
            mapper = make_mapper(vtk, mapper_kind, threads, min(spacing), scene["renderer"])
            mapper.SetInputData(image)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(make_property(vtk, scene, preset, min(spacing)))
        self.renderer = vtk.vtkRenderer()
        self.renderer.SetBackground(0, 0, 0)
        self.renderer.AddVolume(volume)
        if mesh:
            self.renderer.AddActor(mesh)
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
        if self.rays_at_corners:
            camera.SetWindowCenter(1 / self.size, 1 / self.size)  # half a pixel
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
    p.add_argument("--mapper", choices=["fixedpoint", "gpu", *GRID_MAPPERS], help="default: fixedpoint, of grids raycast")
    p.add_argument("--threads", type=int, default=2)
    p.add_argument("--views", type=int, metavar="N", help="a single turn of its first N views; 0: only pictures")
    p.add_argument("--jpeg", type=int, default=0, metavar="QUALITY", help="encode each frame")
    p.add_argument("--projection", choices=["orthographic", "perspective"], help="only this one")
    p.add_argument("--mesh", metavar="FILE.ply", help="an opaque mesh beside the volume")
    p.add_argument("--mesh-color", default="ffffff", metavar="RRGGBB")
    p.add_argument("--pictures", metavar="PREFIX", help="write the first view of each projection to PREFIX.PROJECTION.png")
    a = p.parse_args()
    os.environ["LP_NUM_THREADS"] = str(a.threads)  # of Mesa's software rasteriser, which draws for the gpu mapper; read when VTK is loaded
    import vtkmodules.all as vtk
    import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers what draws volumes)

    with open(a.scene, encoding="utf-8") as stream:
        scene = json.load(stream)
    kinds = GRID_MAPPERS if "grid" in scene else ["fixedpoint", "gpu"]
    if a.mapper and a.mapper not in kinds:
        p.error(f"--mapper {a.mapper} does not draw this scene, but: {', '.join(kinds)}")
    directory = os.path.dirname(a.scene)
    with open(os.path.join(directory, scene["transfer"]), encoding="utf-8") as stream:
        preset = json.load(stream)[0]
    image = read_volume(vtk, os.path.join(directory, scene["volume"]))
    stage = Stage(vtk, scene, image, preset, a.mapper or next(iter(kinds)), a.threads, a.jpeg, a.mesh and make_mesh(vtk, scene, a.mesh, a.mesh_color))
    projections = [a.projection] if a.projection else scene["views"]["projections"]
    warm_up = [stage.frame_ms(projection, 0) for projection in projections if a.views != 0]
    times = {projection: [] for projection in projections}
    wall, processor = time.perf_counter(), time.process_time()
    for _ in range(scene["views"]["turns"] if a.views is None else 1):
        for projection in projections:
            times[projection] += [stage.frame_ms(projection, i) for i in range(len(stage.azimuths[:a.views]))]
    cores = (time.process_time() - processor) / (time.perf_counter() - wall)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    if a.pictures:
        for projection in projections:
            stage.frame_ms(projection, 0)
            write_picture(vtk, stage.window, f"{a.pictures}.{projection}.png")
    print(json.dumps({"version": vtk.vtkVersion().GetVTKVersion(), "first_frame_ms": next(iter(warm_up), None), "latency_ms": times,
                      "cores_used": cores, "peak_rss_bytes": peak}))


if __name__ == "__main__":
    main()
