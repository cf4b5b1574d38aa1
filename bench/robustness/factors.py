"""The factors: each changes one thing of a drive as it was recorded. All random choices follow from SEED, the set, the factor and
the scan.
"""
import zlib
from dataclasses import dataclass

import numpy as np

import beams
import poses as p

SEED = 11
VERSION = 1  # of what is made here: another one makes the variants anew

# Errors of the odometry of a wheeled robot, once. Errors of separate metres are independent, so standard deviations grow with the
# root of the way: the model says the same whether scans are half a metre or three metres apart. The scale is one draw a drive.
SCALE = 0.01                # of the way: tyres' pressure and load change a wheel's circumference by a percent
ALONG_M = 0.02              # a root metre: slip
ACROSS_M = 0.01             # a root metre: slip in bends, caster wheels
HEADING_DEG = 0.5           # a root metre: 5 deg after 100 m, as gyros of such robots and wheels of different size give
TURN = 0.02                 # of the angle turned: skid, track width


@dataclass(frozen=True)
class Factor:
    kind: str
    number: int = 0

    @property
    def name(self):
        return self.kind if self.number == 0 else f"{self.kind}-{self.number}"

    @property
    def title(self):
        return {"as-it-is": "as it is",
                "no-odometry": "without odometry",
                "every": f"every {self.number}{'nd' if self.number == 2 else 'rd'} scan only",
                "points": f"1/{self.number} of the points, at random",
                "beams": f"1/{self.number} of the beams",
                "noise": f"odometry's noise x {self.number}",
                "yaw": f"mounting off by {self.number} deg"}[self.kind]

    def rows(self, size):
        """Of the scans that are left."""
        return np.arange(0, size, self.number if self.kind == "every" else 1)

    @property
    def changes_points(self):
        return self.kind in ("points", "beams")

    def points(self, points, drive, row, find_beams):
        """What is left of the points of a scan, in their order."""
        if self.kind == "points":
            chosen = np.random.default_rng([SEED, _number(drive), self.number, row])
            return points[np.sort(chosen.choice(len(points), len(points) // self.number, replace=False))]
        return points[find_beams(points) % self.number == 0]

    def odometry(self, odometry, drive):
        """map_from_body, changed; None: there is none."""
        if self.kind == "no-odometry" or odometry is None:
            return None
        if self.kind == "noise":
            return _noisy(odometry, self.number, np.random.default_rng([SEED, _number(drive), self.number]))
        if self.kind == "yaw":  # the body's x axis is not where the wheels think
            mounting = p.yaw_pose(np.radians(self.number))
            return p.inverse(mounting) @ odometry @ mounting
        return odometry


def _number(name):
    return zlib.crc32(name.encode())


def _noisy(odometry, times, random):
    scale = 1 + times * SCALE * random.standard_normal()
    noisy = []
    for step in p.steps(odometry):
        way = np.linalg.norm(step[:3, 3])
        turn = np.arctan2(step[1, 0], step[0, 0])
        root = np.sqrt(way)
        draw = times * random.standard_normal(4)
        heading = np.radians(HEADING_DEG) * root * draw[2] + TURN * abs(turn) * draw[3]
        error = p.yaw_pose(heading, ALONG_M * root * draw[0], ACROSS_M * root * draw[1])
        scaled = step.copy()
        scaled[:3, 3] *= scale
        noisy.append(scaled @ error)
    return p.chained(odometry[0], noisy)


AS_IT_IS = Factor("as-it-is")
NO_ODOMETRY = Factor("no-odometry")
SCANS = [Factor("every", 2), Factor("every", 3)]
POINTS = [Factor("points", 2), Factor("points", 4), Factor("points", 8), Factor("points", 16)]
BEAMS = [Factor("beams", 2), Factor("beams", 4), Factor("beams", 8), Factor("beams", 16)]
ODOMETRY = [Factor("noise", 1), Factor("noise", 3), Factor("noise", 10), Factor("yaw", 5)]
ALL = [AS_IT_IS, NO_ODOMETRY, *SCANS, *POINTS, *BEAMS, *ODOMETRY]
