#!/usr/bin/env python3
"""wall_sections.py OUT.png SCAN MAP [MAP ...]: walls around a scan, cut horizontally, of several maps side by side.

Points of map.ply between --low and --high metres above the scanner and within --reach of scan SCAN, seen from its pose in
each map, coloured by when they were taken. Walls seen on several visits lie on one line in a good map. Needs gnuplot.
"""
import argparse
import os
import struct
import subprocess
import tempfile


def read_poses(folder):
    poses = []
    with open(os.path.join(folder, "trajectory.tum"), encoding="utf-8") as lines:
        for line in lines:
            if not line.startswith("#"):
                poses.append([float(word) for word in line.split()])
    return poses


def matrix(x, y, z, w):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def section(folder, scan, low, high, reach):
    pose = read_poses(folder)[scan]
    origin, turn = pose[1:4], matrix(*pose[4:8])
    points = []
    with open(os.path.join(folder, "map.ply"), "rb") as file:
        while file.readline().strip() != b"end_header":
            pass
        data = file.read()
    for x, y, z, number in struct.iter_unpack("<fffI", data):
        dx, dy, dz = x - origin[0], y - origin[1], z - origin[2]
        if abs(dx) > 2 * reach or abs(dy) > 2 * reach or abs(dz) > 2 * reach:
            continue
        up = turn[0][2] * dx + turn[1][2] * dy + turn[2][2] * dz
        if low <= up <= high:
            ahead = turn[0][0] * dx + turn[1][0] * dy + turn[2][0] * dz
            left = turn[0][1] * dx + turn[1][1] * dy + turn[2][1] * dz
            if abs(ahead) <= reach and abs(left) <= reach:
                points.append((ahead, left, number))
    return points


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("scan", type=int, help="row of trajectory.tum, from 0")
    parser.add_argument("maps", nargs="+")
    parser.add_argument("--titles", help="of the maps, separated by commas; default: the folders' names")
    parser.add_argument("--low", type=float, default=0.3)
    parser.add_argument("--high", type=float, default=0.7)
    parser.add_argument("--reach", type=float, default=12)
    parser.add_argument("--size", type=int, default=440, help="pixels a map")
    options = parser.parse_args()
    titles = options.titles.split(",") if options.titles else [os.path.basename(os.path.normpath(m)) for m in options.maps]
    if len(titles) != len(options.maps):
        parser.error("as many --titles as maps")
    reach, size = options.reach, options.size
    with tempfile.TemporaryDirectory() as scratch:
        plots, last = [], 1
        for i, folder in enumerate(options.maps):
            name = os.path.join(scratch, f"{i}.txt")
            points = section(folder, options.scan, options.low, options.high, reach)
            last = max([last] + [number for _, _, number in points])
            with open(name, "w", encoding="utf-8") as file:
                for point in points:
                    file.write("{:.3f} {:.3f} {}\n".format(*point))
            plots.append(f"set title '{titles[i]}' noenhanced\nplot '{name}' using 1:2:3 with dots palette notitle\n")
        rows = 1 if len(plots) <= 2 else 2
        columns = (len(plots) + rows - 1) // rows
        script = (f"set terminal pngcairo size {columns * size},{rows * size} font 'sans,9'\nset output '{options.out}'\n"
                  f"set multiplot layout {rows},{columns} margins 0.05,0.98,0.05,0.95 spacing 0.05,0.07\n"
                  "set size ratio -1\nset tics out nomirror\nunset colorbox\nset border lc rgb '#808080'\n"
                  f"set xrange [-{reach}:{reach}]\nset yrange [-{reach}:{reach}]\nset cbrange [0:{last}]\n"
                  # early to late; dark enough on white from end to end
                  "set palette defined (0 '#0b1f8c', 0.33 '#c2185b', 0.66 '#ef6c00', 1 '#2e7d32')\n"
                  + "".join(plots) + "unset multiplot\n")
        subprocess.run(["gnuplot"], input=script, text=True, check=True)


if __name__ == "__main__":
    main()
