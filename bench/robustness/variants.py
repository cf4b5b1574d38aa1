"""A drive with one factor changed, as a folder of scans that `alces map` reads: scanNNNN, and odometry.tum where there is odometry.
Kept in WORK/variants; what does not change the points is links to the scans as they were.
"""
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import clouds
import factors as f
import poses as p
from drives import whole_folder


@dataclass
class Variant:
    folder: Path
    rows: np.ndarray        # of the drive, that are scans here
    recording: Path | None  # to be replayed instead
    full_scans: Path        # the same scans with all of their points


def make(drive, factor, place):
    recorded = drive.prepare(place)
    rows = factor.rows(len(recorded.scans))
    folder = place.work / "variants" / f"v{f.VERSION}" / drive.name / factor.name
    if not folder.is_dir():
        with whole_folder(folder) as unfinished:
            _write_scans(drive, factor, recorded, rows, unfinished)
            _write_odometry(drive, factor, recorded, rows, unfinished)
    full_scans = make(drive, f.AS_IT_IS, place).folder if factor.changes_points else folder
    return Variant(folder, rows, recorded.recording if factor == f.AS_IT_IS else None, full_scans)


def _write_scans(drive, factor, recorded, rows, folder):
    for number, row in enumerate(rows):
        file = recorded.scans[row]
        if factor.changes_points:
            points = factor.points(clouds.read(file), drive.name, int(row), drive.find_beams)
            clouds.write_pcd(folder / f"scan{number:04}.pcd", points)
        else:
            os.symlink(file.absolute(), folder / f"scan{number:04}{file.suffix}")


def _write_odometry(drive, factor, recorded, rows, folder):
    odometry = recorded.odometry
    if odometry is None and drive.noise_of_truth and factor in f.ODOMETRY:
        odometry = recorded.truth
    odometry = factor.odometry(odometry if odometry is None else odometry[rows], drive.name)
    if odometry is not None:
        stamps = np.arange(len(rows)) if recorded.stamps is None else recorded.stamps[rows]
        p.write_tum(folder / "odometry.tum", stamps, odometry)
