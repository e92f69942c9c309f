"""The pages: one module an experiment, with page(run) -> Page."""
from . import combining, scaling, streaming, sweep

PAGES = {"combining": combining.page, "scaling": scaling.page, "streaming": streaming.page, "sweep": sweep.page}
