#!/usr/bin/env bash
# reproducible.sh FOLDER: makes the Debian packages of the commit twice, in folders of FOLDER, and compares them byte by byte. The second time
# path, time zone, language, umask and number of jobs differ, and no compiler cache helps. Takes as long as two builds.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../deploy/lib.sh"

folder="$(realpath "$1")"
SOURCE_DATE_EPOCH="$(git -C "$repository" log -1 --format=%ct)"
export SOURCE_DATE_EPOCH
first="$folder/first" second="$folder/second/in a folder/with another name"
for clone in "$first" "$second"; do
  rm -rf "$clone"
  mkdir -p "$(dirname "$clone")"
  git clone -q --no-hardlinks "$repository" "$clone"
done
say "The first time"
(umask 022 && TZ=UTC "$first/deploy/debian-packages")
say "The second time, in another folder"
(umask 077 && CCACHE_DISABLE=1 TZ=Asia/Kolkata LC_ALL=C CMAKE_BUILD_PARALLEL_LEVEL=1 "$second/deploy/debian-packages")

different=0
for package in "$first"/dist/*.deb; do
  other="$second/dist/$(basename "$package")"
  if cmp -s "$package" "$other"; then
    printf 'same       %s  %s\n' "$(sha256sum < "$package" | cut -c 1-16)" "$(basename "$package")"
    continue
  fi
  different=1
  printf 'different  %s\n' "$(basename "$package")"
  for made in "$package" "$other"; do dpkg-deb --extract "$made" "$folder/unpacked-$([[ "$made" == "$package" ]] && echo 1 || echo 2)"; done
  diff -rq "$folder/unpacked-1" "$folder/unpacked-2" | head -n 5 || true
  rm -rf "$folder"/unpacked-[12]
done
[[ "$different" == 0 ]] || fail "two builds of one commit differ"
