#!/usr/bin/env bash
# The images of deploy/image, run by podman: a coordinator, workers and a gateway in containers of their own, on a bridge where they find one
# another by name, as a user that is not root, on root file systems that are read-only. deploy/check image runs it.
# Argument: the folder of the images.
set -euo pipefail
# shellcheck source=tests/containers/podman.sh
source "$(dirname "${BASH_SOURCE[0]}")/podman.sh"
images="$1"

hardened=(--read-only --cap-drop all --security-opt no-new-privileges --network "$network")
# Arguments: secrets, a name, options of podman; the image; then the program and its options.
start() { # NAME SECRETS IMAGE PROGRAM...
  local name="$1" secret secrets=()
  for secret in $2; do secrets+=(--secret "$secret,target=/etc/slabstream/$secret,uid=10001,gid=10001,mode=0400"); done
  pod run --detach --name "$name" "${hardened[@]}" "${secrets[@]}" --volume data:/data --health-cmd healthcheck --health-interval disable --memory 2g "${@:3}" > /dev/null
}
worker() { start "$1" worker.json "$server" slabstream-worker --service /tmp/keys/worker.json --memory 1G --log-level info; }
# `slabstream` as a client of the service. Its pictures go to the volume "pictures".
client() {
  pod run --rm "${hardened[@]}" --secret client.json,target=/etc/slabstream/client.json,uid=10001,gid=10001,mode=0400 --volume data:/data --volume pictures:/pictures \
    --env SLABSTREAM_SERVICE=/tmp/keys/client.json "$all" slabstream "$@"
}
# Arguments: an expression of Python about the service's status, `service`.
status() { pod exec coordinator slabstream status --service /tmp/keys/client.json --json | python3 -c 'import json, sys
service = json.load(sys.stdin)
print(eval(sys.argv[1]))' "$1"; }
workers() { status 'len([worker for worker in service["workers"] if not worker["leaving"]])'; }
runs() { [[ "$(status 'service["running"]')" != 0 ]]; }
has_workers() { [[ "$(workers)" == "$1" ]]; }
healthy() { pod healthcheck run "$1"; }
frames_done() { find "$pictures" -name 'scaled_*.png' | wc -l; }
has_frames() { (($(frames_done) >= $1)); }
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

say "Images"
for image in "$images"/slabstream-[0-9]*.oci.tar "$images"/slabstream-server-*.oci.tar; do
  printf '%s: %d MB\n' "$(basename "$image")" "$(($(stat -c %s "$image") / 1000000))"
  pod load --quiet --input "$image" > /dev/null
done
all="$(pod images --format '{{.Repository}}:{{.Tag}}' | grep '/slabstream:')" server="${all/slabstream:/slabstream-server:}"
for image in "$all" "$server"; do
  # shellcheck disable=SC2016  # the inner shell expands them
  # Every library of every program is there: the loader says which are not.
  missing="$(pod run --rm --network none "$image" sh -c '
    for file in /usr/bin/slabstream* /usr/bin/ffmpeg /usr/lib/slabstream/*.so /usr/lib/*/slabstream/*.so; do
      [ ! -f "$file" ] || /lib64/ld-linux-*.so.2 --list "$file"
    done 2>&1' | grep -E 'not found|error while' || true)"
  [[ -z "$missing" ]] || fail "$image lacks $missing"
  [[ "$(pod run --rm --network none --read-only "$image" sh -c 'id -u; touch /usr/x 2> /dev/null || echo read-only')" == 10001$'\n'read-only ]] ||
    fail "$image: runs as root, or writes to its root"
done

say "A coordinator, three workers and a gateway on a bridge"
pod network create "$network" > /dev/null
mkdir "$work/keys"
pod run --rm --network none "$server" make-keys --tar coordinator | tar -x -C "$work/keys"
for secret in "$work/keys"/*; do pod secret create "$(basename "$secret")" "$secret" > /dev/null; done
pod run --rm --network none --volume data:/data "$all" slabstream sphere --class 1 --size 128 -o /data/sphere.nrrd > /dev/null
pod volume create pictures > /dev/null
pod run --rm --network none --volume pictures:/pictures "$all" true
start coordinator "keys.json client.json worker.json admin.json" "$server" \
  slabstream-coordinator --listen 'tcp://{address}:7420' --keys /tmp/keys --data /data --memory 1G --log-level info
for number in 1 2 3; do worker "worker$number"; done
start gateway "client.json token" "$all" slabstream-gateway --service /tmp/keys/client.json --listen '{address}:8080' \
  --behind-proxy http://gateway:8080 --token-file /tmp/keys/token
await 20 "three workers" has_workers 3
for name in coordinator worker1 worker2 worker3 gateway; do await 10 "$name is healthy" healthy "$name"; done
pictures="$(pod volume inspect pictures --format '{{.Mountpoint}}')"

say "The picture of the service, over its own protocol and over HTTP, is that of --local"
view=(--azimuth 30 --elevation 20 --renderer raycast)
small=("${view[@]}" --size 512)
client render sphere "${small[@]}" -o /pictures/service.png
pod run --rm --network none --volume data:/data --volume pictures:/pictures "$all" slabstream render /data/sphere.nrrd --local 1 "${small[@]}" \
  -o /pictures/local.png
same "$pictures/service.png" "$pictures/local.png" || fail "the pictures differ"
pod exec gateway wget -q -O - "http://gateway:8080/api/v1/render.png?token=$(cat "$work/keys/token")&dataset=sphere&azimuth=30&elevation=20&size=512&renderer=raycast" \
  > "$work/gateway.png"
same "$work/gateway.png" "$pictures/local.png" || fail "the picture of the gateway differs"
[[ "$(pod exec gateway wget -q -O - http://gateway:8080/readyz)" == ok ]] || fail "the gateway is not ready"

say "A container that is killed in mid-frame"
big=("${view[@]}" --size 2048)
client render sphere "${big[@]}" -o /pictures/whole.png
client render sphere "${big[@]}" -o /pictures/killed.png &
picture=$!
await 30 "the frame runs" runs
pod kill worker2 > /dev/null
wait "$picture" || fail "the frame was lost"
same "$pictures/killed.png" "$pictures/whole.png" || fail "the picture differs"
await 20 "the loss is noticed" has_workers 2
pod logs coordinator 2>&1 | grep -E 'lost|2048x2048' | tail -n 2 | cut -d ' ' -f 4-

say "From 1 to 6 to 2 workers during 200 frames"
pod stop --time 40 worker3 > /dev/null
client turntable sphere "${small[@]}" --frames 200 -o '/pictures/scaled_%03d.png' > /dev/null &
turn=$!
await 60 "frame 20" has_frames 20
for number in 4 5 6 7 8; do worker "worker$number"; done
await 20 "six workers" has_workers 6
printf 'six workers after %d frames\n' "$(frames_done)"
await 120 "frame 100" has_frames 100
for number in 4 5 6 7; do
  pod stop --time 40 "worker$number" > /dev/null
  [[ "$(pod inspect "worker$number" --format '{{.State.ExitCode}}')" == 0 ]] || fail "worker$number did not leave by itself at SIGTERM"
done
has_workers 2 || fail "$(workers) workers, not 2"
printf 'two workers after %d frames\n' "$(frames_done)"
wait "$turn" || fail "frames were lost"
[[ "$(frames_done)" == 200 ]] || fail "$(frames_done) frames, not 200"
printf 'frames: %s done, %s failed\n' "$(status 'service["frames_done"]')" "$(status 'service["frames_failed"]')"

say "Health follows what happens"
pod stop --time 10 coordinator > /dev/null
if healthy worker1 > /dev/null; then fail "a worker without a coordinator is healthy"; fi
printf 'all is well\n'
