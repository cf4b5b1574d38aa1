#!/usr/bin/env python3
"""A car's lidar of 64 beams: each scan has more cells than the usual voxel table. The table is sized by the fullest scan; in a memory
that is too small for that cells grow. Either way no region of a scan is lost, and the road below the car is there.
"""
import json
import math
import struct
import subprocess
from collections import Counter

from drive import Drive, check_run, main


def read_pcd(file):
    data = file.read_bytes()
    begin = data.index(b"DATA binary\n") + len(b"DATA binary\n")
    header = dict(line.split(" ", 1) for line in data[:begin].decode().splitlines() if " " in line)
    sizes = [int(size) for size in header["SIZE"].split()]
    assert header["FIELDS"].split()[:3] == ["x", "y", "z"] and sizes[:3] == [4, 4, 4]
    end = begin + sum(sizes) * int(header["POINTS"])
    return list(struct.iter_unpack(f"<3f{sum(sizes[3:])}x", data[begin:end]))


def read_stored_scans(file):
    """The points of each scan, as docs/map-folder.md describes the file."""
    data = file.read_bytes()
    assert data[:8] == b"\x89ALCES\r\n"
    version, scans = struct.unpack_from("<II", data, 8)
    assert version == 1
    position = 24
    for row in range(scans):
        number, size, _ = struct.unpack_from("<IIQ", data, position)
        assert number == row
        record = data[position + 24:position + 24 + size]
        position += 24 + size
        points = struct.unpack_from("<I", record, 8)[0]
        low, step = struct.unpack_from("<3f", record, 16), struct.unpack_from("<3f", record, 28)
        codes = struct.iter_unpack("<3H", record[40:40 + 6 * points])
        yield [tuple(a + b * c for a, b, c in zip(low, step, code)) for code in codes]
    assert position == len(data)


def sectors(points):
    """How many points beyond 6 m each sector of 10 deg azimuth and 4 deg elevation has: nearer ones are smaller than a cell."""
    counts = Counter()
    for x, y, z in points:
        level = math.hypot(x, y)
        if 6 < math.hypot(level, z) < 100:
            counts[int(math.degrees(math.atan2(y, x)) // 10), int(math.degrees(math.atan2(z, level)) // 4)] += 1
    return counts


def check_regions(figures, scans, out):
    files = sorted(scans.glob("*.pcd"))
    for row, points in enumerate(read_stored_scans(out / "scans.alces")):
        if row % 7 != 0:
            continue
        seen, kept = sectors(read_pcd(files[row])), sectors(points)
        wide = [sector for sector, count in seen.items() if count >= 100]  # fewer may share their cells with a neighbour
        figures.at_least(f"sectors seen in scan {row}", len(wide), 150)
        figures.equal(f"of these lost in scan {row}", sum(kept[sector] == 0 for sector in wide), 0)
        below = sum(count for (_, elevation), count in kept.items() if elevation < -2)
        figures.at_least(f"points more than 8 deg below in scan {row}", below, 1000)


def test(options, figures):
    drive = Drive(options, "kitti_raw")
    out, run = drive.map("kitti_raw_map")
    check_run(figures, run, 22, 64)
    figures.equal("the largest cell", run["counters"]["coarsest_cell_m"], 0.1, "m")
    check_regions(figures, drive.scans, out)
    print("in 20 MiB")
    small_out = drive.work / "kitti_raw_map_20MiB"
    result = subprocess.run([drive.alces, "map", drive.scans, "--out", small_out, "--memory", "20MiB"], capture_output=True,
                            text=True, check=True, timeout=280)
    figures.equal("it is said", "22 scans" in result.stderr and "thinned coarser: largest cell of 0.2 m" in result.stderr, True)
    small_run = json.loads((small_out / "run.json").read_text())
    figures.equal("scans", small_run["scans"], 22)
    figures.equal("scans_thinned", small_run["counters"]["scans_thinned"], 22)
    figures.equal("points without a cell", small_run["counters"]["points_without_cell"], 0)
    figures.equal("the largest cell", small_run["counters"]["coarsest_cell_m"], 0.2, "m")
    check_regions(figures, drive.scans, small_out)


main(__doc__, test)
