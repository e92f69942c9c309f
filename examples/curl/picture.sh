#!/bin/sh
# Asks a gateway for a picture of a dataset: picture.sh URL DATASET FILE.png
# URL: the address that slabstream-gateway prints, such as http://127.0.0.1:41733/#token=Jb8f...
set -eu
[ $# = 3 ] || { echo "usage: picture.sh URL DATASET FILE.png" >&2; exit 2; }
base=${1%%/#*}
token=${1#*token=}
curl --silent --show-error --fail-with-body --get "$base/api/v1/render.png" \
  --header "Authorization: Bearer $token" \
  --data-urlencode "dataset=$2" --data azimuth=30 --data size=256x256 \
  --output "$3" --write-out "rendered $3 in %{time_total} s\n"
