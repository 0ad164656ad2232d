#!/usr/bin/python3
"""Runs the tests that CTest knows in a build directory and counts single test cases.

Google Test and rostest write result files in JUnit's XML; the cases in them are counted. A test program that fails without
saying which case (a crash, a timeout, no result file) counts as one failed case, so that nothing fails silently. Exit status 0
only if nothing failed and something passed.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree


def results_in(folder):
    return set(folder.rglob("*.xml")) if folder.is_dir() else set()


def count(path):
    """(passed, names of failed cases) in one result file, or None when it cannot be read."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError):
        return None
    passed, failed = 0, []
    for case in root.iter("testcase"):
        name = "{}.{}".format(case.get("classname", ""), case.get("name", ""))
        if case.find("failure") is not None or case.find("error") is not None:
            failed.append(name)
        elif case.find("skipped") is None and case.get("status") != "notrun":
            passed += 1
    return passed, failed


def run(build, name, timeout):
    """Runs one test; returns (passed, names of failed cases)."""
    gtest_folder = build / "test_results" / "gtest"
    gtest_folder.mkdir(parents=True, exist_ok=True)
    before = results_in(build / "test_results")
    environment = dict(os.environ, GTEST_OUTPUT="xml:{}/{}.xml".format(gtest_folder.resolve(), name.replace("/", "_")))
    command = ["ctest", "--test-dir", str(build), "-R", "^{}$".format(name), "--output-on-failure", "--timeout", str(timeout)]
    print("== {}".format(name), flush=True)
    good = subprocess.run(command, env=environment).returncode == 0
    files = sorted(results_in(build / "test_results") - before)
    # rostest writes a summary (rostest-*.xml) beside the results of each test node (rosunit-*.xml): the single cases are in the
    # latter; the former tells of nodes that died.
    detailed = [path for path in files if path.name.startswith("rosunit-")]
    summaries = [path for path in files if path.name.startswith("rostest-")] if detailed else []
    passed, failed = 0, []
    for path in files:
        counted = count(path)
        if counted is None:
            failed.append("{}: result file {} cannot be read".format(name, path.name))
        elif path in summaries:
            if not any((count(other) or (0, ["?"]))[1] for other in detailed):
                failed += ["{}: {}".format(name, case) for case in counted[1]]
        else:
            passed += counted[0]
            failed += ["{}: {}".format(name, case) for case in counted[1]]
    if not good and not failed:
        failed.append("{}: the program failed without naming a case (crash, timeout, or not built)".format(name))
    if good and not files:
        passed += 1   # a plain program whose exit status is all it says
    return passed, failed


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--timeout", type=int, default=1500, help="seconds for each test program")
    parser.add_argument("--passed", action="append", default=[], help="counts a check done elsewhere")
    parser.add_argument("--failed", action="append", default=[])
    arguments = parser.parse_args()

    shutil.rmtree(arguments.build / "test_results", ignore_errors=True)
    listing = subprocess.run(["ctest", "--test-dir", str(arguments.build), "--show-only=json-v1"], stdout=subprocess.PIPE, check=True)
    names = [test["name"] for test in json.loads(listing.stdout)["tests"]]
    passed, failed = len(arguments.passed), list(arguments.failed)
    for name in names:
        more_passed, more_failed = run(arguments.build, name, arguments.timeout)
        passed += more_passed
        failed += more_failed
    if not names:
        failed.append("CTest knows no tests in {}".format(arguments.build))
    for line in failed:
        print("FAILED {}".format(line))
    print("{} passed, {} failed".format(passed, len(failed)), flush=True)
    return 1 if failed or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
