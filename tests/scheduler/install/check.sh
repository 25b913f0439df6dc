#!/usr/bin/env bash
# Installs the scheduler, which is built alone, and uses it from outside: check.sh CMAKE CXX PKG_CONFIG SCHEDULER VERSION
# GENERATOR.
set -euo pipefail
readonly cmake=$1 cxx=$2 pkg_config=$3 scheduler=$4 version=$5
export CMAKE_GENERATOR=$6  # the one that is here: a fresh machine may have no other
outsider=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
readonly outsider

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# quietly COMMAND... shows what the command wrote only if it fails.
quietly() { "$@" >"$folder/log" 2>&1 || { cat "$folder/log"; return 1; }; }

# expect WAY PROGRAM runs the program and compares what it says.
expect() {
  local said
  said=$("$2")
  [[ $said == "$version 333833500" ]] || { echo "$1: the program says '$said'"; return 1; }
  echo "$1: works"
}

configure() { quietly "$cmake" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DCMAKE_CXX_COMPILER="$cxx" "$@"; }

configure -S "$scheduler" -B "$folder/alone" -DCARPOOL_SCHEDULER_PROGRAMS=OFF
quietly "$cmake" --build "$folder/alone" --parallel 2
quietly "$cmake" --install "$folder/alone" --prefix "$folder/first"
mv "$folder/first" "$folder/moved"  # a prefix may be moved
mv "$folder/alone" "$folder/gone"   # and does not need the build any more

configure -S "$outsider" -B "$folder/found" -DFROM=install -DVERSION="$version" -DCMAKE_PREFIX_PATH="$folder/moved"
quietly "$cmake" --build "$folder/found"
expect find_package "$folder/found/outsider"

pc=$(find "$folder/moved" -name carpool.pc -printf '%h')
read -ra flags <<<"$(PKG_CONFIG_PATH=$pc "$pkg_config" --cflags --libs carpool)"
[[ $(PKG_CONFIG_PATH=$pc "$pkg_config" --modversion carpool) == "$version" ]]
quietly "$cxx" -std=c++20 "$outsider/main.cpp" "${flags[@]}" -o "$folder/flagged"
expect pkg-config "$folder/flagged"

configure -S "$outsider" -B "$folder/fetched" -DFROM="$scheduler"
quietly "$cmake" --build "$folder/fetched" --parallel 2
expect FetchContent "$folder/fetched/outsider"

# Every public header stands alone, and needs nothing that is not installed.
read -ra flags <<<"$(PKG_CONFIG_PATH=$pc "$pkg_config" --cflags carpool)"
for header in "$folder"/moved/include/carpool/*.h; do
  quietly "$cxx" -std=c++20 -Wall -Wextra -Werror -fsyntax-only -x c++ "${flags[@]}" -include "$header" /dev/null
done
echo "public headers: stand alone"
