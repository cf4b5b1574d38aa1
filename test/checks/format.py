#!/usr/bin/env python3
"""clang-format agrees with every C and C++ source of the tree. `scripts/format` puts it right."""
import os
import shutil
import subprocess
import sys


def main():
    root = sys.argv[1]
    tool = shutil.which("clang-format-14") or shutil.which("clang-format")
    if not tool:
        print("skipped: clang-format is not installed")
        return 77
    files = []
    for part in ("lib", "drivers", "platform", "onboard", "client", "offline", "experiments", "test", "bench", "docs"):
        for folder, _, names in os.walk(os.path.join(root, part)):
            files += [os.path.join(folder, n) for n in sorted(names) if n.endswith((".h", ".hpp", ".cpp", ".c"))]
    tracked = subprocess.run(["git", "-C", root, "ls-files", "-z"], capture_output=True, text=True)
    if tracked.returncode == 0:  # in a clone: what is not committed yet is nobody's fault
        known = set(tracked.stdout.split("\0"))
        files = [f for f in files if os.path.relpath(f, root) in known]
    result = subprocess.run([tool, "--dry-run", "-Werror", *files], cwd=root, capture_output=True, text=True)
    wrong = sorted({os.path.relpath(line.split(":")[0], root) for line in result.stderr.splitlines()
                    if "-Wclang-format-violations" in line})
    for path in wrong:
        print(f"{path}: clang-format would change it")
    if result.returncode and not wrong:
        print(result.stderr)
    print(f"{len(files)} files, {len(wrong)} to format (scripts/format does it)")
    return 1 if result.returncode else 0


sys.exit(main())
