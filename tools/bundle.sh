#!/bin/sh
# bundle.sh BUILD_FOLDER TARGET_FOLDER [--with-tests]: packs the program with the shared libraries that it needs.
#
# The archive can be unpacked anywhere and runs where glibc is as new as here (Debian 12's is 2.36). glibc itself is
# left to the system: it belongs to the kernel and the loader there. With the CUDA backend the bundle holds its tests too,
# as bin/lightcuts-test, for machines that have a GPU but no compiler; `--with-tests` adds all other test programs.
set -eu
build=$1
target=$2
limit_mib=25

version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
name=lightcuts-$version-linux-$(uname -m)
stage=$build/bundle/$name
rm -rf "$build/bundle"
mkdir -p "$stage/bin" "$stage/lib" "$stage/licenses" "$target"

# The programs.
programs=$build/bin/lightcuts
if [ "${3:-}" = --with-tests ]; then
  programs="$programs $(ls "$build"/bin/test_*)"
elif [ -x "$build/bin/test_cuda" ]; then
  programs="$programs $build/bin/test_cuda"
fi
install -m 755 -s $programs "$stage/bin/"
patchelf --set-rpath '$ORIGIN/../lib' "$stage"/bin/*
install -D -m 644 -t "$stage/share/lightcuts/study_report" apps/lightcuts/bench_study/study_report/*.py

# Their libraries, but glibc's.
ldd $programs | awk '$2 == "=>" && $1 !~ /^(libc|libm|libdl|libpthread|librt|libresolv|libutil)\.so/ { print $3 }' |
  sort -u >"$build/bundle/libraries"
while read -r library; do
  install -m 644 "$library" "$stage/lib/"
done <"$build/bundle/libraries"
patchelf --set-rpath '$ORIGIN' "$stage"/lib/*

needed=$(objdump -T "$stage"/bin/* "$stage"/lib/* | grep -o 'GLIBC_[0-9.]*' | sort -Vu | tail -n 1)
if [ -x "$stage/bin/test_cuda" ]; then install -m 755 tools/lightcuts-test.sh "$stage/bin/lightcuts-test"; fi

# The licences: ours, those of the libraries, those of the libraries that were compiled in.
cp LICENSE README.md CHANGELOG.md "$stage/"
{
  while read -r library; do
    real=$(readlink -f "$library")
    dpkg-query --search "$library" "$real" "${real#/usr}" 2>/dev/null | sed -n '1s/:.*//p'
  done <"$build/bundle/libraries"
  printf '%s\n' libcli11-dev nlohmann-json3-dev libxsimd-dev libfmt-dev libdraco-dev libmeshoptimizer-dev
} | sort -u | while read -r package; do
  cp "/usr/share/doc/$package/copyright" "$stage/licenses/$package.txt"
done

# The archive: the same files give the same bytes. The kernels stand in both programs, farther apart than xz remembers by
# itself.
archive=$target/$name.tar.xz
tar --create --directory "$build/bundle" --sort=name --owner=0 --group=0 --numeric-owner --mtime=2000-01-01 "$name" |
  xz --lzma2=preset=9e,dict=128MiB >"$archive.tmp"
mv "$archive.tmp" "$archive"

size=$(stat -c %s "$archive")
echo "$archive: $((size / 1024)) KiB, runs on glibc ${needed#GLIBC_} and later"
if [ "$size" -gt $((limit_mib * 1024 * 1024)) ]; then
  echo "bundle.sh: the archive is larger than $limit_mib MiB" >&2
  exit 1
fi
