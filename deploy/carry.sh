# shellcheck shell=bash
# What deploy/image and deploy/wheels share: roots with programs, the libraries of this machine that they load, and the copyright and the
# description of every package that these come from. Sourced after lib.sh. The caller makes the folder $work.
# shellcheck disable=SC2154  # work, repository

# The programs, into $work/programs: those of dist/*.deb, else those of build/ if they run on every processor, else of packages that are made
# now. The one place that knows where they come from.
install_programs() {
  local folder="$work/programs" package
  mkdir -p "$folder"
  if ! compgen -G "$repository/dist/*.deb" > /dev/null; then
    if [[ -x "$repository/build/bin/slabstream-worker" && "$(configured SLABSTREAM_NATIVE)" != ON ]]; then
      cmake --install "$repository/build" --prefix "$folder/usr" --strip > /dev/null
      return
    fi
    "$repository/deploy/debian-packages"
  fi
  for package in "$repository"/dist/*.deb; do dpkg-deb --extract "$package" "$folder"; done
}

# Arguments: a root, and programs that come into it.
pick_programs() {
  local root="$1" program
  mkdir -p "$root/usr/bin"
  for program in "${@:2}"; do cp "$work/programs/usr/bin/$program" "$root/usr/bin/"; done
}

# The client library, into a root.
pick_library() { (cd "$work/programs" && find usr/lib -name 'libslabstream.so.*' -exec cp -d --parents -t "$1" {} +); }

# What writes EXR, TIFF, PDF and SVG, into a root.
pick_modules() { (cd "$work/programs" && find usr/lib -path '*/slabstream/*.so' -exec cp --parents -t "$1" {} +); }

# A file of this machine, into a root at the same place, and the links that lead to it. Notes in $work/carried what it copied.
carry() {
  local root="$1" path target
  path="$(realpath "$(dirname "$2")")/$(basename "$2")"
  [[ ! -e "$root$path" && ! -L "$root$path" ]] || return 0
  mkdir -p "$root$(dirname "$path")"
  cp -d "$path" "$root$path"
  if [[ -L "$path" ]]; then
    target="$(readlink "$path")"
    [[ "$target" == /* ]] || target="$(dirname "$path")/$target"
    carry "$root" "$target"
  else
    printf '%s\n' "$path" >> "$work/carried"
  fi
}

# The libraries that the executables and modules in a root load.
carry_libraries() {
  local root="$1" path loaded
  loaded="$(find "$root/usr" -type f \( -perm /111 -o -name '*.so*' \) -exec sh -c 'ldd "$@" 2> /dev/null' ldd {} + | sort -u)"
  if grep 'not found' <<< "$loaded"; then fail "these libraries are missing"; fi
  while read -r path; do
    carry "$root" "$path"
  done < <(awk '$2 == "=>" && $3 ~ /^\// { print $3 } $1 ~ /^\// && $2 ~ /^\(/ { print $1 }' <<< "$loaded")
}

# The copyright and the description of each package that a file of $work/carried belongs to, and the list of them all (deploy/sbom).
# Arguments: a root, and the name of the whole.
describe_packages() {
  local root="$1" name="$2" package paths=()
  # Packages name a library by /lib or by /usr/lib.
  mapfile -t paths < <(sed 'p; s|^/usr||' "$work/carried")
  mkdir -p "$root/var/lib/dpkg/status.d"
  for package in $({ dpkg-query --search "${paths[@]}" 2> /dev/null || true; } | sed -n '/^diversion/d; s/: .*//p' | sort -u) base-files; do
    dpkg-query --status "$package" > "$root/var/lib/dpkg/status.d/${package%:*}"
    mkdir -p "$root/usr/share/doc/${package%:*}"
    cp -L "/usr/share/doc/${package%:*}/copyright" "$root/usr/share/doc/${package%:*}/"
  done
  mkdir -p "$root/usr/share/doc/slabstream"
  cp "$repository/LICENSE" "$root/usr/share/doc/slabstream/copyright"
  cp -r /usr/share/common-licenses "$root/usr/share/"
  SOURCE_DATE_EPOCH="$(epoch)" "$repository/deploy/sbom" "$root" "$name" "$(version)" > "$root/usr/share/doc/slabstream/slabstream.spdx.json"
}
