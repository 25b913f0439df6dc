#!/usr/bin/env bash
# Checks the model: check.sh SPIN CC LEVEL MODEL EXPECTED FLAGS... EXPECTED is `holds`, or what must be found wrong;
# LEVEL is for the compiler: few states are visited sooner than optimised code is made.
set -euo pipefail
readonly spin=$1 compiler=$2 level=$3 model=$4 expected=$5
shift 5

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cp "$model" protocol.pml
"$spin" -a "$@" protocol.pml
"$compiler" "$level" -w -DSAFETY -DCOLLAPSE -DMEMLIM=3000 -o pan pan.c
./pan -n -m1000000 -w24 | tee pan.log

if grep -qE 'max search depth too small|reached -DMEMLIM|out of memory' pan.log; then
  echo "check.sh: not every state was visited; raise the limits above" >&2
  exit 1
fi
if [[ $expected == holds ]]; then
  grep -q 'errors: 0' pan.log && exit
  "$spin" -t -p -g "$@" protocol.pml | tail -n 200  # the steps that lead there
  exit 1
fi
grep -q "$expected" pan.log
