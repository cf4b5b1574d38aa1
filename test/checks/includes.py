#!/usr/bin/env python3
"""Includes run one way: experiments -> offline -> platform; onboard -> platform -> drivers -> lib. lib and drivers use few
outside headers; client stands alone, and its layout is onboard's to write."""
import os
import re
import sys

# part: parts it may include from (itself is understood)
MAY_INCLUDE = {
    "lib": set(),
    "drivers": {"lib"},
    "platform": {"drivers", "lib"},
    "client": set(),
    "onboard": {"platform", "drivers", "lib", "client"},
    "offline": {"platform", "drivers", "lib"},
    "experiments": {"offline", "platform", "drivers", "lib"},
}
# What drivers know of lib: poses, points, and how a block of memory is handed out.
DRIVERS_KNOW = {"lib/include/alces/pose.h", "lib/include/alces/point.h", "lib/include/alces/arena.h",
                "lib/include/alces/portable_math.h"}
# Standard headers that need no heap, no exceptions and no operating system where we use them.
STANDARD = {
    "algorithm", "array", "bit", "cmath", "compare", "concepts", "cstddef", "cstdint", "cstdlib", "cstring",
    "initializer_list", "iterator", "limits", "memory", "new", "numbers", "numeric", "optional", "ratio", "span",
    "string_view", "tuple", "type_traits", "utility", "variant",
    "emmintrin.h", "immintrin.h", "arm_neon.h",  # vector instructions, where the compiler says that they are there
}
EIGEN = {"Eigen/Core", "Eigen/Geometry", "Eigen/Cholesky", "Eigen/Eigenvalues", "Eigen/LU", "Eigen/QR", "Eigen/SVD",
         "Eigen/Dense"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def sources(root, part):
    for folder, _, names in os.walk(os.path.join(root, part)):
        for name in sorted(names):
            if name.endswith((".h", ".hpp", ".cpp", ".c")):
                yield os.path.relpath(os.path.join(folder, name), root)


def resolve(name, including, files):
    """The file of this tree that an include means, or None."""
    beside = os.path.normpath(os.path.join(os.path.dirname(including), name))
    if beside in files:
        return beside
    own = including.split("/")[0]
    for part in [own] + [p for p in MAY_INCLUDE if p != own]:
        for base in (f"{part}/include/", f"{part}/src/", f"{part}/", ""):
            if base + name in files:
                return base + name
    return None


def main():
    root = sys.argv[1]
    files = {path for part in MAY_INCLUDE for path in sources(root, part)}
    wrong = 0
    for path in sorted(files):
        part = path.split("/")[0]
        with open(os.path.join(root, path), encoding="utf-8") as text:
            for number, line in enumerate(text, 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                name = match.group(2)
                target = resolve(name, path, files)
                if target:
                    other = target.split("/")[0]
                    if other == part:
                        continue
                    if other not in MAY_INCLUDE[part]:
                        problem = f"{part} may not include from {other}"
                    elif part == "drivers" and target not in DRIVERS_KNOW:
                        problem = "drivers know lib's pose.h, point.h, arena.h and portable_math.h only"
                    else:
                        continue
                elif part == "lib" and name not in STANDARD | EIGEN:
                    problem = "lib uses Eigen and the short list of standard headers in includes.py"
                elif part == "drivers" and name not in STANDARD | EIGEN:
                    problem = "drivers use Eigen and the short list of standard headers in includes.py"
                else:
                    continue
                wrong += 1
                print(f"{path}:{number}: {name}: {problem}")
    print(f"{len(files)} files, {wrong} wrong includes")
    return 1 if wrong else 0


sys.exit(main())
