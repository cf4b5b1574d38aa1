#!/usr/bin/env python3
"""The stack that the library needs: the largest frames, and the deepest path through its call graph.

Reads what GCC leaves beside the objects with -fstack-usage and -fcallgraph-info=su. Functions of the C library
and calls through a pointer (an archive, say) are not seen and come on top; a recursive function is named, because
its depth is not in the call graph.
"""
import argparse
import glob
import os
import re
import sys

NODE = re.compile(r'node: { title: "([^"]+)" label: "((?:[^"\\]|\\.)*)"')
EDGE = re.compile(r'edge: { sourcename: "([^"]+)" targetname: "([^"]+)"')
BYTES = re.compile(r"(\d+) bytes \(([a-z,]+)\)")


def read(folders):
    frames, calls, labels, dynamic = {}, {}, {}, set()
    files = [path for folder in folders for path in glob.glob(os.path.join(folder, "**", "*.ci"), recursive=True)]
    for path in files:
        with open(path, encoding="utf-8") as text:
            for line in text:
                node = NODE.match(line)
                if node:
                    title, label = node.groups()
                    size = BYTES.search(label)
                    if size:
                        frames[title] = max(frames.get(title, 0), int(size.group(1)))
                        labels[title] = label.split("\\n")[0]
                        if size.group(2) == "dynamic":
                            dynamic.add(title)
                edge = EDGE.match(line)
                if edge:
                    calls.setdefault(edge.group(1), set()).add(edge.group(2))
    return files, frames, calls, labels, dynamic


def deepest(frames, calls):
    """{function: (bytes, next function)} and the functions that call themselves, directly or not."""
    depth, recursive, active = {}, set(), []

    def visit(function):
        if function in depth:
            return depth[function][0]
        if function in active:
            recursive.update(active[active.index(function):])
            return 0
        active.append(function)
        best, follow = 0, None
        for callee in sorted(calls.get(function, ())):
            if callee in frames or callee in calls:
                below = visit(callee)
                if below > best:
                    best, follow = below, callee
        active.pop()
        depth[function] = (frames.get(function, 0) + best, follow)
        return depth[function][0]

    for function in sorted(frames):
        visit(function)
    return depth, recursive


def short(label):
    return label if len(label) <= 110 else label[:107] + "..."


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--limit-frame", type=int, required=True)
    arguments.add_argument("--limit-path", type=int, required=True)
    arguments.add_argument("folders", nargs="+")
    options = arguments.parse_args()
    sys.setrecursionlimit(100000)

    files, frames, calls, labels, dynamic = read(options.folders)
    if not files:
        print(f"skipped: no call graph in {' '.join(options.folders)} (built by GCC?)")
        return 77
    depth, recursive = deepest(frames, calls)

    print("largest frames, bytes")
    for function in sorted(frames, key=lambda f: (-frames[f], f))[:10]:
        print(f"{frames[function]:8}  {short(labels[function])}")
    top = max(frames, key=lambda f: (depth[f][0], f))
    print(f"deepest path, {depth[top][0]} bytes")
    function = top
    while function:
        print(f"{frames.get(function, 0):8}  {short(labels.get(function, function))}")
        function = depth[function][1]
    for function in sorted(recursive):
        print(f"recursive, counted once: {short(labels.get(function, function))}")
    through_pointers = sorted(f for f in frames if "__indirect_call" in calls.get(f, ()))
    for function in through_pointers:
        print(f"calls through a pointer: {short(labels[function])}")

    problems = [f"{frames[f]} bytes in one frame (limit {options.limit_frame}): {labels[f]}"
                for f in sorted(frames) if frames[f] > options.limit_frame]
    problems += [f"a frame whose size depends on data: {labels[f]}" for f in sorted(dynamic)]
    if depth[top][0] > options.limit_path:
        problems.append(f"{depth[top][0]} bytes on the deepest path (limit {options.limit_path})")
    for problem in problems:
        print("too much:", problem)
    return 1 if problems else 0


sys.exit(main())
