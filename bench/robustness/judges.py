"""What is measured of a map, and when it is "off". The definitions are fixed here, before any run: docs/benchmarks.md has them, too.

A judge takes a map (maps.Map) and gives a Judgement. Whatever the set, a map that is not there, that ends before the last scan, or
that leaves out more than one scan in a hundred is off.
"""
from dataclasses import dataclass, field

import numpy as np

import loops as l
import poses as p

# With truth: the mean error that a map may have, and the worst.
ERROR_M, ERROR_OF_WAY = 0.3, 0.003
WORST_FACTOR = 3
# Torn: a scan that stands so far beside where the scan before has it shows as a double wall.
TORN_M, TORN_DEG = 0.5, 5.0
# Driven again: where two visits are to agree.
REVISIT_M = 0.5
# HANNOVER1
REVISITS_MEDIAN_M = 0.06
# vlp16_street
HEIGHTS_M = 3.0
REVISIT_OFF_M = 0.3


@dataclass
class Judgement:
    figures: dict = field(default_factory=dict)  # by name, numbers
    text: str = ""                               # for the table
    reasons: list = field(default_factory=list)  # why the map is off; none: it is right
    loops: l.LoopCount | None = None

    def off_if(self, is_off, reason):
        if is_off:
            self.reasons.append(reason)


def judge(drive, rows, result):
    judgement = Judgement()
    missing = len(rows) - (0 if result.poses is None else len(result.poses))
    judgement.off_if(result.exit_status != 0, result.problem)
    judgement.off_if(missing > 0.01 * len(rows), f"{missing} of {len(rows)} scans are not in it")
    if result.poses is None or len(result.poses) < 2:
        judgement.text = "no map"
        return judgement
    drive.judge(drive, judgement, rows, result)
    return judgement


def _torn(judgement, poses, truth):
    steps, true_steps = p.steps(poses), p.steps(truth)
    off_m, off_deg = p.distance_m(steps, true_steps), p.angle_deg(steps, true_steps)
    judgement.figures |= {"worst_step_m": float(off_m.max()), "worst_step_deg": float(off_deg.max()),
                          "median_step_m": float(np.median(off_m))}
    judgement.off_if(off_m.max() > TORN_M or off_deg.max() > TORN_DEG,
                     f"torn: a step is off by {off_m.max():.2f} m, {off_deg.max():.1f} deg")


def _doubled(judgement, poses, truth, reach_m, gap_m):
    """How far what is driven again is beside itself, beyond the truth: each scan against the nearest one of an earlier visit."""
    way = p.way_m(truth)
    worst = 0.0
    for first, last in l.visits(truth, reach_m, gap_m):
        for row in range(first, last + 1):
            earlier = np.searchsorted(way, way[row] - gap_m, "right")
            distances = np.linalg.norm(truth[:earlier, :3, 3] - truth[row, :3, 3], axis=1)
            if earlier > 0 and distances.min() <= reach_m:
                before = int(distances.argmin())
                worst = max(worst, float(p.distance_m(p.between(poses[before], poses[row]), p.between(truth[before], truth[row]))))
    judgement.figures["worst_revisit_m"] = worst
    judgement.off_if(worst > REVISIT_M, f"double: a place driven again is {worst:.2f} m beside itself")


def _against(judgement, poses, truth):
    """With the first poses laid together, as a user meets the map."""
    laid = truth[0] @ p.inverse(poses[0]) @ poses
    error = p.distance_m(laid, truth)
    limit = max(ERROR_M, ERROR_OF_WAY * p.way_m(truth)[-1])
    judgement.figures |= {"error_m": float(error.mean()), "worst_m": float(error.max()), "limit_m": limit,
                          "error_deg": float(p.angle_deg(laid, truth).mean())}
    judgement.off_if(error.mean() > limit or error.max() > WORST_FACTOR * limit,
                     f"{error.mean():.2f} m off in the mean, {error.max():.2f} m at worst")


