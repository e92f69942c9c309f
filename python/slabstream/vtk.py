"""Pictures of volumes in which meshes of VTK and PyVista stand, and volumes for them.

    import slabstream.vtk as sv

    plotter.add_mesh(mesh)
    with ss.load(array, spacing=spacing) as volume:
        image = sv.compose(plotter, volume.service, volume.name, renderer=one_with_depths, isovalue=120)

Meshes and volume lie in one world: that of the volume's file, or that of load(). VTK is imported where it is used. For one thread, that of
the render window.
"""
from __future__ import annotations

import importlib
import math
from typing import Any

import numpy

from .errors import InvalidArgument
from .image import Image
from .moves import ball_of, perspective_of
from .options import takes_options_of
from .runs import Floats
from .service import Service
from .volumes import slabs_of, volume_of


def to_pyvista(volume: Any, *, spacing: Any = None, origin: Any = None, direction: Any = None) -> Any:
    """A pyvista.ImageData of whatever load() takes as an array, with the samples as its points' scalars "values"; in memory as a whole.
    Of a patient it is in the world of the service: x to the right, y to anterior, z to superior.

    Of an Image: its pixels as points, from the lower left one, with the scalars "rgba", and "depth" where it has depths."""
    image_data = importlib.import_module("pyvista").ImageData
    if isinstance(volume, Image):
        found = image_data(dimensions=(*volume.size, 1))
        if volume.depth is not None:
            found.point_data["depth"] = volume.depth[::-1].ravel()
        found.point_data["rgba"] = numpy.asarray(volume)[::-1].reshape(-1, 4)
        found.set_active_scalars("rgba")
        return found
    checked = volume_of(volume, spacing, origin, direction)
    steps = numpy.array(checked.grid.steps)
    lengths = numpy.linalg.norm(steps, axis=1)
    samples = numpy.concatenate([numpy.ravel(slab) for slab in slabs_of(checked)])
    found = image_data(dimensions=checked.samples.shape[::-1], spacing=lengths, origin=checked.grid.origin,
                       direction_matrix=(steps / lengths[:, None]).T)
    found.point_data["values"] = samples
    return found


def camera_of(renderer: Any, radius: float) -> dict[str, Any]:
    """The options of pictures with the camera and the size of a vtkRenderer that fills its window. `radius`: of the ball round the volume,
    for parallel projections (ball_of)."""
    camera, (width, height) = renderer.GetActiveCamera(), renderer.GetRenderWindow().GetSize()
    shorter = min(width, height)
    options = {"size": (width, height), "eye": camera.GetPosition(), "look_at": camera.GetFocalPoint(), "up": camera.GetViewUp()}
    if camera.GetParallelProjection():
        return {**options, "projection": "orthographic", "zoom": radius * height / (shorter * camera.GetParallelScale())}
    slope = math.tan(math.radians(camera.GetViewAngle() / 2)) * shorter / (width if camera.GetUseHorizontalViewAngle() else height)
    return {**options, **perspective_of(slope)}


def _shown(plotter: Any) -> tuple[Any, Floats, Floats]:
    """The renderer; what its window shows, red, green and blue from 0 to 1; and depths from the eye, along the direction of view."""
    core = importlib.import_module("vtkmodules.vtkCommonCore")
    to_numpy = importlib.import_module("vtkmodules.util.numpy_support").vtk_to_numpy
    renderer = getattr(plotter, "renderer", plotter)
    window = renderer.GetRenderWindow()
    if tuple(renderer.GetViewport()) != (0, 0, 1, 1):
        raise InvalidArgument(f"the renderer has the viewport {renderer.GetViewport()}, must fill its window: (0, 0, 1, 1)")
    if hasattr(plotter, "screenshot"):
        plotter.screenshot(return_img=True)  # PyVista places its camera before it renders
    else:
        window.Render()
    width, height = window.GetSize()
    codes, values = core.vtkUnsignedCharArray(), core.vtkFloatArray()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, codes)
    window.GetZbufferData(0, 0, width - 1, height - 1, values)
    rgb = to_numpy(codes).reshape(height, width, 4)[::-1, :, :3].astype(numpy.float32) / 255
    z = to_numpy(values).reshape(height, width)[::-1].astype(numpy.float64)
    near, far = renderer.GetActiveCamera().GetClippingRange()
    parallel = renderer.GetActiveCamera().GetParallelProjection()
    depth = near + z * (far - near) if parallel else near * far / (far - z * (far - near))
    return renderer, rgb, numpy.where(z < 1, depth, numpy.inf)


@takes_options_of("render")
def compose(plotter: Any, service: Service, dataset: str, **options: Any) -> Image:
    """The picture of a dataset together with the opaque things that a pyvista.Plotter or a vtkRenderer shows, with its camera, size and
    background: at each pixel the nearer of both. The picture must have depths, as the Z-buffer makes them; in others, meshes stand as
    shapes (option `shape`).
    """
    for name in ("background", "camera"):
        if options.get(name) is not None:
            raise InvalidArgument(f"{name} is given, but must be the plotter's own")
    renderer, rgb, meshes = _shown(plotter)
    options = camera_of(renderer, ball_of(service, dataset, options.get("time"))[1]) | options
    whole = service.render(dataset, **options)
    geometry = whole.geometry
    assert geometry is not None
    eye_depth = renderer.GetActiveCamera().GetDistance() - geometry.target_depth  # of the service's depth 0, under a parallel projection
    meshes = meshes - eye_depth
    if whole.depth is None:
        raise InvalidArgument("the picture has no depths: choose a renderer that makes them, or give meshes as shapes (render(..., shape=mesh))")
    front = numpy.where((whole.depth < meshes)[..., None], whole.rgba, numpy.float32(0))
    depth = numpy.minimum(whole.depth, meshes).astype(numpy.float32)
    alpha = front[..., 3:]
    return Image(numpy.concatenate([front[..., :3] + (1 - alpha) * rgb, numpy.ones_like(alpha)], axis=2), depth, format=whole.format,
                 geometry=geometry, statistics=whole.statistics)
