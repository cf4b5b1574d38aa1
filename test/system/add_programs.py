#!/usr/bin/env python3
"""Copies programs for a guest, stripped, and the shared libraries that they need.

add_programs.py ROOT STRIP LIBRARIES... -- PROGRAM...

LIBRARIES are folders, searched in their order. Programs go to ROOT/usr/bin, libraries to ROOT/lib. What a program
needs is read from it (readelf), so it may be for another processor.
"""
import pathlib
import re
import shutil
import subprocess
import sys


def readelf(option, file):
    return subprocess.run(['readelf', '-W', option, file], capture_output=True, text=True, check=True).stdout


def main():
    root, strip = pathlib.Path(sys.argv[1]), sys.argv[2]
    split = sys.argv.index('--')
    folders = [pathlib.Path(folder) for folder in sys.argv[3:split]]
    programs = sys.argv[split + 1:]
    (root / 'usr/bin').mkdir(parents=True, exist_ok=True)
    (root / 'lib').mkdir(parents=True, exist_ok=True)
    done = set()

    def add_needed(file):
        for name in re.findall(r'\(NEEDED\).*\[(.*)\]', readelf('-d', file)):
            if name in done:
                continue
            done.add(name)
            found = next((folder / name for folder in folders if (folder / name).exists()), None)
            if found is None:
                sys.exit(f'{file} needs {name}, which is not in {", ".join(map(str, folders))}')
            shutil.copy(found, root / 'lib' / name)
            add_needed(found)

    for program in programs:
        file = pathlib.Path(program)
        subprocess.run([strip, '-o', root / 'usr/bin' / file.name, file], check=True)
        add_needed(file)
        interpreter = re.search(r'Requesting program interpreter: (.*)\]', readelf('-l', file))
        if interpreter:  # /lib64/ld-linux-x86-64.so.2, /lib/ld-linux-aarch64.so.1
            place = root / interpreter[1].lstrip('/')
            place.parent.mkdir(parents=True, exist_ok=True)
            source = next(folder / place.name for folder in folders if (folder / place.name).exists())
            if not place.exists():
                shutil.copy(source, place)


main()
