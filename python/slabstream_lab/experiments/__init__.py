"""The pages: one module an experiment, with page(run) -> Page."""
from . import streaming

PAGES = {"streaming": streaming.page}
