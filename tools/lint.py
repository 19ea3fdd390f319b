"""lint.py BUILD_FOLDER: clang-tidy over the library (src/), remembering what passed.

A source that passed is not looked at again until it, a header of ours that it includes, its compile command, .clang-tidy,
clang-tidy or this script changes. What passed is kept in ~/.cache/lightcuts (or XDG_CACHE_HOME), so that a fresh clone profits
too. Versions of clang-tidy warn of different things, so one of them is the law: Debian 12's.
"""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
LAW = "14"
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def clang_tidy():
    """The name of the clang-tidy to use and its version, or None and what is wrong."""
    for name in (f"clang-tidy-{LAW}", "clang-tidy"):
        if shutil.which(name):
            version = subprocess.run([name, "--version"], capture_output=True, text=True, check=True).stdout
            major = re.search(r"version (\d+)", version)[1]
            return (name, version) if major == LAW else (None, f"here is version {major}")
    return None, "here is none"


def really_lints(tool):
    """Whether the tool finds the fault in a faulty source: a linter that is broken must not look like clean code."""
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "faulty.cpp"
        source.write_text("struct A { virtual ~A(); virtual void f(); };\nstruct B : A { void f(); };\n", encoding="utf-8")
        done = subprocess.run([tool, f"--config-file={ROOT}/.clang-tidy", str(source), "--", "-std=c++20"],
                              capture_output=True, text=True, check=False)
        return done.returncode != 0 and "modernize-use-override" in done.stdout


def our_headers(file, seen):
    """Adds to `seen` the file and all of our headers that it includes, directly or not."""
    if file in seen:
        return
    seen.add(file)
    for name in INCLUDE.findall(file.read_text(encoding="utf-8")):
        for base in (file.parent, ROOT / "include", ROOT / "src", ROOT / "apps", ROOT / "tests"):
            if (base / name).is_file():
                our_headers((base / name).resolve(), seen)
                break


def fingerprint(entry, version):
    """Changes with anything that clang-tidy's answer depends on, but not with the place of the checkout."""
    files = set()
    our_headers(pathlib.Path(entry["file"]), files)
    digest = hashlib.sha256((version + entry["command"].replace(str(ROOT), "")).encode())
    for file in [ROOT / ".clang-tidy", ROOT / "tools" / "lint.py", *sorted(files)]:
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def lint(tool, build, entry):
    command = [tool, "-p", str(build), "--quiet", f"--header-filter={ROOT}/(include|src|apps|tests|bench)/.*",
               "--extra-arg=-Wno-unknown-warning-option", "--extra-arg=-Wno-ignored-optimization-argument", entry["file"]]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode == 0, f"{entry['file']}: status {done.returncode}\n{done.stdout}{done.stderr}"


def main():
    build = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve()
    tool, version = clang_tidy()
    if tool is None:
        print(f"Nothing is linted: it takes clang-tidy {LAW} (Debian 12's), {version}.")
        return 0
    if not really_lints(tool):
        print(f"{shutil.which(tool)} finds no fault in a faulty source, so it cannot be trusted; reinstall clang-tidy.")
        return 1
    passed = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "lightcuts" / "lint"
    passed.mkdir(parents=True, exist_ok=True)

    entries = [entry for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
               if entry["file"].endswith(".cpp") and pathlib.Path(entry["file"]).is_relative_to(ROOT / "src")]
    todo = []
    for entry in entries:
        mark = passed / fingerprint(entry, version)
        if not mark.exists():
            todo.append((entry, mark))

    failures = 0
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS", os.cpu_count() or 1))) as pool:
        results = pool.map(lambda work: (work, lint(tool, build, work[0])), todo)
        for (entry, mark), (clean, words) in results:
            if clean:
                mark.touch()
            else:
                failures += 1
                print(words.strip().replace(str(ROOT) + "/", ""))
    print(f"{len(entries)} sources: {len(entries) - len(todo)} as when they passed, {len(todo)} looked at, {failures} with faults.")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
