# shellcheck shell=bash
# Shared by the scripts beside it; sourced, not run. Podman with runc, whose images, containers and networks are in a folder that goes with
# the script. Needs root.

work="$(mktemp -d)"
# Limits that every user has, and control groups without systemd.
cat > "$work/containers.conf" << 'END'
[containers]
default_ulimits = ["nofile=1024:1024", "nproc=1024:1024"]
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
END
export CONTAINERS_CONF="$work/containers.conf"

pod() {
  podman --root "$work/storage" --runroot "$work/run" --tmpdir "$work/tmp" --network-backend netavark --network-config-dir "$work/networks" \
    "$@"
}

clean_up() {
  pod pod rm --all --force > /dev/null 2>&1 || true
  pod rm --all --force --time 0 > /dev/null 2>&1 || true
  pod network rm "$network" > /dev/null 2>&1 || true
  pod rmi --all --force > /dev/null 2>&1 || true
  rm -rf "$work"
}
network="slabstream-check-$$"
trap clean_up EXIT

say() { printf -- '-- %s\n' "$*"; }
fail() {
  for name in $(pod ps --all --format "{{.Names}}" 2> /dev/null); do pod logs --tail 3 "$name" 2>&1 | sed "s|^|$name: |"; done >&2
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# Arguments: seconds, what is waited for, a command that is true then.
await() {
  local until=$((SECONDS + $1)) what="$2"
  while ! "${@:3}" > /dev/null 2>&1; do
    ((SECONDS < until)) || fail "$what: not within $1 s"
    sleep 0.2
  done
}
