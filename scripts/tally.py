# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the tests of JUnit files (ctest's, pytest's) and prints "passed failed".

A ctest case is a cmocka program: its own lines say how many tests it ran. A skipped test counts as
failed, and so does a file that holds no test.
"""

import re
import sys
import xml.etree.ElementTree as ET


def cmocka_counts(case):
    """Passed and failed of a cmocka program, None where the case is something else."""
    text = "".join(output.text or "" for output in case.iter("system-out"))
    if "[==========]" not in text:
        return None
    counts = dict.fromkeys(("PASSED", "SKIPPED", "FAILED"), 0)
    for word, number in re.findall(r"\[ +(PASSED|SKIPPED|FAILED) +\] (\d+) test", text):
        counts[word] += int(number)
    return counts["PASSED"], counts["FAILED"] + counts["SKIPPED"]


def count(case):
    good = all(case.find(word) is None for word in ("failure", "error", "skipped"))
    good = good and case.get("status", "run") == "run"
    passed, failed = cmocka_counts(case) or (int(good), int(not good))
    if not good and not failed:  # it died outside its tests
        failed = 1
    return passed, failed


def tally(path):
    try:
        cases = [count(case) for case in ET.parse(path).iter("testcase")]
    except (OSError, ET.ParseError) as error:
        print(f"{path}: {error}", file=sys.stderr)
        return 0, 1
    if not cases:
        print(f"{path}: no test was run", file=sys.stderr)
        return 0, 1
    return sum(case[0] for case in cases), sum(case[1] for case in cases)


if __name__ == "__main__":
    totals = [tally(path) for path in sys.argv[1:]]
    print(sum(total[0] for total in totals), sum(total[1] for total in totals))
