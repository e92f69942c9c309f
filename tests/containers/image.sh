#!/usr/bin/env bash
# The images of deploy/image, run by podman: a coordinator, workers and a gateway in containers of their own, on a bridge where they find
# one another by name, as a user that is not root, on root file systems that are read-only. deploy/check image runs it.
# Argument: the folder of the images.
set -euo pipefail
# shellcheck source=tests/containers/podman.sh
source "$(dirname "${BASH_SOURCE[0]}")/podman.sh"
images="$1"

hardened=(--read-only --cap-drop all --security-opt no-new-privileges --network "$network")
# Arguments: a name, secrets, the image, the program and its options. Podman's own clock for health checks would need systemd.
start() {
  local name="$1" secret secrets=()
  for secret in $2; do secrets+=(--secret "$secret,target=/etc/slabstream/$secret"); done
  pod run --detach --name "$name" "${hardened[@]}" "${secrets[@]}" --volume data:/data --memory 2g \
    --health-cmd healthcheck --health-interval disable "${@:3}" > /dev/null
}
worker() { start "$1" worker.json "$server" slabstream-worker --service /tmp/keys/worker.json --memory 1G --log-level info; }
# `slabstream` as a client of the service. Its pictures go to the volume "pictures".
client() {
  pod run --rm "${hardened[@]}" --secret client.json,target=/etc/slabstream/client.json --volume data:/data \
    --volume pictures:/pictures --env SLABSTREAM_SERVICE=/tmp/keys/client.json "$all" slabstream "$@"
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

say "Images"
load_images "$images"
for image in "$all" "$server"; do
  # shellcheck disable=SC2016  # the inner shell expands them
  # Every library of every program is there: the loader says which are not.
  missing="$(pod run --rm --network none "$image" sh -c '
    for file in /usr/bin/slabstream* /usr/bin/ffmpeg /usr/lib/slabstream/*.so /usr/lib/*/slabstream/*.so; do
      [ ! -f "$file" ] || /lib64/ld-linux-*.so.2 --list "$file"
    done 2>&1' | grep -E 'not found|error while' || true)"
  [[ -z "$missing" ]] || fail "$image lacks $missing"
  is_confined pod run --rm --network none --read-only "$image" || fail "$image: runs as root, or writes to its root"
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
pod run --rm --network none --volume data:/data --volume pictures:/pictures "$all" \
  slabstream render /data/sphere.nrrd --local 1 "${small[@]}" -o /pictures/local.png
same "$pictures/service.png" "$pictures/local.png" || fail "the pictures differ"
query="dataset=sphere&azimuth=30&elevation=20&size=512&renderer=raycast&token=$(cat "$work/keys/token")"
pod exec gateway wget -q -O - "http://gateway:8080/api/v1/render.png?$query" > "$work/gateway.png"
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
