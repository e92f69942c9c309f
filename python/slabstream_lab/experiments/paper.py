"""Every table and figure of the paper, theirs beside ours."""
from __future__ import annotations

from ..page import Page
from ..results import Run
from . import paper_kernels


def page(run: Run) -> Page:
    return Page(
        "Data-parallel volume rendering, measured again",
        "Yagel and Machiraju divided volumes into slabs, rendered each on a processor of its own and combined the images.",
        paper_kernels.sections(run),
    )
