#!/usr/bin/env python3
"""A picture of an array that a Dask cluster on this machine has computed, chunk by chunk: dask_array.py FILE.png"""
import sys

import dask.array as da
import distributed

import slabstream as ss
import slabstream.dask as sd


def waves() -> da.Array:
    """512 MiB of float32 in chunks of 128 x 128 x 128; z, y, x."""
    z, y, x = (da.linspace(-20, 20, 512, chunks=128, dtype="float32") for _ in range(3))
    radius = da.sqrt(z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2)
    return da.cos(radius) / (1 + radius)


def main() -> None:
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1) as cluster, distributed.Client(cluster) as client:
        with sd.start(client):
            array = waves().persist()
            sd.render(array, transfer="viridis", azimuth=30, size=512).save(sys.argv[1])
        print(f"rendered {sys.argv[1]}: its voxels have stayed with {len(client.nthreads())} workers")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: dask_array.py FILE.png")
    try:
        main()
    except ss.SlabstreamError as error:
        sys.exit(f"dask_array.py: {error}")
