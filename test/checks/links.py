#!/usr/bin/env python3
"""Every link and picture in the documents leads to a file of this tree, and every #anchor to a heading."""
import os
import re
import sys
import urllib.parse

LINK = re.compile(r'\]\(\s*<?([^)\s>]+)>?[^)]*\)|(?:src|href)="([^"]+)"')


def documents(root):
    for folder, folders, names in os.walk(root):
        folders[:] = [f for f in folders if f not in ("build", "third_party") and not f.startswith(".")]
        for name in sorted(names):
            if name.endswith(".md"):
                yield os.path.join(folder, name)


def text_of(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    return re.sub(r"^```.*?^```", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.S | re.M)


def anchors(path):
    headings = re.findall(r"^#+\s+(.*?)\s*$", text_of(path), flags=re.M)
    return {re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", h.lower())) for h in headings}


def main():
    root = sys.argv[1]
    count = wrong = 0
    for path in documents(root):
        for number, line in enumerate(text_of(path).splitlines(), 1):
            for match in LINK.finditer(re.sub(r"`[^`]*`", "", line)):
                link = match.group(1) or match.group(2)
                if re.match(r"[a-z][a-z0-9+.-]*:", link):
                    continue
                count += 1
                name, _, anchor = link.partition("#")
                target = os.path.join(os.path.dirname(path), urllib.parse.unquote(name)) if name else path
                problem = None
                if not os.path.exists(target):
                    problem = "there is no such file"
                elif anchor and target.endswith(".md") and anchor not in anchors(target):
                    problem = "there is no such heading"
                if problem:
                    wrong += 1
                    print(f"{os.path.relpath(path, root)}:{number}: {link}: {problem}")
    print(f"{count} links, {wrong} broken")
    return 1 if wrong else 0


sys.exit(main())
