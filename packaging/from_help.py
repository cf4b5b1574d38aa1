#!/usr/bin/env python3
"""Manual pages and the completion for bash, made from what the programs say about themselves.

from_help.py --out FOLDER --version VERSION --date YYYY-MM-DD [--emulator "qemu-... -L ..."] SECTION:PROGRAM...

Writes man/NAME.SECTION (and man/NAME-VERB.SECTION for each verb) and completions/NAME. The help texts are CLI11's: an
option that is not understood ends the program with an error, so none can be missing from a page.
"""
import argparse
import os
import re
import shlex
import subprocess
import sys

SECTIONS = ("Positionals:", "Options:", "Subcommands:")
HEADING = re.compile(r"^([A-Z][A-Za-z ]+):(?: (.*))?$")


class Help:
    """One help text, taken apart: summary, usage, entries of each section, and the paragraphs at the end."""

    def __init__(self, text, source):
        lines = text.rstrip().split("\n")
        usage = next((i for i, line in enumerate(lines) if line.startswith("Usage: ")), None)
        if usage is None:
            sys.exit(f"{source}: no line 'Usage:' in its help")
        self.summary = " ".join(line for line in lines[:usage] if line)
        self.usage = lines[usage].removeprefix("Usage: ")
        self.entries = {}  # section: [(names and type, description)]
        self.tail = []
        section = None
        for line in lines[usage + 1:]:
            if self.tail or (line and not line.startswith(" ") and line not in SECTIONS):
                self.tail.append(line)
            elif line in SECTIONS:
                section = self.entries.setdefault(line[:-1], [])
            elif not line:
                continue
            elif section is None:
                sys.exit(f"{source}: '{line}' belongs to no section")
            elif line.startswith(" " * 4):  # the description continues
                if not section:
                    sys.exit(f"{source}: '{line}' describes nothing")
                name, description = section[-1]
                section[-1] = (name, f"{description} {line.strip()}".strip())
            else:
                name, _, description = self.split(line.strip())
                section.append((name, description))
        self.options = self.entries.get("Options", [])
        for name, _ in self.options:
            if not name.startswith("-"):
                sys.exit(f"{source}: '{name}' is no option")

    @staticmethod
    def split(line):
        """CLI11 puts the description in column 30, or one blank behind what is longer than that."""
        if len(line) > 28 and line[27] == " ":
            return line[:27].rstrip(), " ", line[28:].strip()
        return line.partition("  ")

    def flags(self):
        """Every spelling of every option."""
        return [flag for name, _ in self.options for flag in name.split(" ")[0].split(",")]

    def choices(self):
        """{spellings: words to choose from}"""
        found = {}
        for name, _ in self.options:
            braces = re.search(r"\{([^}]+)\}", name)
            if braces:
                found[tuple(name.split(" ")[0].split(","))] = braces.group(1).split(",")
        return found


def roff(text):
    escaped = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line[:1] in ".'" else line for line in escaped.split("\n"))


def wrapped_type(name):
    """'--memory TEXT=64MiB' -> the flags in bold, what follows in italics."""
    flags, _, kind = name.partition(" ")
    shown = ", ".join(f"\\fB{roff(flag)}\\fR" for flag in flags.split(","))
    return f"{shown} \\fI{roff(kind)}\\fR" if kind else shown


