#!/usr/bin/env bash
# service.sh ROOT: runs the command lines of the installed units in ROOT, as their users, with their options, folders and credentials, and asks
# for a picture. In a network of its own, since the units name ports.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../deploy/lib.sh"

root="$1"
ip link set lo up
trap 'kill $(jobs -p) 2> /dev/null; wait' EXIT

# Arguments: unit, setting. All values, a line each.
setting() { sed -n "s/^$2=//p" "$root/lib/systemd/system/$1"; }

# Arguments: unit, instance. Sets $process.
start() {
  local unit="$1" credentials="/run/credentials/$1$2" user command folder file pair OPTIONS=""
  user="$(setting "$unit" User)"
  for folder in $(setting "$unit" StateDirectory); do chroot "$root" install -d -o "$user" -g "$user" "/var/lib/$folder"; done
  for folder in $(setting "$unit" CacheDirectory); do chroot "$root" install -d -o "$user" -g "$user" "/var/cache/$folder"; done
  chroot "$root" install -d -o "$user" -m 0500 "$credentials"
  for pair in $(setting "$unit" LoadCredential); do
    chroot "$root" install -o "$user" -m 0400 "${pair#*:}" "$credentials/${pair%%:*}"
  done
  for file in $(setting "$unit" EnvironmentFile); do
    file="$root${file#-}"
    # shellcheck disable=SC1090  # shell and systemd read it alike
    [[ ! -f "${file//%i/$2}" ]] || source "${file//%i/$2}"
  done
  command="$(setting "$unit" ExecStart)"
  # shellcheck disable=SC2016  # the unit's own
  command="${command//%S//var/lib}" command="${command//%d/$credentials}" command="${command//'$OPTIONS'/$OPTIONS}"
  folder="$(setting "$unit" Environment)"
  # shellcheck disable=SC2086  # words
  chroot --userspec="$user:$user" --groups="$(chroot "$root" id -g "$user"),$(chroot "$root" id -g slabstream)" "$root" \
    env -i "CREDENTIALS_DIRECTORY=$credentials" ${folder//%C//var/cache} $command > "$root/tmp/$unit$2.log" 2>&1 &
  process=$!
}

say "The service, with the command lines of its units"
start slabstream-coordinator.service ""
coordinator="$process"
for ((i = 0; i < 100; ++i)); do
  [[ ! -s "$root/var/lib/slabstream/keys/client.json" ]] || break
  sleep 0.1
done
cp "$root/var/lib/brain.nii.gz" "$root/var/lib/slabstream/data/brain.nii.gz"
start slabstream-worker@.service 1
worker="$process"
start slabstream-worker@.service 2
start slabstream-gateway.service ""

as_root() { chroot "$root" env -i PATH=/usr/bin:/bin LC_ALL=C.UTF-8 SLABSTREAM_SERVICE=/var/lib/slabstream/keys/client.json "$@"; }
as_root slabstream render brain --renderer raycast -o /tmp/served.png
as_root slabstream status | head -n 8
token="$(cat "$root/etc/slabstream/gateway.token")"
exec 3<> /dev/tcp/127.0.0.1/7480
printf 'GET /api/v1/render.png?dataset=brain&size=64x64&token=%s HTTP/1.1\r\nHost: 127.0.0.1:7480\r\nConnection: close\r\n\r\n' "$token" >&3
head -n 1 <&3

say "Completion"
# shellcheck disable=SC2016  # the inner shell expands them
as_root bash -c 'source /usr/share/bash-completion/completions/slabstream
  try() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
    _slabstream
    echo "$*<Tab>: ${COMPREPLY[*]}"
    [[ ${#COMPREPLY[@]} -gt 0 ]]
  }
  try slabstream tur && try slabstream render br && try slabstream render brain --renderer = r && try slabstream slice --window l &&
    try slabstream render brain : ct-b' || fail "completion in bash"

say "Stopping"
kill "$worker"
wait "$worker" || fail "a worker that was told to stop ended with status $?"
as_root slabstream status | grep -i worker | head -n 4
kill "$coordinator"
wait "$coordinator" || fail "a coordinator that was told to stop ended with status $?"
