#!/bin/sh
# lightcuts-test [OPTION...]: runs all tests of the CUDA backend from an unpacked bundle; nothing is built.
#
# Options are GoogleTest's (--gtest_filter=Cuts*). LIGHTCUTS_SCENES names the folder in which `rooms` lies, if there is
# one; without it the tests of these rooms are skipped. LIGHTCUTS_TEST_REDUCED=1 makes the tests small, for
# compute-sanitizer. For benchmarks: bin/lightcuts bench.
set -eu
[ -e /dev/nvidiactl ] || [ -e /dev/dxg ] || echo "There is no NVIDIA GPU here: what needs one will be skipped."
exec "$(dirname "$0")/test_cuda" "$@"
