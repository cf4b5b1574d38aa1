#!/usr/bin/env python3
"""check_memory.py WORK ALCES: info and map of a bag of 600 scans of 1 MB must do with 200 MiB."""
import os
import resource
import struct
import subprocess
import sys

work, alces = sys.argv[1:3]
os.makedirs(work, exist_ok=True)
bag_path = os.path.join(work, "large.bag")


def field(name, value):
    return struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value


def record(header, data):
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def text(value):
    return struct.pack("<I", len(value)) + value


def cloud(index, points):
    fields = b"".join(text(name) + struct.pack("<IBI", 4 * place, 7, 1) for place, name in enumerate((b"x", b"y", b"z")))
    return (struct.pack("<III", index, 1700000000 + index // 10, index % 10 * 100000000) + text(b"lidar") +
            struct.pack("<II", 1, len(points) // 12) + struct.pack("<I", 3) + fields + struct.pack("<BII", 0, 12, len(points)) +
            text(points) + b"\1")


conn = field(b"conn", struct.pack("<I", 0))
corner = [(x, y, z) for x in range(40) for y in range(40) for z in (0, x, y)]
points = b"".join(struct.pack("<fff", 0.25 * x - 3, 0.25 * y - 3, 0.25 * z - 1) for x, y, z in corner)
points *= 1000000 // len(points)
with open(bag_path, "wb") as bag:
    bag.write(b"#ROSBAG V2.0\n")
    for index in range(600):
        chunk = b""
        if index == 0:
            chunk += record(conn + field(b"op", b"\7") + field(b"topic", b"/points"),
                            field(b"topic", b"/points") + field(b"type", b"sensor_msgs/PointCloud2") +
                            field(b"md5sum", b"*") + field(b"message_definition", b""))
        stamp = struct.pack("<II", 1700000000 + index // 10, index % 10 * 100000000)
        chunk += record(conn + field(b"op", b"\2") + field(b"time", stamp), cloud(index, points))
        bag.write(record(field(b"compression", b"none") + field(b"op", b"\5") + field(b"size", struct.pack("<I", len(chunk))),
                         chunk))
size = os.path.getsize(bag_path)
for arguments in (["info", bag_path], ["map", bag_path, "--out", os.path.join(work, "map")]):
    done = subprocess.run([alces] + arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(done.stdout)
os.remove(bag_path)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
print("a bag of %d MB, read and mapped in at most %d MB" % (size // 1000000, peak // 1000000))
sys.exit(0 if size > 500e6 and peak < 200 * 1024 * 1024 else 1)