def with_truth(drive, judgement, rows, result):
    truth = drive.truth[rows][result.rows]
    _against(judgement, result.poses, truth)
    _torn(judgement, result.poses, truth)
    if drive.reach_m is not None:
        _doubled(judgement, result.poses, truth, drive.reach_m, drive.gap_m)
    judgement.loops = l.count(result.loops, truth, drive.reach_m, drive.gap_m)
    figures = judgement.figures
    judgement.text = f"{_metres(figures['error_m'])}, worst {_metres(figures['worst_m'])}"
    if drive.reach_m is not None:
        judgement.text += f", revisits {_metres(figures['worst_revisit_m'])}"


def hannover1(drive, judgement, rows, result):
    """Consistency of its 298 pairs of revisits, all points of the scans at the map's poses; steps beside the reference map."""
    reference = drive.truth[rows][result.rows]
    _torn(judgement, result.poses, reference)
    judgement.loops = l.count(result.loops, reference, drive.reach_m, drive.gap_m)
    groups = {group["name"]: group for group in result.consistency()["groups"]}
    lost, pairs = groups["revisits"]["without_overlap"], groups["revisits"]["pairs"]
    medians = [groups[name]["median_m"] for name in ("next", "five apart", "revisits")]
    judgement.figures |= {"next_m": medians[0], "five_apart_m": medians[1], "revisits_m": medians[2], "pairs": pairs, "pairs_lost": lost}
    judgement.off_if(lost > 0, f"{lost} of {pairs} pairs of revisits without overlap")
    judgement.off_if(medians[2] is not None and medians[2] > REVISITS_MEDIAN_M, f"revisits are {100 * (medians[2] or 0):.1f} cm apart")
    shown = " / ".join("-" if median is None else f"{100 * median:.1f}" for median in medians)
    judgement.text = f"{shown} cm, {lost} of {pairs} pairs lost"


def vlp16_street(drive, judgement, rows, result):
    """Heights of a level street, with loops and without; the one revisit; the shape of the steps."""
    reference = drive.truth[rows][result.rows]
    poses = result.poses
    heights = float(np.ptp(poses[:, 2, 3]))
    before = result.poses_without_loops
    heights_before = float(np.ptp(before[:, 2, 3])) if before is not None else heights
    original = rows[result.rows]
    a, b = (int(np.abs(original - scan).argmin()) for scan in drive.revisit)
    off_m = float(p.distance_m(p.between(poses[a], poses[b]), p.between(reference[a], reference[b])))
    judgement.figures |= {"heights_m": heights, "heights_without_loops_m": heights_before, "revisit_off_m": off_m}
    judgement.off_if(max(heights, heights_before) > HEIGHTS_M, f"heights over {max(heights, heights_before):.1f} m of a level street")
    judgement.off_if(off_m > REVISIT_OFF_M, f"the revisit is {off_m:.2f} m beside itself")
    _torn(judgement, poses, reference)

    # Wrong is also what ties two places of which one is not driven again, however little it moves them.
    starts, ends = drive.revisit[0] + drive.revisit_reach, drive.revisit[1] - drive.revisit_reach
    judgement.loops = l.count(result.loops, reference, None, drive.gap_m)
    same_pass = sum(bool(not l.is_wrong(matched, p.between(reference[first], reference[last]))
                         and not (original[first] <= starts and original[last] >= ends)) for first, last, matched in result.loops)
    judgement.loops.right -= same_pass
    judgement.loops.wrong += same_pass
    judgement.loops.visits, judgement.loops.missed = 1, int(judgement.loops.right == 0)
    in_straight = sum(bool(drive.straight[0] <= original[first] and original[last] <= drive.straight[1])
                      for first, last, _ in result.loops)
    judgement.figures["loops_in_straight_part"] = in_straight
    judgement.off_if(in_straight > 0, f"{in_straight} loops within the straight part")
    judgement.text = f"heights {heights:.1f} m ({heights_before:.1f} without loops), revisit {_metres(off_m)}"


def _metres(value):
    return f"{value:.3f} m" if value < 0.1 else f"{value:.2f} m" if value < 10 else f"{value:.0f} m"
