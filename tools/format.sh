#!/bin/sh
# Lays out the C++ sources by .clang-format (`fix`), or says which differ (`check`).
#
# Versions of clang-format disagree about the same style, so one of them is the law: Debian 12's.
set -eu
cd "$(dirname "$0")/.."
law=14

tool=clang-format
if command -v clang-format-$law >/dev/null 2>&1; then tool=clang-format-$law; fi
version=$($tool --version | sed 's/.*version \([0-9]*\).*/\1/')
if [ "$version" != $law ]; then
  echo "Formatting is neither checked nor changed: it takes clang-format $law (Debian 12's), here is $version."
  exit 0
fi

list=$(mktemp)
trap 'rm -f "$list" "$list.bad"' EXIT
git ls-files --cached --others --exclude-standard '*.h' '*.cpp' '*.cu' '*.cuh' >"$list"
if [ "${1:-check}" = fix ]; then
  xargs -r $tool -i <"$list"
else
  while read -r file; do
    $tool "$file" | cmp -s - "$file" || { echo "$file: not as ./dev format would lay it out" && touch "$list.bad"; }
  done <"$list"
  [ ! -e "$list.bad" ]
fi
