"""The drives of the table: where they come from, their truth, and who judges their maps."""
import contextlib
import fcntl
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable

import numpy as np

import beams
import clouds
import factors as f
import judges
import poses as p

REFERENCE = Path(__file__).parent / "reference"


class Missing(Exception):
    """The drive's data or a program is not there; the sentence says which."""


@dataclass
class Place:
    """Where things are."""
    data: Path
    work: Path
    alces: Path
    town: Path
    drive_scans: Path

    def unpacked(self, name):
        """The folder of a set of the test data: lies open beside, or is unpacked into WORK once."""
        if (self.data / name).is_dir():
            return self.data / name
        packed, folder = self.data / f"{name}.tar.xz", self.work / "data" / name
        if folder.is_dir():
            return folder
        if not packed.exists():
            raise Missing(f"there is no {name} in {self.data}")
        with whole_folder(folder) as unfinished:
            subprocess.run(["tar", "-xJf", packed, "-C", unfinished], check=True)
            inner = list(unfinished.iterdir())  # as a rule one folder
            if len(inner) == 1 and inner[0].is_dir():
                for entry in inner[0].iterdir():
                    entry.rename(unfinished / entry.name)
                inner[0].rmdir()
        return folder

    @contextlib.contextmanager
    def alone(self):
        """Nobody else makes data and variants in WORK meanwhile."""
        self.work.mkdir(parents=True, exist_ok=True)
        with open(self.work / "lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def run(self, program, *arguments):
        if not program.exists():
            raise Missing(f"{program} is not built")
        subprocess.run([program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


class whole_folder:
    """A folder that is there only when all of it is."""

    def __init__(self, folder):
        self.folder, self.unfinished = folder, folder.with_name(folder.name + ".unfinished")

    def __enter__(self):
        shutil.rmtree(self.unfinished, ignore_errors=True)
        self.unfinished.mkdir(parents=True)
        return self.unfinished

    def __exit__(self, kind, *_):
        if kind is None:
            shutil.rmtree(self.folder, ignore_errors=True)
            self.unfinished.rename(self.folder)


@dataclass
class Recorded:
    """A drive as it was recorded."""
    scans: list               # files
    odometry: np.ndarray | None = None
    truth: np.ndarray | None = None
    stamps: np.ndarray | None = None  # seconds; None: the rows
    recording: Path | None = None     # replayed where nothing is changed


@dataclass
class Drive:
    name: str
    title: str
    find: Callable
    find_beams: Callable
    judge: Callable = judges.with_truth
    reach_m: float | None = 5.0  # how near two visits of a place are; None: no place is driven again
    gap_m: float = 40.0          # of way between them
    factors: list = field(default_factory=lambda: f.ALL)
    quick: list = field(default_factory=list)  # factors of the quick table
    family: str = ""             # drives of one place or one maker, which are left out together; else its name
    pairs: Path | None = None    # of revisits, for consistency
    holds: bool = False           # its map has to be right as it is
    noise_of_truth: bool = False  # noise is added to the truth: there is no odometry
    # vlp16_street's facts, as scans in order
    revisit: tuple = ()
    revisit_reach: int = 0
    straight: tuple = ()
    recorded: Recorded | None = None

    def __post_init__(self):
        self.family = self.family or self.name

    @property
    def truth(self):
        return self.recorded.truth

    def prepare(self, place):
        if self.recorded is None:
            self.recorded = self.find(place)
            if self.name == "hannover1":
                self.pairs = place.data / "hannover1_revisits.json"
        return self.recorded


def _numbered(folder, ending):
    return sorted(folder.glob(f"*{ending}"), key=lambda file: (len(file.name), file.name))


def _converted(place, source, name):
    """Poses in whatever form the data has them, by `alces convert`."""
    file = place.work / "data" / f"{name}.tum"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_name(f"unfinished.{file.name}")
        place.run(place.alces, "convert", source, unfinished)
        unfinished.rename(file)
    return p.read_tum(file)[1]


def _hannover1(place):
    folder = place.unpacked("hannover1")
    if not (place.data / "hannover1_revisits.json").exists():
        raise Missing(f"there is no hannover1_revisits.json in {place.data}")
    return Recorded(_numbered(folder, ".3d"), _converted(place, folder, "hannover1"), p.read_tum(REFERENCE / "hannover1.tum")[1])


def _hilti_balm(place):
    folder = place.unpacked("hilti_balm")
    estimates = _converted(place, folder / "alidarPose.csv", "hilti_balm")
    return Recorded(_numbered(folder, ".pcd"), estimates, estimates)


def _vlp16_street(place):
    folder = place.unpacked("vlp16_street")
    return Recorded(_numbered(folder / "scans", ".pcd"), p.read_tum(folder / "odometry.tum")[1],
                    p.read_tum(REFERENCE / "vlp16_street.tum")[1])


def _kitti_raw(place):
    return Recorded(_numbered(place.unpacked("kitti_raw"), ".pcd"), None, p.read_tum(REFERENCE / "kitti_raw.tum")[1])


def _false_loops(name):
    def find(place):
        folder = place.unpacked("false_loops")
        return Recorded(_numbered(folder / name, ".ply"), p.read_tum(folder / name / "odometry.tum")[1],
                        p.read_tum(folder / f"{name}.truth.tum")[1])
    return find


def _kitti_07_dump(place):
    folder = next(place.unpacked("deskew").glob("**/kitti_07_dump"), None)
    if folder is None:
        raise Missing(f"there is no kitti_07_dump in deskew of {place.data}")
    converted = place.work / "data" / "kitti_07_dump"
    if not converted.is_dir():
        with whole_folder(converted) as unfinished:
            for file in sorted(folder.glob("*/points.bin")):
                clouds.write_pcd(unfinished / f"scan{int(file.parent.name)}.pcd", np.fromfile(file, "<f4").reshape(-1, 3))
    vertices = [line.split() for line in (folder / "graph.txt").read_text().splitlines() if line.startswith("v")]
    return Recorded(_numbered(converted, ".pcd"), None, p.matrices([[float(word) for word in words[1:8]] for words in vertices]))


def _town(seed):
    def find(place):
        folder = place.work / "data" / f"town-{seed}"
        if not folder.is_dir():
            with whole_folder(folder) as unfinished:
                place.run(place.town, "--seed", seed, "--out", unfinished)
        return Recorded(_numbered(folder, ".pcd"), p.read_tum(folder / "odometry.tum")[1], p.read_tum(folder / "truth.tum")[1])
    return find


def _simulated_drive(place):
    """The scans are those that the drivers make of the recording."""
    folder = place.work / "data" / "simulated-drive"
    if not folder.is_dir():
        with whole_folder(folder) as unfinished:
            place.run(place.alces, "simulate", "--scans", 924, "--seed", 1, "--out", unfinished / "drive.mcap")
            place.run(place.drive_scans, unfinished / "drive.mcap", "--out", unfinished / "scans")
    stamps, odometry = p.read_tum(folder / "scans" / "odometry.tum")
    true_stamps, truth = p.read_tum(folder / "drive.truth.tum")
    nearest = np.array([np.abs(true_stamps - stamp).argmin() for stamp in stamps])
    if np.abs(true_stamps[nearest] - stamps).max() > 0.02:
        raise RuntimeError(f"{folder}: scans without a true pose")
    return Recorded(_numbered(folder / "scans", ".pcd"), odometry, truth[nearest], stamps, folder / "drive.mcap")


_few = [f.AS_IT_IS, f.NO_ODOMETRY, f.Factor("every", 3), f.Factor("beams", 4), f.Factor("noise", 3), f.Factor("noise", 10), f.Factor("yaw", 5)]
_without_odometry = [f.AS_IT_IS, *f.SCANS, *f.POINTS, *f.BEAMS]

DRIVES = [
    Drive("hannover1", "HANNOVER1", _hannover1, beams.profiles, judges.hannover1, holds=True, quick=[f.AS_IT_IS, f.NO_ODOMETRY]),
    # Carried by hand through a building: the ways back are shorter.
    Drive("hilti_balm", "hilti_balm", _hilti_balm, beams.rings, gap_m=20.0, holds=True,
          quick=[f.AS_IT_IS, f.NO_ODOMETRY, f.Factor("every", 2), f.Factor("beams", 8), f.Factor("noise", 10)]),
    Drive("vlp16_street", "vlp16_street", _vlp16_street, beams.rings, judges.vlp16_street, reach_m=None, revisit=(2, 801), revisit_reach=20,
          straight=(300, 480), quick=[f.AS_IT_IS, f.Factor("beams", 2)]),
    Drive("kitti_raw", "kitti_raw", _kitti_raw, beams.rings, reach_m=None, factors=_without_odometry,
          quick=[f.AS_IT_IS, f.Factor("every", 3), f.Factor("beams", 8)]),
    # The corridors are parallel, the floors one above the other: near, and not the same place.
    Drive("two_corridors", "two_corridors", _false_loops("two_corridors"), beams.profiles, reach_m=None, family="false_loops",
          quick=[f.AS_IT_IS, f.NO_ODOMETRY, f.Factor("every", 2), f.Factor("points", 4), f.Factor("beams", 4), f.Factor("noise", 3),
                 f.Factor("yaw", 5)]),
    Drive("carpark_ramp", "carpark_ramp", _false_loops("carpark_ramp"), beams.profiles, reach_m=None, family="false_loops",
          quick=[f.AS_IT_IS, f.Factor("noise", 1), f.Factor("points", 8)]),
    # Of every other scan too little is seen by both; its odometry is its truth with noise.
    Drive("kitti_07_dump", "kitti_07_dump", _kitti_07_dump, beams.rings, reach_m=None, noise_of_truth=True,
          factors=[f.AS_IT_IS, *f.POINTS, *f.BEAMS, *f.ODOMETRY],
          quick=[f.AS_IT_IS, f.Factor("points", 4), f.Factor("beams", 4), f.Factor("noise", 1), f.Factor("noise", 10), f.Factor("yaw", 5)]),
    Drive("town-1", "town, seed 1", _town(1), beams.profiles, holds=True, family="town", quick=[f.AS_IT_IS, f.NO_ODOMETRY, f.Factor("points", 16)]),
    Drive("town-2", "town, seed 2", _town(2), beams.profiles, factors=_few, family="town"),
    Drive("town-3", "town, seed 3", _town(3), beams.profiles, factors=_few, family="town"),
    Drive("simulated-drive", "simulated drive", _simulated_drive, beams.profiles),
]
