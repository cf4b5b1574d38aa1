"""What the tests beside have in common: a drive is unpacked and mapped, figures are collected, printed and judged."""
import argparse
import json
import math
import subprocess
import sys
from pathlib import Path

MIB = 1 << 20


class Skipped(Exception):
    """The sentence says why."""


class Figures:
    """A table of figures with their bounds; what is out of bounds fails the test at its end."""

    def __init__(self):
        self.wrong = []

    def at_most(self, name, value, bound, unit=""):
        self._row(name, value, "<=", bound, unit, value is not None and value <= bound)

    def at_least(self, name, value, bound, unit=""):
        self._row(name, value, ">=", bound, unit, value is not None and value >= bound)

    def equal(self, name, value, bound, unit=""):
        self._row(name, value, "==", bound, unit, value == bound)

    def _row(self, name, value, relation, bound, unit, is_good):
        shown = f"{value:.4g}" if isinstance(value, float) else str(value)
        print(f"  {'' if is_good else 'WRONG '}{name}: {shown} {unit}".rstrip() + f" ({relation} {bound})")
        if not is_good:
            self.wrong.append(name)


class Pose:
    """map_from_body of a line of TUM's form: x y z qx qy qz qw."""

    def __init__(self, numbers):
        self.t, self.q = numbers[:3], numbers[3:]

    def from_other(self, other):
        """The other pose as it is seen from this one."""
        back = [-self.q[0], -self.q[1], -self.q[2], self.q[3]]
        return Pose(turned(back, [b - a for a, b in zip(self.t, other.t)]) + product(back, other.q))

    def distance_m(self, other):
        return math.dist(self.t, other.t)

    def angle_deg(self, other):
        difference = product([-self.q[0], -self.q[1], -self.q[2], self.q[3]], other.q)
        return math.degrees(2 * math.atan2(math.hypot(*difference[:3]), abs(difference[3])))


def product(a, b):
    """Of two quaternions x y z w."""
    return [a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
            a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]]


def turned(q, v):
    return product(product(q, [*v, 0]), [-q[0], -q[1], -q[2], q[3]])[:3]


def read_tum(file):
    lines = (line.split() for line in Path(file).read_text().splitlines() if line and not line.startswith("#"))
    return [Pose([float(number) for number in line[1:8]]) for line in lines]


def read_loop_edges(file):
    """(first, last) -> the pose of `last` seen from `first`, as it was matched; of a graph.g2o."""
    edges = {}
    for line in Path(file).read_text().splitlines():
        words = line.split()
        if words and words[0] == "EDGE_SE3:QUAT" and int(words[2]) - int(words[1]) != 1:
            edges[int(words[1]), int(words[2])] = Pose([float(number) for number in words[3:10]])
    return edges


class Drive:
    """A folder of scans in WORK, unpacked once, and the maps made of it."""

    def __init__(self, options, name):
        self.alces, self.data, self.work = options.alces, Path(options.data), Path(options.work).absolute()
        if not options.data or not (self.data / f"{name}.tar.xz").exists():
            raise Skipped(f"there is no {name}.tar.xz in \"{options.data}\" (ALCES_TEST_DATA)")
        unpacked = subprocess.run([self.data / "unpack", name, self.work], capture_output=True, text=True, check=True)
        self.scans = Path(unpacked.stdout.strip())

    def run(self, *arguments):
        """What alces prints; it is to end well, and to have nothing to complain of."""
        result = subprocess.run([self.alces, *map(str, arguments)], capture_output=True, text=True, timeout=280)
        if result.returncode or result.stderr:
            raise RuntimeError(f"alces {arguments[0]} ends with status {result.returncode}: {result.stderr.strip()}")
        return result.stdout

    def map(self, out, *arguments):
        """The folder OUT in WORK, and what its run.json holds."""
        out = self.work / out
        return out, json.loads(self.run("map", self.scans, "--out", out, "--json", *arguments))


def closed_loops(run):
    return [(loop["first"], loop["last"]) for loop in run["loops"] if loop["accepted"]]


def check_run(figures, run, scans, limit_mib, beside_mib=24):
    """Every scan is in the map, at a place that was matched. The memory is one block within the limit, the pool within the block,
    and the whole program has BESIDE more at most, for what it reads and writes.
    """
    print(f"mapped in {limit_mib} MiB")
    figures.equal("scans", run["scans"], scans)
    figures.equal("complete", run["complete"], True)
    figures.equal("scans left out", len(run["refused_scans"]), 0)
    for counter in ("scans_predicted", "scans_thinned", "archive_failures", "loops_not_listed", "loops_not_relaxed"):
        figures.equal(counter, run["counters"][counter], 0)
    memory = run["memory"]
    parts = sum(memory[part] for part in ("pool_bytes", "scans_bytes", "cache_bytes", "working_bytes"))
    figures.equal("parts of the block", parts, memory["block_bytes"], "bytes")
    figures.at_most("the block", memory["block_bytes"] / MIB, limit_mib, "MiB")
    figures.at_most("used of the pool", memory["pool_used_bytes"], memory["pool_bytes"], "bytes")
    figures.at_most("the whole program", memory["process_peak_bytes"] / MIB, limit_mib + beside_mib, "MiB")


def check_same_map(figures, one, other):
    """Byte for byte."""
    for name in ("trajectory.tum", "graph.g2o", "map.ply"):
        figures.equal(f"{name} is the same", (other / name).read_bytes() == (one / name).read_bytes(), True)


def main(description, test):
    arguments = argparse.ArgumentParser(description=description)
    arguments.add_argument("--alces", required=True)
    arguments.add_argument("--data", required=True, help="the folder of test data; may be empty")
    arguments.add_argument("--work", required=True)
    figures = Figures()
    try:
        test(arguments.parse_args(), figures)
    except Skipped as reason:
        print("skipped:", reason)
        sys.exit(77)
    except (RuntimeError, subprocess.SubprocessError) as error:
        figures.wrong.append(error)
    for name in figures.wrong:
        print("wrong:", name)
    sys.exit(1 if figures.wrong else 0)
