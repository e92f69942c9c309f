#!/usr/bin/env bash
# The manifests of deploy/kubernetes: each overlay is rendered by kubectl and held against the schemas of Kubernetes; then podman plays one
# of them, and its picture is that of --local. Only a cluster can show what autoscalers, Ingress, Service, NetworkPolicy and
# PodDisruptionBudget do. deploy/check kubernetes runs it. Arguments: the folder of the images, a Python with kubernetes-validate.
set -euo pipefail
# shellcheck source=tests/containers/podman.sh
source "$(dirname "${BASH_SOURCE[0]}")/podman.sh"
images="$1" python="$2"
tests="$(dirname "${BASH_SOURCE[0]}")"
manifests="$tests/../../deploy/kubernetes"

say "Images and keys"
load_images "$images"
pod run --rm --network none "$server" make-keys slabstream-coordinator-pod-0 > "$work/keys.yaml"
mapfile -t keys < <(sed -n 's/^  \([a-z.]*\): ..........*/\1/p' "$work/keys.yaml" | grep -v '^name$')
printf '%s\n' "${keys[*]}"

say "Each overlay, rendered and validated"
for folder in "$manifests"/base "$manifests"/overlays/*; do
  kubectl kustomize "$folder" > "$work/rendered.yaml"
  printf '%s: ' "$(basename "$folder")"
  "$python" -B "$tests/validate.py" "${keys[@]}" < "$work/rendered.yaml"
done

say "podman kube play of the overlay one-node: a coordinator, two workers and a gateway"
pod network create "$network" > /dev/null
kubectl kustomize "$tests/played" > "$work/played.yaml"
pod kube play "$work/keys.yaml" > /dev/null
pod kube play --network "$network" --start=false "$work/played.yaml" > /dev/null
# Podman 4.3 mounts the values of a Secret as they stand in the manifest, in base64.
for file in "$(pod volume inspect slabstream-keys --format '{{.Mountpoint}}')"/*; do
  base64 -d "$file" > "$work/value"
  cat "$work/value" > "$file"
done
pod pod start slabstream-coordinator-pod-0 > /dev/null # whose name others wait for
pod pod start slabstream-{worker-pod-0,worker-pod-1,gateway-pod-0} > /dev/null
coordinator=slabstream-coordinator-pod-0-coordinator gateway=slabstream-gateway-pod-0-gateway
# At the pod's loopback, as kubectl port-forward asks; healthcheck below asks at its address, as Kubernetes does.
ready() { [[ "$(pod exec "$gateway" wget -q -O - http://127.0.0.1:8080/readyz)" == ok ]]; }
await 30 "the gateway is ready" ready
for container in "$coordinator" "$gateway" slabstream-worker-pod-0-worker slabstream-worker-pod-1-worker; do
  await 30 "$container is well" pod exec "$container" healthcheck
  is_confined pod exec "$container" || fail "$container: runs as root, or writes to its root"
done
volume="$(pod volume inspect slabstream-data --format '{{.Mountpoint}}')"
pod exec "$gateway" slabstream sphere --class 1 --size 64 -o /tmp/sphere.nrrd > /dev/null
pod cp "$gateway:/tmp/sphere.nrrd" "$volume/sphere.nrrd" # as kubectl cp does
options=(--azimuth 30 --elevation 20 --size 512 --renderer raycast)
pod exec "$gateway" slabstream render sphere --service /tmp/keys/client.json "${options[@]}" -o /tmp/service.png
pod exec "$gateway" slabstream render /tmp/sphere.nrrd --local 1 "${options[@]}" -o /tmp/local.png
for picture in service local; do pod cp "$gateway:/tmp/$picture.png" "$work/$picture.png"; done
same "$work/service.png" "$work/local.png" || fail "the pictures differ"
say "What autoscalers read"
# shellcheck disable=SC2016  # the inner shell expands it
pod exec "$gateway" sh -c 'wget -q -O - --header "Authorization: Bearer $(cat /tmp/keys/token)" \
  "http://$(hostname -i | cut -d " " -f 1):8080/metrics"' | grep -E '^slabstream_service_(queued|workers) '

say "A worker that is stopped leaves by itself"
pod stop --time 60 slabstream-worker-pod-1-worker > /dev/null
[[ "$(pod inspect slabstream-worker-pod-1-worker --format '{{.State.ExitCode}}')" == 0 ]] || fail "it was killed"
pod logs slabstream-coordinator-pod-0-coordinator 2>&1 | tail -n 1 | cut -d ' ' -f 4-
printf 'all is well; autoscalers, Ingress, Service, NetworkPolicy and PodDisruptionBudget have no part in this: they need a cluster\n'
