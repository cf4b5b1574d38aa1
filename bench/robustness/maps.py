"""Maps of variants, made by the program under test, and what it wrote of them. A map that was made by the same program from the same
variant with the same options is not made again.
"""
import csv
import hashlib
import json
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np

import factors as f
import poses as p

TIME_LIMIT_S = 1800
STOPPED = (130, 143, -signal.SIGINT, -signal.SIGTERM)  # by whoever runs this: no result
SCRATCH = "scans.archive"
NOT_KEPT = ("map.ply", "frames")  # large, and not judged


class Map:
    """What a run left behind."""

    def __init__(self, folder, variant, place, pairs, is_replay):
        self._folder, self._variant, self._place, self._pairs, self._is_replay = folder, variant, place, pairs, is_replay
        self.facts = json.loads((folder / "robustness.json").read_text())
        self.exit_status, self.problem = self.facts["exit_status"], self.facts["problem"]
        self.run = self.poses = self.poses_without_loops = None
        self.rows, self.loops, self.scan_ms = np.array([], int), [], []
        if (folder / "run.json").exists():
            self.run = json.loads((folder / "run.json").read_text())
            self._read()

    @property
    def verdict(self):
        return (self.run or {}).get("verdict", "-")

    def _read(self):
        self.poses = p.read_tum(self._folder / "trajectory.tum")[1]
        without = self._folder / "trajectory_without_loops.tum"
        if without.exists():
            self.poses_without_loops = p.read_tum(without)[1]
        with open(self._folder / "scans.csv", newline="") as table:
            scans = list(csv.DictReader(table))
        self.scan_ms = [sum(float(value) for name, value in scan.items() if name.endswith("_ms")) for scan in scans]
        numbers = np.array([int(scan["scan"]) for scan in scans])
        self.rows = np.arange(len(numbers)) if self._is_replay else numbers
        edges = _edges(self._folder / "graph.g2o")
        for loop in self.run["loops"]:
            if loop["accepted"]:
                first, last = loop["first"], loop["last"]
                matched = edges.get((first, last))
                self.loops.append((first, last, matched if matched is not None else p.between(self.poses[first], self.poses[last])))

    def consistency(self):
        return consistency(self._folder, self.rows, self._folder, self._variant, self._place, self._pairs)


def consistency(trajectory, rows, folder, variant, place, all_pairs):
    """`alces evaluate --consistency` with all points of the scans (`rows` of the variant), for the pairs of revisits that are among them;
    kept in the folder.
    """
    file = folder / "consistency.json"
    if not file.exists():
        place_of = {int(row): number for number, row in enumerate(variant.rows[rows])}
        pairs = [[place_of[a], place_of[b]] for a, b in json.loads(all_pairs.read_text()) if a in place_of and b in place_of]
        chosen = folder / "pairs.json"
        chosen.write_text(json.dumps(pairs))
        scans = variant.full_scans
        if len(rows) < len(variant.rows):  # as many scans as poses
            scans = folder / "scans"
            scans.mkdir(exist_ok=True)
            for row in rows:
                link = next(variant.full_scans.glob(f"scan{row:04}.*"))
                (scans / link.name).symlink_to(link)
        ended = subprocess.run([place.alces, "evaluate", trajectory, "--consistency", scans, "--pairs", chosen, "--json"],
                               capture_output=True, text=True, check=True)
        file.write_text(ended.stdout)
    return json.loads(file.read_text())


def _edges(file):
    """(first, last) -> the pose of `last` seen from `first`; of a graph.g2o, where the last one given counts."""
    edges = {}
    for line in file.read_text().splitlines():
        words = line.split()
        if words and words[0] == "EDGE_SE3:QUAT":
            edges[int(words[1]), int(words[2])] = p.matrices([[float(word) for word in words[3:10]]])[0]
    return edges


def key(program, options):
    """Of the program, what it is told, and the files that it is told to read."""
    digest = hashlib.sha256(program.read_bytes())
    for option in options:
        digest.update(option.encode() + b"\0")
        if Path(option).is_file():
            digest.update(Path(option).read_bytes())
    return digest.hexdigest()[:16]


def make(drive, factor, variant, place, options, keeps_in=None):
    """`keeps_in`: a folder that whole maps stay in."""
    map_key = f"{key(place.alces, options)} v{f.VERSION}"
    base = keeps_in if keeps_in is not None else place.work / "maps" / map_key.split()[0]
    folder = base / drive.name / factor.name
    facts = folder / "robustness.json"
    is_replay = variant.recording is not None and not options  # options are those of `alces map`; a replay has others
    if not facts.exists() or json.loads(facts.read_text())["key"] != map_key:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        # What the default memory does not hold goes to the disk, as a replay does: poses do not depend on it.
        what = ["replay", variant.recording] if is_replay else ["map", variant.folder, "--archive", folder / SCRATCH]
        exit_status, problem = _run([place.alces, *map(str, what), "--out", folder, *options])
        if exit_status in STOPPED:
            raise KeyboardInterrupt
        for name in [SCRATCH] if keeps_in is not None else [SCRATCH, *NOT_KEPT]:
            target = folder / name
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
        facts.write_text(json.dumps({"key": map_key, "exit_status": exit_status, "problem": problem}))
    return Map(folder, variant, place, drive.pairs, is_replay)


def _run(command):
    try:
        ended = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        return -1, f"does not end within {TIME_LIMIT_S} s"
    said = ended.stderr.strip().splitlines()
    return ended.returncode, f"exit status {ended.returncode}: {said[-1] if said else ''}" if ended.returncode else ""
