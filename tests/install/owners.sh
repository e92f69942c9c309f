#!/usr/bin/env bash
# owners.sh PREFIX LIB SOURCES FOLDER: builds SOURCES/owner.c, and owner.f90 if there is gfortran, against what is installed in PREFIX, with its
# libraries in PREFIX/LIB, starts a service, and leaves pictures of the same field of each in FOLDER: c.png and fortran.png.
set -euo pipefail
prefix="$1" lib="$1/$2" sources="$3" folder="$4"
cd "$folder"
export XDG_RUNTIME_DIR="$folder" HOME="$folder"
unset SLABSTREAM_ENDPOINT SLABSTREAM_SERVICE SLABSTREAM_OWNER_SERVICE LD_LIBRARY_PATH

export PKG_CONFIG_PATH="$lib/pkgconfig"
read -ra compile <<< "$(pkg-config --cflags slabstream)"
read -ra link <<< "$(pkg-config --libs slabstream) -Wl,-rpath,$lib"
cc -std=c99 -Wall -Wextra -Wpedantic -Werror "$sources/owner.c" -o owner-c "${compile[@]}" "${link[@]}"
languages=(c)
if command -v gfortran > /dev/null; then
  gfortran -std=f2018 -Wall -Wextra -Werror "$prefix/include/slabstream_insitu.f90" "$sources/owner.f90" -o owner-fortran "${link[@]}"
  languages+=(fortran)
fi

trap '"$prefix/bin/slabstream" down > /dev/null' EXIT
"$prefix/bin/slabstream" up --detach --workers 1 --listen 'tcp://127.0.0.1:*' > up.log
for language in "${languages[@]}"; do
  shown=()
  [[ "$language" == c ]] || shown=(--channel same)
  # With no service named: the one that `up` has started.
  coproc owner { exec "./owner-$language"; }
  # shellcheck disable=SC2154  # coproc sets it
  owner_pid="$owner_PID"
  read -r said <&"${owner[0]}"
  echo "$language: $said"
  for _ in {1..200}; do  # until the service has heard of a time
    "$prefix/bin/slabstream" render "$language" --size 64 --azimuth 30 --transfer viridis "${shown[@]}" -o "$language.png" > render.log 2>&1 && break
  done
  [[ -f "$language.png" ]] || cat render.log
  eval "exec ${owner[1]}>&-"
  wait "$owner_pid"
done