def page(name, section, help_, version, date, see_also):
    title = name.replace(" ", "-")
    out = [f'.TH "{title.upper()}" "{section}" "{date}" "Alces {version}" "Alces"', ".SH NAME",
           f"{roff(title)} \\- {roff(help_.summary.rstrip('.'))}", ".SH SYNOPSIS", f".B {roff(help_.usage)}"]
    for heading, entries in help_.entries.items():
        out.append(f".SH {heading.upper()}")
        for entry, description in entries:
            out += [".TP", wrapped_type(entry) if heading == "Options" else f"\\fB{roff(entry)}\\fR", roff(description)]
    under = None
    for block in "\n".join(help_.tail).split("\n\n"):
        lines = block.split("\n")
        heading = HEADING.match(lines[0])
        if heading and heading.group(1) in ("Examples", "Exit status"):
            under = heading.group(1).upper()
            out.append(f".SH {under}")
            lines[0] = heading.group(2) or ""
        elif under == "DESCRIPTION":
            out.append(".PP")
        else:
            under = "DESCRIPTION"
            out.append(".SH DESCRIPTION")
        is_table = False
        for line in filter(None, lines):
            if line.startswith("  ") != is_table:
                is_table = not is_table
                out.append(".nf" if is_table else ".fi")
            out.append(roff(line))
        if is_table:
            out.append(".fi")
    if see_also:
        out += [".SH SEE ALSO", ",\n".join(f".BR {roff(other)} ({number})" for other, number in see_also)]
    return "\n".join(out) + "\n"


def completion(name, top, verbs):
    """A completion for bash that needs nothing but bash."""
    function = "_" + name.replace("-", "_")
    files = "mapfile -t COMPREPLY < <(compgen -f -- \"$word\")"
    words = "mapfile -t COMPREPLY < <(compgen -W '{}' -- \"$word\")"
    out = [f"# Completion of {name} for bash, made from its help.", f"{function}() {{",
           "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}"]
    if verbs:
        out += ["  if ((COMP_CWORD == 1)); then", "    " + words.format(" ".join([*verbs, *top.flags()])), "    return",
                "  fi", "  case ${COMP_WORDS[1]} in"]
        for verb, help_ in verbs.items():
            out.append(f"    {verb})")
            out += ["      " + line for line in completed_options(help_, words)]
            out.append("      ;;")
        out.append("  esac")
    else:
        out += ["  " + line for line in completed_options(top, words)]
    out += [f"  {files}", "}", f"complete -o filenames -F {function} {name}"]
    return "\n".join(out) + "\n"


def completed_options(help_, words):
    choices = help_.choices()
    out = []
    if choices:
        out.append("case $before in")
        out += [f"  {' | '.join(flags)}) {words.format(' '.join(options))}; return ;;" for flags, options in choices.items()]
        out.append("esac")
    out += ["if [[ $word == -* ]]; then", "  " + words.format(" ".join(help_.flags())), "  return", "fi"]
    return out


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", required=True)
    arguments.add_argument("--version", required=True)
    arguments.add_argument("--date", required=True)
    arguments.add_argument("--emulator", default="")
    arguments.add_argument("programs", nargs="+", metavar="SECTION:PROGRAM")
    options = arguments.parse_args()
    for folder in ("man", "completions"):
        os.makedirs(os.path.join(options.out, folder), exist_ok=True)

    def ask(program, *words):
        command = [*shlex.split(options.emulator), program, *words, "--help"]
        result = subprocess.run(command, capture_output=True, text=True)
        if result.returncode:
            sys.exit(f"{shlex.join(command)}: exit status {result.returncode}: {result.stderr}")
        return Help(result.stdout, shlex.join(command))

    def write(path, text):
        with open(os.path.join(options.out, path), "w", encoding="utf-8") as file:
            file.write(text)

    sections = dict(reversed(entry.split(":", 1)) for entry in options.programs)  # program: section
    for program, section in sections.items():
        name = os.path.basename(program)
        top = ask(program)
        verbs = {verb: ask(program, verb) for verb, _ in top.entries.get("Subcommands", ())}
        others = [(os.path.basename(p), s) for p, s in sections.items() if p != program]
        pages = [(f"{name}-{verb}", section) for verb in verbs]
        write(f"man/{name}.{section}", page(name, section, top, options.version, options.date, pages + others))
        for verb, help_ in verbs.items():
            write(f"man/{name}-{verb}.{section}",
                  page(f"{name} {verb}", section, help_, options.version, options.date, [(name, section)]))
        write(f"completions/{name}", completion(name, top, verbs))


main()
