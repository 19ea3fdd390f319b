"""lint.py BUILD_FOLDER [FOLDER...]: clang-tidy over those of src, bench, apps, tests, remembering what passed.

Without FOLDER over the library (src). Nobody has seen the other folders clean as a whole yet; the fewer checks that they are
held to stand in their .clang-tidy.

A source that passed is not looked at again until it, a header of ours that it includes, its compile command, a .clang-tidy or
clang-tidy changes. What passed is kept in ~/.cache/lightcuts (or XDG_CACHE_HOME), so that a fresh clone profits too. Versions
of clang-tidy warn of different things, so one of them is the law: Debian 12's.

A source takes 5 to 45 s of one core, and a machine of CI may remember nothing. With LINT_SECONDS=N no look is begun after N
seconds; what changed last comes first, and how many sources were left for another time is said.
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
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
LAW = "14"
COMMENT = re.compile(rb"//(?!.*NOLINT).*")
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)
FOLDERS = ("src", "apps", "bench", "tests")
OPTIONS = ["--quiet", f"--header-filter={ROOT}/(include|{'|'.join(FOLDERS)})/.*",
           "--extra-arg=-Wno-unknown-warning-option", "--extra-arg=-Wno-ignored-optimization-argument"]


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


def sources(build, wanted):
    """The compile commands of our sources in these folders, each source once."""
    commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    folders = tuple(f"{ROOT}/{folder}/" for folder in wanted)
    ours = {entry["file"]: entry for entry in commands if entry["file"].startswith(folders) and entry["file"].endswith(".cpp")}
    return list(ours.values())


def add_headers(file, seen):
    """Adds to `seen` the file and all of our headers that it includes, directly or not."""
    if file in seen:
        return
    seen.add(file)
    for name in INCLUDE.findall(file.read_text(encoding="utf-8")):
        for base in (file.parent, ROOT / "include", *(ROOT / folder for folder in FOLDERS), ROOT / "apps" / "lightcuts"):
            if (base / name).is_file():
                add_headers((base / name).resolve(), seen)
                break


def texts_of(entry):
    files = set()
    add_headers(pathlib.Path(entry["file"]), files)
    return sorted(files)


def fingerprint(entry, version):
    """Changes with anything that clang-tidy's answer depends on, but not with comments or the place of the checkout."""
    digest = hashlib.sha256("".join([version, entry["command"], *OPTIONS]).replace(str(ROOT), "").encode())
    for file in [ROOT / ".clang-tidy", *sorted(ROOT.glob("*/.clang-tidy")), *texts_of(entry)]:
        digest.update(hashlib.sha256(COMMENT.sub(b"", file.read_bytes())).digest())
    return digest.hexdigest()


def times_of_change():
    """When each file last changed, by git [s since 1970]; what is not committed changed just now."""
    def git(*words):
        return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False).stdout.splitlines()

    changed = {ROOT / line: time.time() for line in git("ls-files", "--modified", "--others", "--exclude-standard")}
    when = 0
    for line in git("log", "--format=:%ct", "--name-only"):
        if line.startswith(":"):
            when = int(line[1:])
        elif line:
            changed.setdefault(ROOT / line, when)
    return changed


def lint(tool, build, entry, deadline):
    """Whether the source is clean, and clang-tidy's words; None and none where there was no time left to look."""
    if time.monotonic() > deadline:
        return None, ""
    done = subprocess.run([tool, "-p", str(build), *OPTIONS, entry["file"]], capture_output=True, text=True, check=False)
    return done.returncode == 0, f"{entry['file']}: status {done.returncode}\n{done.stdout}{done.stderr}"


def main():
    build = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve()
    deadline = time.monotonic() + float(os.environ.get("LINT_SECONDS", "inf"))
    tool, version = clang_tidy()
    if tool is None:
        print(f"Nothing is linted: it takes clang-tidy {LAW} (Debian 12's), {version}.")
        return 0
    if not really_lints(tool):
        print(f"{shutil.which(tool)} finds no fault in a faulty source, so it cannot be trusted; reinstall clang-tidy.")
        return 1
    passed = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "lightcuts" / "lint"
    passed.mkdir(parents=True, exist_ok=True)

    entries = sources(build, sys.argv[2:] or ("src",))
    changed = times_of_change()
    todo = [(entry, passed / fingerprint(entry, version)) for entry in entries]
    todo = [(entry, mark) for entry, mark in todo if not mark.exists()]
    # A source's own change says more than that of a header, which brings many sources at once.
    todo.sort(key=lambda work: (changed.get(pathlib.Path(work[0]["file"]), 0),
                                max(changed.get(file, 0) for file in texts_of(work[0]))), reverse=True)

    failures = left = 0
    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("JOBS", os.cpu_count() or 1))) as pool:
        results = pool.map(lambda work: (work, lint(tool, build, work[0], deadline)), todo)
        for (entry, mark), (clean, words) in results:
            if clean is None:
                left += 1
            elif clean:
                mark.touch()
            else:
                failures += 1
                print(words.strip().replace(str(ROOT) + "/", ""), flush=True)
    print(f"{len(entries)} sources: {len(entries) - len(todo)} as when they passed, {len(todo) - left} looked at, "
          f"{failures} with faults, {left} left for want of time.")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
