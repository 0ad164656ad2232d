#!/usr/bin/env python3
"""Names the functions of include/ and src/ that are longer than 80 lines. Exit status 1 if there are any.

A function begins at a brace alone on a line with at most two spaces before it, as .clang-format lays it out, and ends
at the next brace in the same column.
"""
import pathlib
import re
import sys

MOST = 80

# Inner loops, and the loop of Newton's method, whose parts share most of their variables.
KERNELS = {
    "include/slender_sim/dynamics/newton.h": "minimize",
    "include/slender_sim/energy/joint_stencil.h": "jointDerivatives",
}
# This file, and the studies (src/study/), still have functions that are too long.
LEFT = {"src/cloth/cloth_newton.cpp"}


def long_functions(path):
    lines = path.read_text().split("\n")
    for start, line in enumerate(lines):
        brace = re.match(r"^( {0,2})\{$", line)
        if not brace:
            continue
        head, at = "", start - 1
        while at >= 0 and lines[at] and not lines[at].lstrip().startswith(("//", "}", "{", "public:", "private:")):
            head, at = lines[at] + head, at - 1
        if not head or re.search(r"\b(namespace|struct|class|enum|union)\b", head.split("(")[0]):
            continue
        end = next(i for i in range(start + 1, len(lines)) if lines[i].startswith(brace[1] + "}"))
        if end - start - 1 > MOST:
            yield at + 2, end - start - 1, head.strip()


def main():
    root = pathlib.Path(__file__).resolve().parent.parent
    found = 0
    for folder in ("include", "src"):
        for path in sorted((root / folder).rglob("*")):
            name = str(path.relative_to(root))
            if path.suffix not in (".h", ".cpp") or name in LEFT or name.startswith("src/study/"):
                continue
            for line, length, head in long_functions(path):
                if name in KERNELS and KERNELS[name] + "(" in head:
                    continue
                found += 1
                print(f"{name}:{line}: {length} lines, allowed are {MOST}: {head[:80]}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
