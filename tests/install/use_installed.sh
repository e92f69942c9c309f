#!/usr/bin/env bash
# use_installed.sh PREFIX LIB EXAMPLES PYTHON FOLDER: builds the examples, in PREFIX/EXAMPLES, against what is installed in PREFIX, with its
# libraries in PREFIX/LIB, starts its programs, and leaves the picture of each client in FOLDER: commandline.png, cmake.png, pkgconfig.png,
# python.png and, if there is curl, curl.png.
set -euo pipefail
prefix="$1" lib="$1/$2" examples="$1/$3" python="$4" folder="$5"
cd "$folder"
export XDG_RUNTIME_DIR="$folder" HOME="$folder" PYTHONDONTWRITEBYTECODE=1
unset SLABSTREAM_ENDPOINT SLABSTREAM_SERVICE LD_LIBRARY_PATH

echo "-- building"
cmake -S "$examples/cpp" -B build-cmake -DCMAKE_PREFIX_PATH="$prefix" > cmake.log || { cat cmake.log; exit 1; }
cmake --build build-cmake > build.log || { cat build.log; exit 1; }
export PKG_CONFIG_PATH="$lib/pkgconfig"
flags="$(pkg-config --cflags --libs slabstream)"
# shellcheck disable=SC2086  # several flags
c++ -std=c++17 -Wall -Wextra -Wpedantic -Werror "$examples/cpp/picture.cpp" -o picture-pkgconfig $flags "-Wl,-rpath,$lib"

echo "-- starting"
gateway=
end() {
  [[ -z "$gateway" ]] || kill "$gateway"
  "$prefix/bin/slabstream" down > /dev/null
}
trap end EXIT
"$prefix/bin/slabstream" sphere --class 2 --size 40 -o ball.nrrd > /dev/null
"$prefix/bin/slabstream" up --detach --workers 1 --listen 'tcp://127.0.0.1:*' --data ball=ball.nrrd > up.log
endpoint="$(awk '/is up at/ { print $5; exit }' up.log)"
"$prefix/bin/slabstream" render ball --endpoint "$endpoint" --azimuth 30 --size 256x256 -o commandline.png
# By the module for OpenImageIO and cairo.
for ending in exr pdf; do "$prefix/bin/slabstream" render ball --endpoint "$endpoint" --size 32 -o "module.$ending"; done

echo "-- C++"
build-cmake/picture "$endpoint" ball cmake.png
./picture-pkgconfig "$endpoint" ball pkgconfig.png
./picture-pkgconfig "$endpoint" ball pkgconfig.exr
if said="$(./picture-pkgconfig "$endpoint" nothing nothing.png 2>&1)"; then
  echo "a picture of no dataset: $said"
  exit 1
fi
echo "$said"

echo "-- Python"
PYTHONPATH="$prefix/share/slabstream/python" "$python" "$examples/python/picture.py" "$endpoint" ball python.png

if command -v curl > /dev/null; then
  echo "-- curl"
  coproc gateway_process { exec "$prefix/bin/slabstream-gateway" --endpoint "$endpoint"; }
  # shellcheck disable=SC2154  # coproc sets it
  gateway="$gateway_process_PID"
  read -r _ url <&"${gateway_process[0]}"
  "$examples/curl/picture.sh" "$url" ball curl.png
fi
