#!/usr/bin/env python3
"""What static libraries of the core call from outside: no heap, no exceptions, no operating system.

Everything that the archives leave undefined must be on a short list (memory moves, the compiler's own arithmetic, those
functions of C's mathematics that are exact and so the same everywhere). The rest is reported with the object and the functions that refer to it.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys

ALLOWED = re.compile(
    r"mem(cpy|move|set|cmp|chr)|strlen"
    r"|(sqrt|fmod|remainder|fma|floor|ceil|round|trunc|rint|nearbyint|lround|llround|lrint|llrint|ldexp|frexp|scalbn"
    r"|copysign|fabs|fmin|fmax|modf)f?"
    r"|__aeabi_(?!unwind|atexit).*"            # ARM's run-time arithmetic
    r"|__[a-z]+[sdtx][if]([sdtx][if])?[0-9]?"  # libgcc's arithmetic, e.g. __popcountdi2
    r"|_GLOBAL_OFFSET_TABLE_|__stack_chk_fail|__stack_chk_guard|__cxa_pure_virtual|__assert_fail|__assert_func")

REASONS = [
    (r"(cbrt|hypot|sin|cos|tan|asin|acos|atan|atan2|sincos|sinh|cosh|tanh|exp|exp2|expm1|log|log2|log10|log1p|pow|erfc?)f?$",
     "other last bits with another C library or processor; see alces/portable_math.h"),
    (r"(malloc|calloc|realloc|reallocarray|free|aligned_alloc|posix_memalign|memalign|strdup)$", "heap"),
    (r"_Zn[wa]", "heap: operator new"),
    (r"_Zd[la]", "heap: operator delete (a virtual destructor makes a deleting one)"),
    (r"__cxa_(throw|rethrow|allocate_exception|begin_catch|end_catch|end_cleanup|call_unexpected|bad)", "exceptions"),
    (r"_Unwind|__gxx_personality|__aeabi_unwind", "exceptions"),
    (r"_ZSt\d+__throw_", "exceptions: a check of the standard library"),
    (r"__cxa_guard", "a static variable inside a function that needs a lock"),
    (r"__cxa_atexit|__aeabi_atexit|__dso_handle", "a static object with a destructor"),
    (r"_ZT[IV]N10__cxxabiv1", "run-time type information"),
]


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def symbols(nm, archive):
    """(defined names, {undefined name: set of objects})"""
    defined, undefined, member = set(), {}, os.path.basename(archive)
    for line in run(nm, archive).splitlines():
        if line.endswith(":"):
            member = line[:-1]
            continue
        fields = line.split()
        if len(fields) < 2:
            continue
        kind, name = fields[-2], fields[-1]
        if kind in "Uwv" and len(fields) == 2:
            undefined.setdefault(name, set()).add(member)
        else:
            defined.add(name)
    return defined, undefined


def referrers(objdump, archive, names):
    """{name: set of functions whose code refers to it}"""
    found, function = {}, "?"
    for line in run(objdump, "-dr", "--no-show-raw-insn", archive).splitlines():
        head = re.match(r"[0-9a-f]+ <(.+)>:$", line)
        if head:
            function = head.group(1)
            continue
        relocation = re.search(r"\bR_[A-Z0-9_]+\s+([^\s+-]+)", line)
        if relocation and relocation.group(1) in names:
            found.setdefault(relocation.group(1), set()).add(function)
    return found


def demangle(name):
    if not shutil.which("c++filt"):
        return name
    text = run("c++filt", name).strip()
    return text + (" [deleting destructor]" if re.search(r"D0Ev$", name) else "")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--nm", required=True)
    arguments.add_argument("--objdump", required=True)
    arguments.add_argument("archives", nargs="+")
    options = arguments.parse_args()
    for tool in (options.nm, options.objdump):
        if not shutil.which(tool):
            print(f"skipped: {tool} is not installed")
            return 77
    for archive in options.archives:
        if not os.path.exists(archive):
            print(f"skipped: {archive} has not been built")
            return 77

    defined, undefined = set(), {}
    for archive in options.archives:
        its_defined, its_undefined = symbols(options.nm, archive)
        defined |= its_defined
        for name, members in its_undefined.items():
            undefined.setdefault(name, set()).update((archive, member) for member in members)
    outside = {name for name in undefined if name not in defined}
    offenders = sorted(name for name in outside if not ALLOWED.fullmatch(name))
    print(f"{len(outside)} symbols from outside:", " ".join(sorted(outside - set(offenders))) or "none")
    if not offenders:
        return 0

    where = {}
    for archive in options.archives:
        for name, functions in referrers(options.objdump, archive, set(offenders)).items():
            where.setdefault(name, set()).update(functions)
    for name in offenders:
        reason = next((text for pattern, text in REASONS if re.match(pattern, name)),
                      "not on the list of what a part without an operating system has (see ALLOWED in symbols.py)")
        print(f"\n{demangle(name)}: {reason}")
        for archive, member in sorted(undefined[name]):
            print(f"  in {os.path.basename(archive)}({member})")
        for function in sorted(where.get(name, [])):
            print(f"  from {demangle(function)}")
    print(f"\n{len(offenders)} symbols that the core must not refer to")
    return 1


sys.exit(main())
