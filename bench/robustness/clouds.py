"""Points of a scan (N, 3), float32, in the body frame (REP 103, metres), in the order of the file."""
import numpy as np


def read(file):
    reader = {".pcd": _read_pcd, ".ply": _read_ply, ".3d": _read_3dtk}[file.suffix]
    points = reader(file)
    return points[np.isfinite(points).all(axis=1)]


def _read_pcd(file):
    data = file.read_bytes()
    begin = data.index(b"\n", data.index(b"DATA binary")) + 1
    header = {words[0]: words[1:] for words in (line.split() for line in data[:begin].decode().splitlines()) if words}
    kinds = {"F": "f", "U": "u", "I": "i"}
    row = np.dtype([(name, f"<{kinds[kind]}{size}") for name, kind, size in zip(header["FIELDS"], header["TYPE"], header["SIZE"])])
    rows = np.frombuffer(data, row, int(header["POINTS"][0]), begin)
    return np.stack([rows["x"], rows["y"], rows["z"]], 1)


def _read_ply(file):
    data = file.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:begin].decode().splitlines()
    if "format binary_little_endian 1.0" not in header or [line for line in header if line.startswith("property")] != \
            ["property float x", "property float y", "property float z"]:
        raise ValueError(f"{file}: no binary PLY of x y z as float")
    return np.frombuffer(data, "<f4", offset=begin).reshape(-1, 3)


def _read_3dtk(file):
    """uos: left-handed, x right, y up, z forward, cm."""
    cm = np.fromstring(file.read_text(), sep=" ").reshape(-1, 3)
    return np.stack([cm[:, 2], -cm[:, 0], cm[:, 1]], 1).astype(np.float32) / np.float32(100)


def write_pcd(file, points):
    header = ("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
              f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n")
    file.write_bytes(header.encode() + np.ascontiguousarray(points, "<f4").tobytes())
