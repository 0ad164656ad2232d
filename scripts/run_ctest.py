#!/usr/bin/python3
"""Runs the tests that CTest knows in a build directory and counts them. Each case of Google Test, each study and each case
of a rostest is one test, and a rostest that fails counts as one more failed test. The last line is "N passed, N failed";
the exit status is 0 only if nothing failed and something passed.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree


def cases(path):
    """Yields (name, passed) for the cases of a JUnit file that were run."""
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        failed = case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail"
        if failed or (case.find("skipped") is None and case.get("status", "run") == "run"):
            yield case.get("name"), not failed


def rostest_cases(build):
    """Yields (name, passed) for the cases of all rostests, from the files that their test nodes wrote."""
    for path in sorted((build / "test_results").rglob("rosunit-*.xml")):
        try:
            for name, passed in cases(path):
                yield "{}: {}".format(path.stem, name), passed
        except ElementTree.ParseError:
            yield "{}: the result file cannot be read".format(path.name), False


def run(build, arguments, junit):
    """Runs CTest; returns (number of passed tests, names of failed ones)."""
    command = ["ctest", "--test-dir", str(build), "-j", str(arguments.jobs), "--output-on-failure", "--timeout",
               str(arguments.timeout), "--output-junit", str(junit.resolve()), "--no-tests=error"]
    if not arguments.all:
        command += ["-LE", "slow"]
    junit.unlink(missing_ok=True)
    status = subprocess.run(command).returncode
    if not junit.exists():
        return 0, ["ctest ended with status {} and wrote no results".format(status)]
    rostests = list(rostest_cases(build))
    passed = sum(good for _, good in rostests)
    failed = [name for name, good in rostests if not good]
    for name, good in cases(junit):
        if "_rostest_" in name and good:
            continue   # its cases are counted; a node may have died where all cases passed
        passed += good
        failed += [] if good else [name]
    if status != 0 and not failed:
        failed.append("ctest ended with status {}".format(status))
    return passed, failed


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--all", action="store_true", help="slow tests as well")
    parser.add_argument("--jobs", type=int, default=int(os.environ.get("JOBS", "2")))
    parser.add_argument("--timeout", type=int, default=1500, help="seconds for each test")
    parser.add_argument("--passed", action="append", default=[], help="counts a check done elsewhere")
    parser.add_argument("--failed", action="append", default=[])
    arguments = parser.parse_args()

    shutil.rmtree(arguments.build / "test_results", ignore_errors=True)
    passed, failed = run(arguments.build, arguments, arguments.build / "ctest.xml")
    passed += len(arguments.passed)
    failed += arguments.failed
    for line in failed:
        print("FAILED {}".format(line))
    print("{} passed, {} failed".format(passed, len(failed)), flush=True)
    return 1 if failed or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
