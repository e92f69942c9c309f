"""The pages: one module an experiment, with page(run) -> Page."""
from . import combining, scaling, streaming

PAGES = {"combining": combining.page, "scaling": scaling.page, "streaming": streaming.page}
