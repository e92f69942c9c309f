"""Draws a scene of `slabstream bench --export` by a ParaView server and times it; bench/paraview_run runs it under pvpython.

One frame is: move the camera, render at the server, fetch the picture (as `bench/vtk_views.py`, whose output this has too).
The memory is that of all processes of the server, each at its peak.
"""
import argparse
import json
import math
import os
import time

from paraview import servermanager, simple


def show(view, scene, directory, mode):
    """The volume in the view; its radius and centre in space."""
    reader = simple.OpenDataFile(os.path.join(directory, scene["volume"]))
    reader.UpdatePipeline()
    information = reader.GetDataInformation()
    bounds = information.GetBounds()
    extent = information.GetExtent()
    voxels = [extent[2 * i + 1] - extent[2 * i] + 1 for i in range(3)]
    spacing = [(bounds[2 * i + 1] - bounds[2 * i]) / max(1, n - 1) for i, n in enumerate(voxels)]
    array = reader.PointData.GetArray(0).GetName()
    with open(os.path.join(directory, scene["transfer"]), encoding="utf-8") as stream:
        preset = json.load(stream)[0]
    display = simple.Show(reader, view)
    display.SetRepresentationType("Volume")
    simple.ColorBy(display, ("POINTS", array))
    display.SetScalarBarVisibility(view, False)
    display.VolumeRenderingMode = mode
    display.ScalarOpacityUnitDistance = scene["opacity_distance"] * min(spacing)
    display.Shade = 1
    shading = scene["shading"]
    display.Ambient, display.Diffuse = shading["ambient"], shading["diffuse"]
    display.Specular, display.SpecularPower = shading["specular"], shading["shininess"]
    simple.GetColorTransferFunction(array).RGBPoints = preset["RGBPoints"]
    simple.GetOpacityTransferFunction(array).Points = preset["Points"]
    radius = 0.5 * math.sqrt(sum((n * s) ** 2 for n, s in zip(voxels, spacing)))
    return radius, [(bounds[2 * i] + bounds[2 * i + 1]) / 2 for i in range(3)]


def frame_ms(view, scene, radius, centre, projection, index):
    """Time and picture. The turntable is the one of bench/vtk_views.py."""
    views = scene["views"]
    azimuth, elevation = math.radians(360 * index / views["frames"]), math.radians(views["elevation_degrees"])
    half_fov = math.radians(views["fov_degrees"]) / 2
    perspective = projection == "perspective"
    distance = radius / math.sin(half_fov) if perspective else 2 * radius
    begin = time.perf_counter()
    view.CameraParallelProjection = 0 if perspective else 1
    view.CameraParallelScale = radius / views["zoom"]
    view.CameraViewAngle = 2 * math.degrees(math.atan(math.tan(half_fov) / views["zoom"]))
    view.CameraFocalPoint = centre
    view.CameraPosition = [centre[0] + distance * math.sin(azimuth) * math.cos(elevation),
                           centre[1] - distance * math.cos(azimuth) * math.cos(elevation),
                           centre[2] + distance * math.sin(elevation)]
    view.CameraViewUp = [0, 0, 1]
    view.StillRender()  # ends with the picture in this client's window
    return (time.perf_counter() - begin) * 1e3


def peak_rss_bytes(name):
    """Of all processes called `name` that this one can see: in a process namespace of their own, those of this run."""
    total = 0
    for process in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{process}/status", encoding="utf-8") as stream:
                status = {field: value.strip() for field, _, value in (line.partition(":") for line in stream)}
        except OSError:  # it has ended
            continue
        if status["Name"] == name:
            total += int(status["VmHWM"].split()[0]) * 1024
    return total


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("scene")
    p.add_argument("--port", type=int, default=11111)
    p.add_argument("--mode", default="Smart", help="VolumeRenderingMode: Smart, Ray Cast Only or GPU Based")
    p.add_argument("--pictures", metavar="PREFIX")
    a = p.parse_args()
    with open(a.scene, encoding="utf-8") as stream:
        scene = json.load(stream)
    simple.Connect("127.0.0.1", a.port)
    simple._DisableFirstRenderCameraReset()
    view = simple.CreateRenderView()
    view.ViewSize = [scene["size"], scene["size"]]
    view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]
    view.OrientationAxesVisibility = 0
    view.RemoteRenderThreshold = 0.0  # always at the server
    view.UseLight = 0  # the light kit; what is left is the headlight below
    light = simple.AddLight(view=view)
    light.Coords, light.Intensity, light.Type = "Camera", 1.0, "Directional"
    light.Position, light.FocalPoint = [0, 0, 1], [0, 0, 0]
    radius, centre = show(view, scene, os.path.dirname(a.scene), a.mode)

    projections = scene["views"]["projections"]
    warm_up = [frame_ms(view, scene, radius, centre, projection, 0) for projection in projections]
    times = {projection: [] for projection in projections}
    for _ in range(scene["views"]["turns"]):
        for projection in projections:
            times[projection] += [frame_ms(view, scene, radius, centre, projection, i) for i in range(scene["views"]["frames"])]
    peak = peak_rss_bytes("pvserver")
    if a.pictures:
        for projection in projections:
            frame_ms(view, scene, radius, centre, projection, 0)
            simple.SaveScreenshot(f"{a.pictures}.{projection}.png", view, ImageResolution=[scene["size"], scene["size"]])
    version = f"{simple.GetParaViewVersion().major}.{simple.GetParaViewVersion().minor}"
    ranks = servermanager.ActiveConnection.GetNumberOfDataPartitions()
    print(json.dumps({"version": version, "ranks": ranks, "first_frame_ms": warm_up[0], "latency_ms": times, "peak_rss_bytes": peak}))


main()
