#!/usr/bin/env bash
# Builds and installs for recipe.yaml; rattler-build runs it in the sources.
set -euo pipefail
# Debian's names of two libraries for pkg-config.
mkdir pkgconfig
for library in hdf5-serial:hdf5 liblzf:lzf; do
  name="${library%:*}"
  cat > "pkgconfig/$name.pc" << END
Name: $name
Description: $name of conda-forge
Version: 0
Cflags: -I$PREFIX/include
Libs: -L$PREFIX/lib -l${library#*:}
END
done
export PKG_CONFIG_PATH="$PWD/pkgconfig:$PREFIX/lib/pkgconfig"
gdcm="$(find "$PREFIX/include" -name gdcmImageCodec.h)"
# shellcheck disable=SC2086  # CMAKE_ARGS has several
cmake -S . -B build -G Ninja $CMAKE_ARGS -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" -DCMAKE_INSTALL_LIBDIR=lib \
  -DCMAKE_INSTALL_RPATH_USE_LINK_PATH=ON -DGDCM_INCLUDE_DIR="$(dirname "$gdcm")" \
  -DSLABSTREAM_UNITY=ON -DSLABSTREAM_TESTS=OFF -DSLABSTREAM_BENCH=OFF
cmake --build build --parallel "$CPU_COUNT"
cmake --install build --strip
