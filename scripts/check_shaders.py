#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles every shader entry point with glslangValidator, as OpenGL GLSL.

Includes are resolved as csrc/gl/program.c does: `#include "x"` names a file below shaders/, read
once, and #line carries the file's number, which is turned back into its name in the messages.

Where a line "// variants: NAME ..." tells so, also with each of these names defined.

    check_shaders.py [shaders/ [report.xml]]     report: JUnit, one case a shader
"""

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

STAGES = ("comp", "vert", "frag", "geom")
VARIANTS = re.compile(r"^// variants: (.*)$", re.M)
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"')


def flatten(path, root, files, variant=None):
    """The text of a shader with its includes in place; files collects what #line numbers."""
    files.append(path)
    number = len(files) - 1
    out = []
    for index, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        include = INCLUDE.match(line)
        if include is None:
            out.append(line)
            if line.startswith("#version"):
                out += [f"#define {variant}"] if variant else []
                out.append(f"#line {index + 1} {number}")
            continue
        included = root / include[1]
        if included not in files:
            out += ["#line 1 " + str(len(files)), *flatten(included, root, files)]
        out.append(f"#line {index + 1} {number}")
    return out


def variants(path):
    """The names that the shader is compiled with, one at a time; None: without any."""
    found = VARIANTS.search(path.read_text(encoding="utf-8"))
    return [None, *(found[1].split() if found else [])]


def check(path, root, variant):
    """The compiler's complaint, empty where the shader is fine."""
    files = []
    try:
        source = "\n".join(flatten(path, root, files, variant)) + "\n"
    except OSError as error:
        return str(error)
    stage = path.name.split(".")[-2]
    run = subprocess.run(["glslangValidator", "--stdin", "-S", stage], input=source, text=True,
                         capture_output=True, check=False)
    if run.returncode == 0:
        return ""
    names = dict(enumerate(map(str, files)))
    return re.sub(r"^((?:ERROR|WARNING): )(\d+):",
                  lambda match: f"{match[1]}{names.get(int(match[2]), match[2])}:",
                  run.stdout + run.stderr, flags=re.M)


def main():
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent / "shaders")
    suite = ET.Element("testsuite", name="shaders")
    failed = 0
    shaders = [(path, variant)
               for path in sorted(root.rglob("*.glsl")) if path.name.split(".")[-2] in STAGES
               for variant in variants(path)]
    for path, variant in shaders:
        name = str(path.relative_to(root)) + (f" with {variant}" if variant else "")
        case = ET.SubElement(suite, "testcase", classname="shaders", name=name)
        complaint = check(path, root, variant)
        if complaint:
            failed += 1
            ET.SubElement(case, "failure", message="does not compile").text = complaint
            print(f"{name}:\n{complaint}", file=sys.stderr)
    print(f"{len(shaders) - failed} shaders compile, {failed} do not")
    if len(sys.argv) > 2:
        ET.ElementTree(suite).write(sys.argv[2], encoding="unicode")
    return 1 if failed or not shaders else 0


if __name__ == "__main__":
    sys.exit(main())
