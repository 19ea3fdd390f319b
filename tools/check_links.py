"""Finds links in the documents that point to files which do not exist."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LINK = re.compile(r"\]\(([^)\s#]*)(#[^)\s]*)?\)|<img[^>]*\ssrc=\"([^\"]+)\"")


def documents():
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT, check=True, capture_output=True, text=True)
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).exists()]


def broken_links(document):
    in_code = False
    for number, line in enumerate(document.read_text(encoding="utf-8").splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
        if in_code:
            continue
        for match in LINK.finditer(re.sub(r"`[^`]*`", "", line)):
            target = match[1] or match[3]
            if not target or ":" in target:
                continue
            if not (document.parent / target).exists():
                yield f"{document.relative_to(ROOT)}:{number}: there is no {target}"


def main():
    faults = [fault for document in documents() for fault in broken_links(document)]
    print("\n".join(faults) if faults else f"{len(documents())} documents, no broken link.")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
