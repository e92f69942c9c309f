"""The pages: one module an experiment, with page(run) -> Page."""
from . import balance, streaming

PAGES = {"balance": balance.page, "streaming": streaming.page}
