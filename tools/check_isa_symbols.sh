#!/bin/sh
# check_isa_symbols.sh BUILD_FOLDER: looks for code of a special instruction set that the linker could use elsewhere.
#
# An inline function or template that is not inlined becomes a weak symbol, and of equal weak symbols in several objects
# the linker keeps any one. If that one was compiled for AVX-512, the program dies on older processors. So in objects
# whose name holds sse42, avx2 or avx512, every weak symbol must carry that name too (of a namespace or a template
# argument).
set -eu
folder=${1:-build}
found=$(mktemp)
trap 'rm -f "$found"' EXIT

for isa in sse42 avx2 avx512; do
  find "$folder" -name "*$isa*.o" | while read -r object; do
    # W, V, u: weak functions, weak variables, unique globals. Lower-case w and v are only wanted, not defined here.
    nm "$object" | sed 's/sse4_2/sse42/g' | awk -v isa=$isa '$2 ~ /^[WVu]$/ && index($3, isa) == 0 { print $3 }' | c++filt |
      sed "s|^|$object: the linker may use this $isa code on any processor: |"
  done
done >"$found"

cat "$found"
[ ! -s "$found" ]
