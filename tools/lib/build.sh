# Gets a preset configured and built from whatever state the machine is in. Sourced by tools/run and tools/test.
# shellcheck shell=bash

carpool_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
readonly carpool_root

# Standard output belongs to the program that is run, so all words go to standard error.
say() { echo "carpool: $*" >&2; }

# fail CODE WORDS... exits with CODE after one line.
fail() {
  say "${@:2}"
  exit "$1"
}

# run_logged LOG COMMAND... keeps the command's output in LOG and shows it only if the command fails.
run_logged() {
  local log=$1 code=0
  mkdir -p "$(dirname "$log")"
  "${@:2}" >"$log" 2>&1 </dev/null || code=$?
  ((code == 0)) || cat "$log" >&2
  return "$code"
}

# shellcheck source=tools/lib/packages.sh
source "$carpool_root/tools/lib/packages.sh"

# cache_has PRESET NAME:TYPE=VALUE tells whether the build folder was configured with that.
cache_has() {
  grep -qsx -- "$2" "$carpool_root/build/$1/CMakeCache.txt"
}

# compiles COMPILER tells whether it finds its way.
compiles() {
  echo '#include <vector>' | "$1" -x c++ -fsyntax-only - 2>/dev/null
}

# compiler_of PRESET prints the compiler: clang for what people run, because it makes shading a tenth faster; the default
# one, g++, for the rest, so that tests see both. CXX, if set, decides.
compiler_of() {
  local clang
  if [[ -n ${CXX:-} ]]; then
    command -v "$CXX" || echo "$CXX"
  elif [[ $1 == release ]] && clang=$(command -v clang++) &&
    { cache_has "$1" "CMAKE_CXX_COMPILER:[A-Z]*=$clang" || compiles "$clang"; }; then
    echo "$clang"
  else
    command -v c++
  fi
}

# is_configured PRESET tells whether the build folder agrees with the presets, the compiler and CARPOOL_WERROR, if set.
is_configured() {
  local build=$carpool_root/build/$1
  [[ -f $build/build.ninja && ! $carpool_root/CMakePresets.json -nt $build/CMakeCache.txt ]] || return 1
  cache_has "$1" "CMAKE_CXX_COMPILER:[A-Z]*=$(compiler_of "$1")" || return 1
  [[ -z ${CARPOOL_WERROR:-} ]] || cache_has "$1" "CARPOOL_WERROR:BOOL=$CARPOOL_WERROR"
}

configure() {
  local preset=$1 build=$carpool_root/build/$1 compiler options=()
  is_configured "$preset" && return
  compiler=$(compiler_of "$preset")
  options+=("-DCMAKE_CXX_COMPILER=$compiler")
  [[ -n ${CARPOOL_WERROR:-} ]] && options+=("-DCARPOOL_WERROR=$CARPOOL_WERROR")
  say "configuring ($preset, $(basename "$compiler"))"
  if [[ -f $build/CMakeCache.txt ]] && ! cache_has "$preset" "CMAKE_CXX_COMPILER:[A-Z]*=$compiler"; then
    rm -rf "$build/CMakeCache.txt" "$build/CMakeFiles"  # cmake would forget the options given here
  fi
  (cd "$carpool_root" && run_logged "$build/configure.log" cmake --preset "$preset" "${options[@]}") ||
    fail 2 "the build could not be configured (its output is above)"
  touch "$build/CMakeCache.txt"  # cmake leaves its old date where nothing changed
}

# show_progress LOG copies ninja's lines to LOG and says once that something is built; on a terminal it counts.
show_progress() {
  local line said=
  : >"$1"
  while IFS= read -r line; do
    printf '%s\n' "$line" >>"$1"
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ (Building|Linking) ]] || continue
    [[ -n $said ]] || say "building; the first time takes some minutes"
    said=yes
    [[ ! -t 2 ]] || printf '\rcarpool: step %s of %s ' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
  done
  [[ ! -t 2 || -z $said ]] || printf '\r\033[K' >&2
}

# build PRESET [TARGET...] builds the targets, or all; silent where nothing is to be done.
build() {
  local preset=$1 folder=$carpool_root/build/$1 lock
  install_missing_packages
  mkdir -p "$carpool_root/build"
  exec {lock}>"$carpool_root/build/$preset.lock"  # two builds at once would write the same files
  flock "$lock"
  configure "$preset"
  if ! ninja -C "$folder" -j "$(nproc)" "${@:2}" </dev/null 2>&1 | show_progress "$folder/build.log"; then
    cat "$folder/build.log" >&2
    fail 2 "the build failed (its output is above)"
  fi
  exec {lock}>&-  # the program that is run must not hold it
}
