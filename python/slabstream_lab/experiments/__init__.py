"""The pages: one module an experiment, with page(run) -> Page."""
from . import combining, streaming

PAGES = {"combining": combining.page, "streaming": streaming.page}
