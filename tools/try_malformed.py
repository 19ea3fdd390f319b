"""try_malformed.py PROGRAM FOLDER: gives every file below FOLDER to the command and looks at how it takes it.

A file is rendered as a scene (small, lit from outside), used as an environment, and compared with itself as a picture; most
are refused. Each must end with status 0 or 3, within 10 s of processor time and 1 GiB of memory, and where it is refused the
message must name it.
A program built with sanitizers (preset "sanitize") is tried the same way, without the limit of memory: it needs more.
"""

import collections
import os
import pathlib
import subprocess
import sys
import tempfile

LIMIT_SECONDS = 10
LIMIT_BYTES = 1 << 30
NO_INPUT = (".md", ".tsv")


def commands(program, file, output):
    small = ["--size", "16x16", "--vpls", "100", "--quiet", "--threads", "1", "-o", f"{output}/picture.exr"]
    yield "render", [program, "render", file, "--environment", "1", *small]
    yield "environment", [program, "render", "builtin:furnace", "--environment", file, *small]
    yield "compare", [program, "compare", file, file]


def run(command, log):
    """Status, seconds of processor time (other programs do not count) and bytes of one run; its words go to `log`."""
    with open(log, "wb") as words:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=words, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def faults(file, status, seconds, size, words, sanitized):
    if status not in (0, 3):
        yield f"status {status}"
    if status == 3 and file.name not in words:
        yield "the message does not name the file"
    if "Sanitizer" in words or "runtime error:" in words:
        yield "a sanitizer's finding"
    if seconds > LIMIT_SECONDS:
        yield f"{seconds:.1f} s"
    if size > LIMIT_BYTES and not sanitized:
        yield f"{size >> 20} MiB"


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    with open(program, "rb") as binary:
        sanitized = b"__asan_init" in binary.read()
    files = sorted(file for file in folder.rglob("*") if file.is_file() and file.suffix not in NO_INPUT)
    statuses = collections.defaultdict(collections.Counter)
    slowest = largest = found = 0
    with tempfile.TemporaryDirectory() as output:
        log = pathlib.Path(output) / "words"
        for file in files:
            for use, command in commands(program, str(file), output):
                status, seconds, size = run(command, log)
                words = log.read_text(encoding="utf-8", errors="replace")
                statuses[use][status] += 1
                slowest, largest = max(slowest, seconds), max(largest, size)
                for fault in faults(file, status, seconds, size, words, sanitized):
                    found += 1
                    print(f"{use} {file}: {fault}\n{words[:2000]}", flush=True)
    for use, counts in statuses.items():
        print(f"{use}: " + ", ".join(f"{count} times status {status}" for status, count in sorted(counts.items())))
    print(f"{len(files)} files, {found} faults; the slowest took {slowest:.1f} s, the largest {largest >> 20} MiB"
          + (" (with sanitizers)" if sanitized else ""))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
