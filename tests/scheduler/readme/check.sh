#!/bin/sh
# Compiles every C++ snippet of the scheduler's README, each in a function of its own: check.sh CXX README INCLUDE_FOLDER
set -eu
here=$(cd "$(dirname "$0")" && pwd -P)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Includes go to the top; what a snippet takes for granted is in scope around it.
awk -v readme="$2" '
  /^```cpp$/ { inside = 1; ++count; body = body "void snippet_" count "() {\n#include \"around.inc\"\n{\n#line " NR + 1 " \"" readme "\"\n"; next }
  /^```/ && inside { inside = 0; body = body "}\n}\n"; next }
  inside && /^#include/ { includes = includes $0 "\n"; body = body "\n"; next }
  inside { body = body $0 "\n" }
  END { printf "%s#include \"preamble.h\"\n%s", includes, body; print count > "/dev/stderr" }
' "$2" >"$folder/snippets.cpp" 2>"$folder/count"

[ "$(cat "$folder/count")" -ge 11 ] || { echo "the README has only $(cat "$folder/count") snippets" >&2; exit 1; }
"$1" -std=c++20 -Wall -Wextra -Werror -Wno-unused -Wno-unused-value -Wno-missing-field-initializers -fsyntax-only \
  -I"$3" -I"$here" "$folder/snippets.cpp"
