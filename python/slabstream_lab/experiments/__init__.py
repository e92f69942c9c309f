"""The pages: one module an experiment, with page(run) -> Page."""
from . import paper, streaming

PAGES = {"paper": paper.page, "streaming": streaming.page}
