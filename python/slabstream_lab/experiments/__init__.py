"""The pages: one module an experiment, with page(run) -> Page."""
from . import balance, cluster, combining, paper, partitions, scaling, streaming, sweep

PAGES = {
    "paper": paper.page,
    "partitions": partitions.page,
    "balance": balance.page,
    "cluster": cluster.page,
    "combining": combining.page,
    "streaming": streaming.page,
    "scaling": scaling.page,
    "sweep": sweep.page,
}
