"""Loops that are right, wrong and missed, beside the truth or a reference map."""
from dataclasses import dataclass

import numpy as np

import poses as p

WRONG_M, WRONG_DEG = 0.3, 2.0
TIED_WITHIN_M = 15  # of the way, before or after a visit


@dataclass
class LoopCount:
    right: int = 0
    wrong: int = 0
    visits: int = 0  # places driven again
    missed: int = 0  # of them
    worst_m: float = 0.0


def is_wrong(matched, true):
    return bool(p.distance_m(matched, true) > WRONG_M or p.angle_deg(matched, true) > WRONG_DEG)


def visits(truth, reach_m, gap_m):
    """Stretches of rows (first, last) that lead within reach of where the drive was before, with a gap of way in between."""
    way = p.way_m(truth)
    places = truth[:, :3, 3]
    stretches = []
    for row in range(len(truth)):
        earlier = np.searchsorted(way, way[row] - gap_m, "right")
        if earlier == 0 or np.min(np.linalg.norm(places[:earlier] - places[row], axis=1)) > reach_m:
            continue
        if stretches and way[row] - way[stretches[-1][1]] < TIED_WITHIN_M:
            stretches[-1][1] = row
        else:
            stretches.append([row, row])
    return stretches


def count(loops, truth, reach_m, gap_m):
    """`loops`: first row, last row, the pose of last seen from first as it was matched. No reach: nothing is driven again."""
    result = LoopCount()
    way = p.way_m(truth)
    right_ends = []
    for first, last, matched in loops:
        true = p.between(truth[first], truth[last])
        result.worst_m = max(result.worst_m, float(p.distance_m(matched, true)))
        if is_wrong(matched, true):
            result.wrong += 1
        else:
            result.right += 1
            right_ends.append(way[last])
    if reach_m is not None:
        right_ends = np.array(right_ends)
        for first, last in visits(truth, reach_m, gap_m):
            result.visits += 1
            is_tied = (right_ends > way[first] - TIED_WITHIN_M) & (right_ends < way[last] + TIED_WITHIN_M)
            result.missed += not np.any(is_tied)
    return result
