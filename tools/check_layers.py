"""Checks the ranks of the folders: an include points to a lower rank, or stays in its folder.

So the public headers know nothing of the rest, formulas know nothing of files, and the backends (cpu, cuda) and
render never see each other. docs/architecture.md says why. `--self-test` checks the checker.
"""

import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent

RANKS = {
    "include/lightcuts": -1,
    "src/math": 0,
    "src/kernels": 1, "src/scene": 1, "src/image": 1,
    "src/io": 2, "src/backend": 2,
    "src/cpu": 3, "src/cuda": 3, "src/render": 3,
    "apps": 4,
}
# The one file that hands `render` its backend, so that nothing else need know both.
GLUE = {"src/render/make_backend.cpp"}
SOURCES = {".h", ".cpp", ".cu", ".cuh", ".inl"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def folder_of(path):
    """The ranked folder that a path (relative to the root) lies in, or None."""
    return next((folder for folder in RANKS if path == folder or path.startswith(folder + "/")), None)


def resolve(root, file, name):
    """The path, relative to the root, that `#include "name"` of a file means, or None for a foreign header."""
    for base in (file.parent, root / "include", root / "src", root / "apps"):
        candidate = (base / name).resolve()
        if candidate.is_file() and candidate.is_relative_to(root):
            return candidate.relative_to(root).as_posix()
    return None


def fault_of_include(root, file, name):
    here = file.relative_to(root).as_posix()
    folder = folder_of(here)
    if name.startswith("xsimd/") and folder != "src/cpu":
        return "the SIMD library stays in src/cpu, so that nvcc never sees it"
    if name == "iostream" and folder != "apps":
        return "the library never prints"
    target = resolve(root, file, name)
    other = target and folder_of(target)
    if target is None or other == folder or here in GLUE:
        return None
    if other is None:
        return f"{target} is in no ranked folder"
    if RANKS[other] >= RANKS[folder]:
        return f"{folder} (rank {RANKS[folder]}) must not see {other} (rank {RANKS[other]})"
    return None


def faults(root):
    for folder in RANKS:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in SOURCES:
                continue
            here = file.relative_to(root).as_posix()
            if file.suffix in {".cu", ".cuh"} and folder != "src/cuda":
                yield f"{here}:1: CUDA sources stay in src/cuda"
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(line)
                fault = match and fault_of_include(root, file, match[2])
                if fault:
                    yield f'{here}:{number}: includes "{match[2]}": {fault}'
    for folder in sorted(path for path in (root / "src").glob("*") if path.is_dir()):
        if folder.relative_to(root).as_posix() not in RANKS:
            yield f"{folder.relative_to(root)}:1: this folder has no rank; give it one in tools/check_layers.py"


def self_test():
    """Each case: files, and the start of the faults that they must give."""
    cases = [
        ({"src/math/a.h": '#include "lightcuts/b.h"', "include/lightcuts/b.h": ""}, []),
        ({"src/io/a.cpp": "\n#include \"image/b.h\"", "src/image/b.h": ""}, []),
        ({"src/image/a.h": '#include "io/b.h"', "src/io/b.h": ""}, ["src/image/a.h:1: "]),
        ({"src/scene/a.h": '\n#include "image/b.h"', "src/image/b.h": ""}, ["src/scene/a.h:2: "]),
        ({"src/render/a.cpp": '#include "../cpu/b.h"', "src/cpu/b.h": ""}, ["src/render/a.cpp:1: "]),
        ({"src/render/make_backend.cpp": '#include "cpu/b.h"', "src/cpu/b.h": ""}, []),
        ({"include/lightcuts/a.h": '#include "math/b.h"', "src/math/b.h": ""}, ["include/lightcuts/a.h:1: "]),
        ({"src/kernels/a.h": "#include <xsimd/xsimd.hpp>"}, ["src/kernels/a.h:1: "]),
        ({"src/cpu/a.h": "#include <xsimd/xsimd.hpp>", "src/cpu/b.cu": ""}, ["src/cpu/b.cu:1: "]),
        ({"src/io/a.cpp": "#include <iostream>", "src/odd/a.h": ""}, ["src/io/a.cpp:1: ", "src/odd:1: "]),
    ]
    for files, expected in cases:
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            for path, text in files.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text + "\n", encoding="utf-8")
            found = list(faults(root))
        same = len(found) == len(expected) and all(a.startswith(b) for a, b in zip(found, expected))
        assert same, f"{files}: expected {expected}, found {found}"
    print(f"{len(cases)} cases of the checker itself hold.")


def main():
    if "--self-test" in sys.argv:
        self_test()
        return 0
    found = list(faults(ROOT))
    print("\n".join(found) if found else "Every include points to a lower rank.")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
