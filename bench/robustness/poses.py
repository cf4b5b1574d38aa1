"""Rigid poses as arrays of 4x4 matrices (N, 4, 4), and trajectories in TUM's form."""
import numpy as np


def matrices(numbers):
    """Of rows x y z qx qy qz qw."""
    numbers = np.asarray(numbers, float).reshape(-1, 7)
    x, y, z, w = (numbers[:, 3:] / np.linalg.norm(numbers[:, 3:], axis=1, keepdims=True)).T
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3, 3] = numbers[:, :3]
    poses[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    poses[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    poses[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    return poses


def quaternion(rotation):
    """x y z w of a 3x3 rotation: the eigenvector that belongs to the largest eigenvalue, which is good for every angle."""
    r = rotation
    k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
                  [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
                  [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]]])
    q = np.linalg.eigh(k)[1][:, -1]
    return q if q[3] >= 0 else -q


def read_tum(file):
    """Stamps, and map_from_body."""
    numbers = np.loadtxt(file, ndmin=2)
    return numbers[:, 0], matrices(numbers[:, 1:8])


def write_tum(file, stamps, poses):
    with open(file, "w") as out:
        for stamp, pose in zip(stamps, poses):
            name = str(int(stamp)) if stamp == int(stamp) else f"{stamp:.9f}"
            numbers = [f"{number:.9f}" for number in (*pose[:3, 3], *quaternion(pose[:3, :3]))]
            out.write(" ".join([name, *numbers]) + "\n")


def inverse(poses):
    result = np.tile(np.eye(4), (*poses.shape[:-2], 1, 1))
    result[..., :3, :3] = np.swapaxes(poses[..., :3, :3], -1, -2)
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", result[..., :3, :3], poses[..., :3, 3])
    return result


def between(a, b):
    """b as it is seen from a."""
    return inverse(a) @ b


def steps(poses):
    """Each pose as it is seen from the one before."""
    return between(poses[:-1], poses[1:])


def chained(first, steps_from_last):
    poses = [first]
    for step in steps_from_last:
        poses.append(poses[-1] @ step)
    return np.array(poses)


def distance_m(a, b):
    return np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1)


def angle_deg(a, b):
    """By the chord, which is exact for small angles, too."""
    chord = np.linalg.norm(a[..., :3, :3] - b[..., :3, :3], axis=(-2, -1))
    return np.degrees(2 * np.arcsin(np.clip(chord / np.sqrt(8), 0, 1)))


def way_m(poses):
    """Driven up to each pose."""
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1))])


def yaw_pose(angle_rad, x_m=0.0, y_m=0.0):
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0, x_m], [s, c, 0, y_m], [0, 0, 1, 0], [0, 0, 0, 1]])
