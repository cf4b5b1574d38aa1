#!/usr/bin/env python3
"""docs/examples/firmware on a Cortex-M7 in QEMU: it maps, its poses are those of this machine bit for bit (it prints a digest of
them), it keeps to its limits. The table is what docs/target.md shows.
"""
import argparse
import re
import shutil
import subprocess
import sys
from itertools import zip_longest

# bytes; about a quarter more than is needed
LIMITS = {"code and constants": 184 * 1024, "initialised data": 4 * 1024, "zeroed data": 36 * 1024, "arena": 512 * 1024,
          "stack": 26 * 1024}
SECTIONS = {".text": "code and constants", ".ARM.exidx": "code and constants", ".ARM.extab": "code and constants",
            ".data": "initialised data", ".bss": "zeroed data", ".arena": "arena"}


def sizes(size, program):
    found = dict.fromkeys(LIMITS, 0)
    for line in subprocess.run([size, "-A", program], capture_output=True, text=True, check=True).stdout.splitlines():
        fields = line.split()
        if fields and fields[0] in SECTIONS:
            found[SECTIONS[fields[0]]] += int(fields[1])
    return found


def results(text):
    return [line for line in text.splitlines() if line.startswith(("pose ", "loop ", "scan ", "digest "))]


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--firmware", required=True)
    arguments.add_argument("--host", required=True, help="the same program for this machine")
    options = arguments.parse_args()
    for tool in ("qemu-system-arm", "arm-none-eabi-size"):
        if not shutil.which(tool):
            print(f"skipped: {tool} is not installed")
            return 77

    host = subprocess.run([options.host], capture_output=True, text=True, timeout=300)
    board = subprocess.run(["qemu-system-arm", "-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "none",
                            "-semihosting-config", "enable=on,target=native", "-kernel", options.firmware],
                           capture_output=True, text=True, timeout=300)
    print(board.stdout, board.stderr, sep="")
    problems = [f"{name} ends with status {result.returncode}" for name, result in (("this machine", host), ("QEMU", board))
                if result.returncode]

    here, there = results(host.stdout), results(board.stdout)
    if not any(line.startswith("digest ") for line in here):
        problems.append("this machine prints no digest of the poses")
    for one, other in zip_longest(here, there, fillvalue="nothing"):
        if one != other:
            problems.append(f"this machine: {one}; Cortex-M7: {other}")

    used = sizes("arm-none-eabi-size", options.firmware)
    stack = re.search(r"^stack used: (\d+) bytes$", board.stdout, flags=re.M)
    used["stack"] = int(stack.group(1)) if stack else LIMITS["stack"] + 1
    print(f"\n| {'memory':20} | {'bytes':>8} | {'limit':>8} |\n|{'-' * 22}|{'-' * 9}:|{'-' * 9}:|")
    for name, limit in LIMITS.items():
        print(f"| {name:20} | {used[name]:8} | {limit:8} |")
        if used[name] > limit:
            problems.append(f"{name}: {used[name]} bytes, limit {limit}")
    for problem in problems:
        print("wrong:", problem)
    return 1 if problems else 0


sys.exit(main())
