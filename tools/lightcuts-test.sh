#!/bin/sh
# lightcuts-test [OPTION...]: runs all tests of the CUDA backend from an unpacked bundle; nothing is built.
# lightcuts-test --sanitize [OPTION...]: runs them small under compute-sanitizer's four tools, at once; what each said
# lies in sanitize-TOOL.txt, a line of each is printed, and the exit status is 1 where one found something or a test
# failed.
#
# Options are GoogleTest's (--gtest_filter=Cuts*). LIGHTCUTS_SCENES names the folder in which `rooms` lies, if there is
# one; without it the tests of these rooms are skipped. LIGHTCUTS_TEST_REDUCED=1 makes the tests small without a
# checker. For benchmarks: bin/lightcuts bench.
set -eu
[ -e /dev/nvidiactl ] || [ -e /dev/dxg ] || echo "There is no NVIDIA GPU here: what needs one will be skipped."
test=$(dirname "$0")/test_cuda
[ "${1:-}" = --sanitize ] || exec "$test" "$@"
shift
if ! command -v compute-sanitizer > /dev/null; then
  echo "compute-sanitizer is not here: it comes with the CUDA toolkit." >&2
  exit 1
fi
export LIGHTCUTS_TEST_REDUCED=1
for tool in memcheck racecheck initcheck synccheck; do
  {
    found=0
    compute-sanitizer --tool $tool --error-exitcode 1 "$test" "$@" > sanitize-$tool.txt 2>&1 || found=1
    echo $found > sanitize-$tool.status
  } &
done
wait
status=0
for tool in memcheck racecheck initcheck synccheck; do
  [ "$(cat sanitize-$tool.status 2>/dev/null)" = 0 ] || status=1
  rm -f sanitize-$tool.status
  said=$(grep -E 'SUMMARY|^\[  (PASSED|FAILED)  \] [0-9]+ tests' sanitize-$tool.txt | sed 's/^=* *//' | tr '\n' ' ')
  echo "$tool: $said"
done
exit $status
