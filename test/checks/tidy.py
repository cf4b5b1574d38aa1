#!/usr/bin/env python3
"""clang-tidy over the sources of lib (and drivers), with the compile commands of this build."""
import concurrent.futures
import glob
import json
import os
import shutil
import subprocess
import sys


def main():
    root, build = sys.argv[1:3]
    tool = shutil.which("clang-tidy-14") or shutil.which("clang-tidy")
    if not tool:
        print("skipped: clang-tidy is not installed")
        return 77
    files = sorted(glob.glob(f"{root}/lib/src/**/*.cpp", recursive=True) +
                   glob.glob(f"{root}/drivers/src/**/*.cpp", recursive=True))

    # clang knows all of GCC's options but this one.
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as text:
        commands = json.load(text)
    for entry in commands:
        entry["command"] = entry["command"].replace("-fcallgraph-info=su", "")
    filtered = os.path.join(build, "test", "checks", "tidy")
    os.makedirs(filtered, exist_ok=True)
    with open(os.path.join(filtered, "compile_commands.json"), "w", encoding="utf-8") as text:
        json.dump(commands, text)

    def check(path):
        return subprocess.run([tool, "-p", filtered, "--quiet", path], capture_output=True, text=True)

    wrong = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for path, result in zip(files, pool.map(check, files)):
            if result.returncode or "warning:" in result.stdout:
                wrong += 1
                print(result.stdout)
                if not result.stdout.strip():
                    print(os.path.relpath(path, root), result.stderr)
    print(f"{len(files)} files, {wrong} with findings")
    return 1 if wrong else 0


sys.exit(main())
