#!/usr/bin/python3
"""write_ros1_bags.py SCANS OUT: a folder of scans (binary PCD called by their stamps, odometry.tum) as bags of ROS 1, by
python3-rosbag of Debian: none.bag, lz4.bag, bz2.bag, and tf.bag whose odometry is in /tf. Exit status 77: it is not installed."""
import os
import re
import struct
import sys

try:
    import genpy
    import rosbag
    from geometry_msgs.msg import TransformStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_msgs.msg import TFMessage
except ImportError as missing:
    print("skipped: %s (Debian: python3-rosbag, python3-sensor-msgs, python3-nav-msgs, python3-tf2-msgs)" % missing)
    sys.exit(77)


def time_of(text):
    whole, _, part = text.partition(".")
    return genpy.Time(int(whole), int(part.ljust(9, "0")[:9] or 0))


def later(time, nanoseconds):
    return time + genpy.Duration(0, nanoseconds)


def read_points(path):
    with open(path, "rb") as file:
        data = file.read()
    begin = data.index(b"DATA binary\n") + len(b"DATA binary\n")
    header = data[:begin].decode()
    count = int(re.search(r"POINTS\s+(\d+)", header).group(1))
    step = sum(int(size) for size in re.search(r"SIZE (.*)", header).group(1).split())
    return b"".join(data[begin + i * step:begin + i * step + 12] + struct.pack("<f", 0) for i in range(count))


def cloud(stamp, points):
    message = PointCloud2()
    message.header.stamp = stamp
    message.header.frame_id = "base_link"
    message.height, message.width = 1, len(points) // 16
    message.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(("x", "y", "z", "intensity"))]
    message.point_step, message.row_step = 16, len(points)
    message.data, message.is_dense = points, True
    return message


def fill(pose, translation, rotation):
    for target, values, names in ((translation, pose[:3], "xyz"), (rotation, pose[3:], "xyzw")):
        for name, value in zip(names, values):
            setattr(target, name, value)


def odometry(stamp, pose):
    message = Odometry()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, "odom", "base_link"
    fill(pose, message.pose.pose.position, message.pose.pose.orientation)
    return "/odom", message


def transform(stamp, pose):
    message = TransformStamped()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, "odom", "base_link"
    fill(pose, message.transform.translation, message.transform.rotation)
    return "/tf", TFMessage([message])


def main():
    scans, out = sys.argv[1:3]
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(scans, "odometry.tum")) as file:
        poses = [line.split() for line in file if line.strip() and not line.startswith("#")]
    names = sorted((name for name in os.listdir(scans) if name.endswith(".pcd")), key=lambda name: time_of(name[:-4]))
    for name, compression, say in (("none", "none", odometry), ("lz4", "lz4", odometry), ("bz2", "bz2", odometry),
                                   ("tf", "lz4", transform)):
        with rosbag.Bag(os.path.join(out, name + ".bag"), "w", compression=compression) as bag:
            for words in poses:
                stamp = time_of(words[0])
                topic, message = say(stamp, [float(word) for word in words[1:]])
                bag.write(topic, message, later(stamp, 1000000))
            for scan in names:
                stamp = time_of(scan[:-4])
                bag.write("/points", cloud(stamp, read_points(os.path.join(scans, scan))), later(stamp, 60000000))


main()
