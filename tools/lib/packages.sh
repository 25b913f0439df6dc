# Finds out which packages the build lacks, and installs them with apt. Sourced by tools/lib/build.sh.
# shellcheck shell=bash

# Package names are the same in Debian 12, Debian 13 and Ubuntu 24.04. Each stands beside what shows that it
# is there, however it was installed: a command, or a header (any one of several).
readonly carpool_packages=(
  'g++                 command:c++'
  'clang               command:clang++'
  'cmake               command:cmake'
  'ninja-build         command:ninja'
  'pkg-config          command:pkg-config'
  'spin                command:spin'
  'libtbb-dev          header:tbb/task_arena.h'
  'libembree-dev       header:embree4/rtcore.h,embree3/rtcore.h'
  'libopenexr-dev      header:OpenEXR/ImfMultiPartOutputFile.h'
  'libhwy-dev          header:hwy/highway.h'
  'libcli11-dev        header:CLI/CLI.hpp'
  'libgtest-dev        header:gtest/gtest.h'
  'libgmock-dev        header:gmock/gmock.h'
  'libpng-dev          header:png.h'
  'zlib1g-dev          header:zlib.h'
  'libturbojpeg0-dev   header:turbojpeg.h'
  'nlohmann-json3-dev  header:nlohmann/json.hpp'
)

# Prints the folders where headers may be, one per line. No compiler is asked: there may be none yet.
header_folders() {
  local prefix
  IFS=: read -ra prefixes <<<"${CMAKE_PREFIX_PATH:-}"
  for prefix in "${prefixes[@]}" /usr/local /usr; do
    echo "$prefix/include"
    echo "$prefix/include/$(uname -m)-linux-gnu"
  done
}

# has_part KIND:NAME[,NAME...] tells whether one of the names is there.
has_part() {
  local kind=${1%%:*} name folder
  IFS=, read -ra names <<<"${1#*:}"
  for name in "${names[@]}"; do
    if [[ $kind == command ]]; then
      command -v "$name" >/dev/null && return 0
    else
      for folder in "${carpool_header_folders[@]}"; do
        [[ -e $folder/$name ]] && return 0
      done
    fi
  done
  return 1
}

# Prints the packages that are missing, one per line.
missing_packages() {
  local line package part
  mapfile -t carpool_header_folders < <(header_folders)
  for line in "${carpool_packages[@]}"; do
    read -r package part <<<"$line"
    has_part "$part" || echo "$package"
  done
}

# Installs what is missing; without apt, or without the right to use it, says what that is and exits with 2.
install_missing_packages() {
  local missing as_root=()
  mapfile -t missing < <(missing_packages)
  ((${#missing[@]} == 0)) && return
  command -v apt-get >/dev/null ||
    fail 2 "missing packages: ${missing[*]}; there is no apt-get here, so install them (or their equivalents) yourself"
  if ((EUID != 0)); then
    command -v sudo >/dev/null ||
      fail 2 "missing packages: ${missing[*]}; there is no sudo here, so have root install them with apt-get"
    as_root=(sudo)
  fi
  say "installing ${missing[*]}"
  run_logged "${carpool_root:?}/build/apt.log" apt_install "${missing[@]}" ||
    fail 2 "missing packages: ${missing[*]}; apt-get could not install them (its output is above)"
}

# Called by install_missing_packages, whose `as_root` it uses.
apt_install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
      apt-get install --yes --no-install-recommends "$@"
}
