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

case ${1:-check} in
  fix) options=-i ;;
  *) options="--dry-run --Werror" ;;
esac
git ls-files -z --cached --others --exclude-standard '*.h' '*.cpp' '*.cu' '*.cuh' | xargs -0 -r $tool $options
