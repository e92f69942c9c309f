#!/usr/bin/env bash
# The wheels in dist/: made again, they are the same; auditwheel agrees with the tag; and pip installs them in a bare Debian 12 with Python
# and nothing else that the programs load, where two lines of Python make the picture that `slabstream render` makes here. Needs root, and
# PyPI for the packages that the client needs. deploy/check wheels runs it. Argument: a Python with auditwheel (requirements.txt).
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../deploy/lib.sh"

[[ "$(id -u)" == 0 ]] || fail "needs root for a root folder of its own"
python="$1"
cd "$repository"
whole=(dist/slabstream-*.whl)
pure=(dist/pure/slabstream-*.whl)
work="$(mktemp -d)"
root="$work/root"
finish() {
  ! mountpoint -q "$root/proc" || umount "$root/proc"
  rm -rf "$work"
}
trap finish EXIT

say "Made again"
sha256sum "${whole[@]}" "${pure[@]}" > "$work/sums"
deploy/wheels > "$work/wheels.log"
sha256sum --check "$work/sums"

say "auditwheel"
tag="${whole[0]%.whl}"
tag="${tag##*-}"
"$python" -m auditwheel show "${whole[0]}" > "$work/auditwheel.log"
grep -A 1 'consistent with' "$work/auditwheel.log"
tr -s '\n' ' ' < "$work/auditwheel.log" | grep -q "is consistent with the following platform tag: \"$tag\"" ||
  fail "auditwheel does not agree with $tag"

say "A bare Debian 12 with Python"
debootstrap --variant=minbase --include=python3,python3-venv bookworm "$root" > "$work/debootstrap.log" 2>&1 || {
  tail -n 5 "$work/debootstrap.log" >&2
  fail "debootstrap"
}
mount -t proc proc "$root/proc"
mkdir "$root/wheels" "$root/pure"
"$python" -m pip download --quiet --disable-pip-version-check --only-binary :all: --dest "$root/wheels" "${whole[0]}"
cp "$root/wheels"/* "$root/pure/"
rm "$root"/pure/slabstream-*
cp "${pure[0]}" "$root/pure/"
# Arguments: an environment of Python, and a command in it.
in_root() { chroot "$root" env -i -C /tmp PATH="/$1/bin:/usr/bin:/bin" HOME=/root LC_ALL=C.UTF-8 "${@:2}"; }
# Arguments: an environment, which this makes, and the folder of the wheels for it.
install() {
  in_root "$1" python3 -m venv "/$1"
  in_root "$1" pip install --quiet --disable-pip-version-check --no-index --find-links "$2" slabstream
}

say "With programs: a picture"
build/bin/slabstream sphere --class 2 --size 64 -o "$root/tmp/ball.nrrd" > /dev/null
build/bin/slabstream render "$root/tmp/ball.nrrd" --local --size 200 --title "A ball" --scale-bar -o "$work/expected.png" > /dev/null
begin="$(date +%s.%N)"
install whole /wheels
installed="$(date +%s.%N)"
in_root whole python -c 'import slabstream as ss
image = ss.render("ball.nrrd", size=200, title="A ball", scale_bar=True)
for ending in ("png", "tif", "pdf"):
    image.save("ball." + ending)'
awk -v a="$begin" -v b="$installed" -v c="$(date +%s.%N)" 'BEGIN { printf "%.1f s, of which the installation %.1f s\n", c - a, b - a }'
/usr/bin/python3 -c 'import sys, numpy, PIL.Image
here, there = (numpy.asarray(PIL.Image.open(path)) for path in sys.argv[1:])
assert here.shape == there.shape == (200, 200, 4), (here.shape, there.shape)
assert here.any() and (here == there).all(), f"{(here != there).any(2).sum()} pixels differ"' "$work/expected.png" "$root/tmp/ball.png"

say "Commands"
for program in slabstream slabstream-coordinator slabstream-worker slabstream-gateway; do
  [[ "$(in_root whole "$program" --version)" =~ (^| )"$(version)"$ ]] || fail "$program --version: $(in_root whole "$program" --version)"
done
in_root whole slabstream bench --list > /dev/null
if complaint="$(in_root whole slabstream render ball.nrrd --local --size 0 -o none.png 2>&1)" || [[ $? != 2 ]]; then
  fail "slabstream render --size 0: $complaint"
fi

say "The library of owners"
in_root whole python -c 'import slabstream as ss
with ss.Owner("field", (8, 8, 8), "uint8", service="ipc:///tmp/nobody") as owner:
    owner.publish(1, __import__("numpy").zeros((8, 8, 8), "uint8"))'

say "Libraries"
package="$(in_root whole python -c 'import slabstream_programs; print(slabstream_programs.__path__[0])')"
# shellcheck disable=SC2016  # the inner shell expands them
in_root whole sh -c 'for file in "$1"/slabstream* "$1"/lib/*; do ldd "$file"; done 2>&1' ldd "$package" > "$work/loaded"
grep -q "$package/lib/libOpenImageIO" "$work/loaded" || fail "no file loads libOpenImageIO from the wheel"
glibc='^(linux-vdso|libc|libm|libdl|libpthread|librt|libresolv|libmvec|libanl|libutil|/lib64/ld-linux-.*)\.so\.'
foreign="$(grep '=>\|not found' "$work/loaded" | grep -v "=> $package/lib/" | awk '{ print $1 }' | sort -u | grep -vE "$glibc" || true)"
[[ -z "$foreign" ]] || fail "not from the wheel: $foreign"

say "Licences"
about="$root$(dirname "$package")/slabstream-$(version).dist-info"
for name in libopenimageio2.4 libzmq5 fonts-dejavu-core slabstream; do
  [[ -s "$about/licenses/$name/copyright" ]] || fail "there is no copyright of $name"
  grep -q "\"name\": \"$name\"" "$about/sboms/slabstream.spdx.json" || fail "slabstream.spdx.json does not name $name"
done

say "The client alone"
install pure /pure
in_root pure python -c 'import slabstream as ss
try:
    ss.render("ball.nrrd")
except ss.NotFound as error:
    assert "there is no program slabstream" in str(error), error
else:
    raise AssertionError("found a program")'
