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

# Arguments: a command that runs another one in a container. True: as a user that is not root, on a root that cannot be written.
is_confined() { [[ "$("$@" sh -c 'id -u; touch /usr/x 2> /dev/null || echo read-only')" == 10001$'\n'read-only ]]; }

# The images of a folder; their names become $all and $server.
load_images() {
  local image
  for image in "$1"/slabstream-[0-9]*.oci.tar "$1"/slabstream-server-*.oci.tar; do
    printf '%s: %d MB\n' "$(basename "$image")" "$(($(stat -c %s "$image") / 1000000))"
    pod load --quiet --input "$image" > /dev/null
  done
  # shellcheck disable=SC2034  # of the scripts that source this one
  all="$(pod images --format '{{.Repository}}:{{.Tag}}' | grep '/slabstream:')" server="${all/slabstream:/slabstream-server:}"
}

pixels() { ffmpeg -nostdin -v error -i "$1" -f rawvideo -pix_fmt rgba "$2"; }
# No sample of two pictures differs by more than a step of 255: more workers add in another order. What the files say of how they were made
# differs.
same() {
  pixels "$1" "$work/one.raw" && pixels "$2" "$work/other.raw" &&
    python3 -c 'import sys
one, other = (open(name, "rb").read() for name in sys.argv[1:])
sys.exit(len(one) != len(other) or max(abs(a - b) for a, b in zip(one, other)) > 1)' "$work/one.raw" "$work/other.raw"
  local status=$?
  rm -f "$work/one.raw" "$work/other.raw"
  return "$status"
}
