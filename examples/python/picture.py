#!/usr/bin/env python3
"""Asks a service for a picture of a dataset: picture.py ENDPOINT DATASET FILE.png"""
import sys
import time

import slabstream as ss


def main() -> None:
    endpoint, dataset, file = sys.argv[1:]
    with ss.connect(endpoint=endpoint) as service:
        begin = time.perf_counter()
        image = service.render(dataset, azimuth=30, size=256)
        latency = time.perf_counter() - begin
    image.save(file)
    print(f"rendered {file} in {1000 * latency:.0f} ms")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: picture.py ENDPOINT DATASET FILE.png")
    try:
        main()
    except ss.SlabstreamError as error:
        sys.exit(f"picture.py: {error}")
