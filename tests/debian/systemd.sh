#!/usr/bin/env bash
# systemd.sh ROOT: boots the systemd of ROOT in namespaces of its own, starts the installed units, and asks for a picture: users, credentials and
# hardening are then the real ones. Exit status 77: systemd does not start here.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../deploy/lib.sh"

root="$1"
group="slabstream-$$"
for hierarchy in /sys/fs/cgroup/systemd /sys/fs/cgroup/unified; do
  if ! mkdir "$hierarchy/$group" 2> /dev/null; then
    say "skipped: no cgroups of the hybrid kind, in which this script starts systemd"
    exit 77
  fi
done

# shellcheck disable=SC2016  # the inner shell expands them
boot='
  for hierarchy in systemd unified; do echo $$ > "/sys/fs/cgroup/$hierarchy/'"$group"'/cgroup.procs"; done
  exec unshare --fork --kill-child --pid --mount --net --uts --ipc --cgroup bash -c '\''
    set -e
    mount --make-rprivate /
    mount --bind "$0" "$0"
    mount -t proc proc "$0/proc"
    mount -t sysfs sysfs "$0/sys"
    mount -t tmpfs tmpfs "$0/sys/fs/cgroup"
    mkdir "$0/sys/fs/cgroup/systemd" "$0/sys/fs/cgroup/unified"
    mount -t cgroup -o none,name=systemd cgroup "$0/sys/fs/cgroup/systemd"
    mount -t cgroup2 cgroup2 "$0/sys/fs/cgroup/unified"
    mount -t tmpfs tmpfs "$0/run"
    ip link set lo up
    cd "$0"
    pivot_root . mnt  # not chroot, in which no service may have a user namespace
    exec env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin sh -c "umount -l /mnt && mount --make-rshared / && exec /lib/systemd/systemd --system"
  '\'' "$0"'
bash -c "$boot" "$root" > "$root/../systemd.log" 2>&1 < /dev/null &
unshare=$!
cleanup() {
  kill -KILL "$unshare" 2> /dev/null || true
  wait "$unshare" 2> /dev/null || true
  sleep 1
  find "/sys/fs/cgroup/systemd/$group" "/sys/fs/cgroup/unified/$group" -depth -type d -exec rmdir {} \; 2> /dev/null || true
}
trap cleanup EXIT
inside() { nsenter --target "$init" --mount --uts --ipc --net --pid env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"; }

say "Booting systemd"
state=""
for ((i = 0; i < 150; ++i)); do
  init="$(pgrep -P "$unshare" || true)"
  [[ -z "$init" ]] || state="$(inside systemctl is-system-running 2> /dev/null || true)"
  [[ "$state" != running && "$state" != degraded ]] || break
  sleep 0.2
done
if [[ "$state" != running && "$state" != degraded ]]; then
  say "skipped: systemd does not start here (state '$state')"
  exit 77
fi

inside systemctl stop 'getty*' 'systemd-logind' 2> /dev/null || true
units=(slabstream-coordinator slabstream-worker@1 slabstream-worker@2 slabstream-gateway)
inside systemctl start "${units[@]}" || {
  inside journalctl --no-pager -b -n 30 -u 'slabstream-*' >&2
  fail "the units do not start"
}
inside install -D -o slabstream -g slabstream -m 0644 /var/lib/brain.nii.gz /var/lib/slabstream/data/brain.nii.gz
for unit in "${units[@]}"; do inside systemctl show -P Id -P User -P ActiveState "$unit" | xargs; done
service=(env SLABSTREAM_SERVICE=/var/lib/slabstream/keys/client.json)
inside "${service[@]}" slabstream render brain --renderer raycast -o /root/systemd.png
inside "${service[@]}" slabstream status | head -n 12
inside systemctl stop slabstream-worker@1
inside systemctl show -P Result -P ExecMainStatus slabstream-worker@1
inside systemctl stop slabstream-coordinator slabstream-worker@2 slabstream-gateway
failed="$(inside systemctl list-units --failed --no-legend 'slabstream-*')"
if [[ -n "$failed" ]]; then
  inside journalctl --no-pager -b -n 30 -u 'slabstream-*' >&2
  fail "failed units: $failed"
fi
say "All units started, drew and stopped"
