#!/usr/bin/env bash
# The packages in dist/: checked by lintian, installed in a bare Debian 12 in build-debian/root, and run there (service.sh). Needs root.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../deploy/lib.sh"

[[ "$(id -u)" == 0 ]] || fail "needs root for a root folder of its own"
cd "$repository"
root="$repository/build-debian/root"
brain=/usr/share/mricron/templates/ch2better.nii.gz
say "lintian"
lintian --fail-on error --allow-root --tag-display-limit 4 dist/*.deb

say "A bare Debian 12"
umount "$root/proc" 2> /dev/null || true
rm -rf "$root"
debootstrap --variant=minbase bookworm "$root" > build-debian/debootstrap.log 2>&1 || fail "debootstrap; see build-debian/debootstrap.log"
rm -f "$root/etc/apt/sources.list"
cp /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list "$root/etc/apt/sources.list.d/" 2> /dev/null || true
[[ ! -f /etc/apt/sources.list ]] || cp /etc/apt/sources.list "$root/etc/apt/"
mkdir "$root/dist"
cp dist/*.deb "$root/dist/"
mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT
in_root() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
install=(apt-get install -q -y --no-install-recommends)
in_root apt-get update -q > build-debian/apt.log
programs=("$root"/dist/slabstream-server_*.deb "$root"/dist/libslabstream0_*.deb "$root"/dist/slabstream_*.deb)
programs=("${programs[@]#"$root"}")
in_root "${install[@]}" --download-only "${programs[@]}" >> build-debian/apt.log

say "From the start of the installation to a picture, without downloads"
begin="$(date +%s.%N)"
in_root "${install[@]}" "${programs[@]}" >> build-debian/apt.log 2>&1
installed="$(date +%s.%N)"
cp "$brain" "$root/var/lib/brain.nii.gz"
in_root slabstream render /var/lib/brain.nii.gz --local -o /tmp/brain.png
awk -v a="$begin" -v b="$installed" -v c="$(date +%s.%N)" 'BEGIN { printf "%.1f s, of which the installation %.1f s\n", c - a, b - a }'
in_root slabstream render /var/lib/brain.nii.gz --local --title Brain -o /tmp/brain.pdf

say "The other packages"
in_root bash -c "${install[*]} /dist/*.deb" >> build-debian/apt.log 2>&1
in_root python3 -c 'import slabstream; print("import slabstream:", slabstream.__file__)'
in_root slabstream bench --list > /dev/null
in_root slabstream-lab --help > /dev/null
for program in slabstream-coordinator slabstream-worker; do
  if in_root ldd "/usr/bin/$program" | grep -q OpenImageIO; then fail "$program loads OpenImageIO"; fi
done

say "The examples, against libslabstream-dev"
in_root "${install[@]}" g++ make cmake pkg-config curl >> build-debian/apt.log 2>&1
cp tests/install/use_installed.sh "$root/tmp/"
mkdir "$root/tmp/examples"
libraries="$(basename "$(dirname "$(echo "$root"/usr/lib/*/libslabstream.so)")")"
in_root /tmp/use_installed.sh /usr "lib/$libraries" share/doc/libslabstream-dev/examples python3 /tmp/examples
for client in cmake pkgconfig python curl; do
  [[ -s "$root/tmp/examples/$client.png" ]] || fail "the example for $client made no picture"
done

say "The units"
units=("$root"/lib/systemd/system/slabstream-*.service)
if in_root sh -c 'command -v systemd-analyze > /dev/null'; then
  in_root systemd-analyze verify --man=no slabstream-coordinator.service slabstream-worker@1.service slabstream-gateway.service
  for unit in "${units[@]}"; do in_root systemd-analyze security --offline=yes --threshold=30 --no-pager "${unit#"$root"}" | tail -n 1; done
else
  say "skipped: there is no systemd-analyze"
fi
unshare --net "$repository/tests/debian/service.sh" "$root"
if in_root sh -c 'test -x /lib/systemd/systemd'; then
  "$repository/tests/debian/systemd.sh" "$root" || [[ $? == 77 ]] || fail "the units under systemd"
fi

say "Manual pages"
for page in "$root"/usr/share/man/man1/slabstream*.1.gz; do
  complaints="$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 > /dev/null)"
  [[ -z "$complaints" ]] || fail "$page: $complaints"
done
say "Purging"
in_root bash -c "dpkg --purge slabstream-lab python3-slabstream libslabstream-dev slabstream libslabstream0 slabstream-server" >> build-debian/apt.log 2>&1
left="$(find "$root/etc" "$root/usr" "$root/var/lib/slabstream" "$root/var/cache" -name '*slabstream*' 2> /dev/null | grep -v '/var/cache/apt' || true)"
[[ -z "$left" ]] || printf 'left behind: %s\n' "$left"
