"""Reads an array of Zarr 3 into nothing by TensorStore: boxes of 256^3 elements, four at a time, without a cache. Prints a line of JSON."""
import itertools
import json
import sys
import time

import tensorstore

SIDE, AT_A_TIME, THREADS = 256, 4, int(sys.argv[2])
context = tensorstore.Context({"cache_pool": {"total_bytes_limit": 0},
                               "data_copy_concurrency": {"limit": THREADS}, "file_io_concurrency": {"limit": 8}})
array = tensorstore.open({"driver": "zarr3", "kvstore": {"driver": "file", "path": sys.argv[1]}}, context=context, read=True).result()
begin, size, pending = time.monotonic(), 0, []
for corner in itertools.product(*(range(0, side, SIDE) for side in array.shape)):
    if len(pending) == AT_A_TIME:
        size += pending.pop(0).result().nbytes
    pending.append(array[tuple(slice(at, min(at + SIDE, side)) for at, side in zip(corner, array.shape))].read())
size += sum(box.result().nbytes for box in pending)
print(json.dumps({"seconds": time.monotonic() - begin, "bytes": size}))
