"""Reads, compares and draws the results of `slabstream experiment`.

    import slabstream_lab as lab
    run = lab.read("paper")
    slow = run.results.query("metric == 'latency' and workers == 2")   # a pandas DataFrame
    print(lab.ranking({"slab": run.value("latency", decomposition="slab", workers=2), ...}).sentence())

docs/reference/results.md defines the columns and metrics.
"""
from .ranking import Ranking, decide, ranking, rankings
from .results import ResultsError, Run, read
from .value import Value

__all__ = ["Ranking", "ResultsError", "Run", "Value", "decide", "ranking", "rankings", "read"]
