# shellcheck shell=bash
# Shared by the scripts beside it; sourced, not run.

repository="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

# What compiling and running all programs needs, by the first words of the lines of deploy/packages.
# shellcheck disable=SC2034  # scripts use it
compiling=(run build pictures build-pictures)

say() { printf '== %s\n' "$*"; }
fail() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# The version of the project.
version() { sed -n 's/^project(slabstream VERSION \([0-9.]*\).*/\1/p' "$repository/CMakeLists.txt"; }

# The time of all files in what is made, so that the same input makes the same bytes: SOURCE_DATE_EPOCH, or that of the last commit.
epoch() { printf '%s' "${SOURCE_DATE_EPOCH:-$(git -C "$repository" log -1 --format=%ct 2> /dev/null || echo 0)}"; }

# What the configuration of build/ says of a variable: ON, OFF, or nothing.
configured() { [[ ! -f "$repository/build/CMakeCache.txt" ]] || sed -n "s/^$1:BOOL=//p" "$repository/build/CMakeCache.txt"; }

# Configures build/ with these options. A new one compiles several files at a time, which takes half the time, and kernels for the processor
# of this machine alone, which takes a third of theirs.
configure() {
  local fresh=()
  [[ -f "$repository/build/build.ninja" ]] || fresh=(-DSLABSTREAM_UNITY=ON -DSLABSTREAM_NATIVE=ON)
  say "Configuring (preset release)"
  (cd "$repository" && cmake --preset release "${fresh[@]}" "$@")
}

# Names of the packages in deploy/packages that are not installed. Arguments: the first words of the lines that count.
missing_packages() {
  local wanted installed
  wanted="$(awk -v words=" $* " '!/^ *#/ && NF && index(words, " " $1 " ") { print $2 }' "$repository/deploy/packages" | sort)"
  installed="$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' 2>/dev/null | awk '$2 == "installed" { print $1 }' | sort -u)"
  comm -23 <(printf '%s\n' "$wanted") <(printf '%s\n' "$installed")
}

# Arguments: the first words of the lines of deploy/packages that count.
install_packages() {
  local missing as_root=()
  missing="$(missing_packages "$@")"
  if [[ -z "$missing" ]]; then
    say "Debian packages: all installed"
    return
  fi
  command -v apt-get > /dev/null || fail "needs Debian's apt-get to install: ${missing//$'\n'/ }"
  if [[ "$(id -u)" != 0 ]]; then
    command -v sudo > /dev/null || fail "needs root or sudo to install: ${missing//$'\n'/ }"
    as_root=(sudo)
  fi
  say "Debian packages: installing ${missing//$'\n'/ }"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q < /dev/null
  # shellcheck disable=SC2086  # one word a package
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing < /dev/null
}
