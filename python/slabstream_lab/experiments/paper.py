"""The paper, measured again: every table and figure, theirs beside ours."""
from __future__ import annotations

from ..page import Page
from ..results import Run
from . import paper_beyond, paper_cluster, paper_frames, paper_grids, paper_kernels, paper_model


def page(run: Run) -> Page:
    return Page(
        "Data-parallel volume rendering, measured again",
        "Yagel and Machiraju divided volumes into slabs, rendered each on a processor of its own and combined the images. This page has "
        "the tables and figures of their paper on today's processors: measured where this machine can (each slab rendered alone, one and "
        "two workers), simulated from the measured costs of the slabs elsewhere, and theirs beside it. Times are of different machines; "
        "shares, speed-ups and efficiencies are what to compare.",
        [
            *paper_kernels.sections(run),
            *paper_model.sections(run),
            *paper_frames.sections(run),
            *paper_cluster.sections(run),
            *paper_grids.sections(run),
            *paper_beyond.sections(run),
            paper_kernels.pictures(run),
        ],
    )
