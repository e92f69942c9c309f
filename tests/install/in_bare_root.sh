#!/usr/bin/env bash
# in_bare_root.sh ROOT PREFIX FOLDER COMMAND...: runs COMMAND where there is nothing of this machine but its packages: /usr and /etc, read-only,
# and the folders PREFIX as /opt/slabstream (read-only) and FOLDER as /work. ROOT: an empty folder. To be run by
# `unshare --mount --pid --fork`, with root's rights or a user namespace; its mounts end with it.
set -euo pipefail
root="$1" prefix="$2" folder="$3"
shift 3
mount -t tmpfs none "$root"
for name in usr etc opt/slabstream work proc dev tmp; do mkdir -p "$root/$name"; done
for name in bin lib lib64 sbin; do
  if [[ -L "/$name" ]]; then cp -P "/$name" "$root/$name"; fi
done
for name in usr etc; do
  mount --rbind "/$name" "$root/$name"
  mount -o remount,bind,ro "$root/$name"
done
mount --bind "$prefix" "$root/opt/slabstream"
mount -o remount,bind,ro "$root/opt/slabstream"
mount --bind "$folder" "$root/work"
mount --rbind /dev "$root/dev"
mount -t proc none "$root/proc"
chmod 1777 "$root/tmp"
exec chroot "$root" /usr/bin/env -i PATH=/usr/bin:/bin "$@"
