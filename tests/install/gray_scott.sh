#!/usr/bin/env bash
# gray_scott.sh PREFIX EXAMPLE FOLDER: builds EXAMPLE (examples/insitu) in FOLDER against what is installed in PREFIX, runs it on 8 ranks of
# MPI, and leaves two pictures of it, of a later time each: first.png and second.png. Fails if it is not steered, or if the dataset does not go
# with its ranks.
set -euo pipefail
prefix="$1" example="$2" folder="$3"
cd "$folder"
export XDG_RUNTIME_DIR="$folder" HOME="$folder"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
unset SLABSTREAM_ENDPOINT SLABSTREAM_SERVICE SLABSTREAM_OWNER_SERVICE LD_LIBRARY_PATH
slabstream="$prefix/bin/slabstream"

cmake -S "$example" -B build -DCMAKE_PREFIX_PATH="$prefix" > cmake.log || { cat cmake.log; exit 1; }
cmake --build build > build.log || { cat build.log; exit 1; }
"$slabstream" up --detach --workers 2 --listen 'tcp://127.0.0.1:*' > up.log
mpirun -n 8 --oversubscribe build/gray_scott 64 1000000 5 > simulation.log 2>&1 &
simulation=$!
trap 'kill "$simulation" 2> /dev/null || true; "$slabstream" down > /dev/null' EXIT

# until COMMAND...: again and again, for at most a minute.
until_true() {
  local end=$((SECONDS + 60))
  until "$@"; do
    if ((SECONDS > end)) || ! kill -0 "$simulation" 2> /dev/null; then
      cat simulation.log render.log
      exit 1
    fi
  done
}
render() { "$slabstream" render gray-scott --size 256 --azimuth 30 -o "$1" > render.log 2>&1; }
changed() { render second.png && ! cmp -s first.png second.png; }
is_gone() { "$slabstream" status | grep -q 'datasets *0'; }

until_true render first.png
until_true changed
"$slabstream" steer gray-scott feed=0.03 > /dev/null
"$slabstream" steer gray-scott | grep -q 'feed.*0\.03'
kill "$simulation"
wait "$simulation" || true
end=$((SECONDS + 60))
until is_gone; do ((SECONDS < end)); done
