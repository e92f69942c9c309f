"""Slabstream from Python: pictures of volumes, by a service on CPUs.

    import slabstream as ss

    ss.render(array, spacing=(dz, dy, dx), transfer="ct-bone").save("a.png")   # starts a service of its own
    with ss.connect(service="client.json") as s:
        image = s.render("head", azimuth=30)
        numpy.asarray(image)                                                   # height, width, RGBA

Arrays are z, y, x. Options are those of the command line, with underscores; docs/python.md is a tutorial.
"""
from __future__ import annotations

from .errors import (
    Cancelled, DataLoss, DeadlineExceeded, Internal, InvalidArgument, NotFound, ResourceExhausted, SlabstreamError, SlabstreamWarning,
    Unavailable, UnknownOption,
)
from .frame import Frame, Progress
from .image import Geometry, Image, Statistics
from .insitu import Owner
from .loading import Volume, load, render, view
from .local import shutdown
from .page_state import Camera
from .planes import Plane
from .presets import presets
from .probe import Histogram, JointHistogram, Label, LabelStatistics, Sample
from .service import AsyncService, Service, connect, connect_async
from .shapes import Lines, Mesh, Points, shape_of
from .sources import Level, Source, open
from .status import Dataset, DatasetLevel, Field, Parameter, Simulation, Status, WebTraffic, Worker
from .transfer import Region, TransferFunction
from .viewer import Viewer
from .vtk import to_pyvista

__version__ = "0.2.0"

__all__ = [
    "AsyncService", "Camera", "Cancelled", "DataLoss", "Dataset", "DatasetLevel", "DeadlineExceeded", "Field", "Frame", "Geometry",
    "Histogram", "Image", "Internal", "InvalidArgument", "JointHistogram", "Label", "LabelStatistics", "Level", "Lines", "Mesh", "NotFound", "Owner",
    "Parameter", "Plane", "Points", "Progress", "Region", "ResourceExhausted", "Sample", "Service", "Simulation", "SlabstreamError", "SlabstreamWarning",
    "Source", "Statistics", "Status", "TransferFunction", "Unavailable", "UnknownOption", "Viewer", "Volume", "WebTraffic",
    "Worker", "connect", "connect_async", "load", "open", "presets", "render", "shape_of", "shutdown", "to_pyvista", "view",
]


def __getattr__(name: str) -> type:
    if name == "Widget":  # not in __all__: not everybody has what it needs
        try:
            from .widget import Widget
        except ImportError as missing:
            raise ImportError(f"slabstream.Widget needs {missing.name}: pip install 'slabstream[widget]'") from None
        return Widget
    raise AttributeError(f"module 'slabstream' has no attribute '{name}'")
