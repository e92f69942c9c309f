"""Cameras that move: the views of the frames of a turntable."""
from __future__ import annotations

import math
from typing import Any, Iterator

from . import schema


def turned_views(first: Any, frames: int, turns: int) -> Iterator[Any]:
    """Frame i is turned by i / frames of all turns, from the azimuth of `first` on."""
    for i in range(frames):
        view = schema.ViewParameters()
        view.CopyFrom(first)
        if first.HasField("azimuth_degrees"):
            # Back into one turn, so that a start near the limit of angles stays valid.
            view.azimuth_degrees = math.fmod(first.azimuth_degrees + 360.0 * turns * i / frames, 360.0)
        yield view
