#!/usr/bin/python3
"""The instrument of the robustness table itself: beams are found, factors change one thing, and what is off is called off."""
import json
import sys
import types
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench" / "robustness"))
try:
    import numpy as np
except ImportError:
    print("skipped: NumPy is missing (Debian: python3-numpy)")
    sys.exit(77)
import beams
import factors as f
import judges
import leave_one_out
import loops
import poses as p
import table


def lidar(elevations_deg, columns=900, smear_deg=0.0, order="rings"):
    """Points of a spinning lidar in a round room, and the laser of each."""
    azimuth, laser = np.meshgrid(np.linspace(np.pi, -np.pi, columns, endpoint=False), np.arange(len(elevations_deg)))
    if order == "columns":
        azimuth, laser = azimuth.T, laser.T
    azimuth, laser = azimuth.ravel(), laser.ravel()
    random = np.random.default_rng(1)
    elevation = np.radians(np.asarray(elevations_deg)[laser] + smear_deg * random.standard_normal(len(laser)))
    directions = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], 1)
    points = (directions * (5 + 3 * np.sin(3 * azimuth))[:, None]).astype(np.float32)
    return points, laser


def street(length=100, visits=2, step_m=1.0):
    """Poses along a street of this length and back on the same line, again and again."""
    one_way = np.arange(0, length, step_m)
    x = np.concatenate([one_way if visit % 2 == 0 else one_way[::-1] for visit in range(visits)])
    poses = np.tile(np.eye(4), (len(x), 1, 1))
    poses[:, 0, 3] = x
    return poses


def judged(poses, truth, closed=(), reach_m=5.0, rows=None):
    drive = types.SimpleNamespace(truth=truth, reach_m=reach_m, gap_m=40.0, judge=judges.with_truth)
    result = types.SimpleNamespace(exit_status=0, problem="", poses=poses, rows=np.arange(len(poses)), loops=list(closed))
    return judges.judge(drive, np.arange(len(truth)) if rows is None else rows, result)


class Beams(unittest.TestCase):
    def test_rings_are_found_in_the_order_of_the_file(self):
        points, laser = lidar(np.linspace(-24, 2, 64), smear_deg=0.1)
        self.assertTrue(np.array_equal(beams.rings(points), laser))

    def test_rings_are_found_by_their_elevation_where_points_come_in_columns(self):
        points, laser = lidar(np.arange(-15, 16, 2), order="columns")
        self.assertTrue(np.array_equal(beams.rings(points), laser))

    def test_where_rings_cannot_be_told_apart_there_are_as_many_bands(self):
        points, _ = lidar(np.linspace(-24, 2, 64), smear_deg=0.3, order="columns")
        self.assertEqual(len(np.unique(beams.rings(points))), beams.BANDS)

    def test_profiles_of_a_turning_laser_are_found(self):
        angle = np.radians(np.arange(-60, 90))
        points = [5 * np.stack([np.cos(angle) * np.cos(yaw), np.cos(angle) * np.sin(yaw), np.sin(angle) + 0.2], 1)
                  for yaw in np.arange(0, 6, 0.1)]
        expected = np.repeat(np.arange(60), len(angle))
        self.assertTrue(np.array_equal(beams.profiles(np.concatenate(points)), expected))


class Factors(unittest.TestCase):
    def test_points_are_thinned_out_to_the_share_and_the_same_ones_every_time(self):
        points, _ = lidar(np.arange(-15, 16, 2))
        factor = f.Factor("points", 8)
        one, again = (factor.points(points, "a", 3, beams.rings) for _ in range(2))
        self.assertEqual(len(one), len(points) // 8)
        self.assertTrue(np.array_equal(one, again))
        self.assertFalse(np.array_equal(one, factor.points(points, "a", 4, beams.rings)))

    def test_of_the_beams_every_nth_is_left(self):
        points, laser = lidar(np.arange(-15, 16, 2), order="columns")
        self.assertTrue(np.array_equal(f.Factor("beams", 4).points(points, "a", 0, beams.rings), points[laser % 4 == 0]))

    def test_ten_times_the_noise_is_ten_times_as_wrong(self):
        odometry = street(length=200, visits=1)

        def error_m(times):
            noisy = [f.Factor("noise", times).odometry(odometry, f"drive {number}") for number in range(40)]
            return np.sqrt(np.mean([np.sum((one[-1, :3, 3] - odometry[-1, :3, 3]) ** 2) for one in noisy]))

        self.assertAlmostEqual(error_m(10) / error_m(1), 10, delta=4)
        # 100 m on: the heading's walk of 0.5 deg a root metre, 2 cm a root metre and 1 % of the way, to be within a factor
        self.assertTrue(5 < error_m(1) < 25, error_m(1))

    def test_the_odometry_of_a_wrong_mounting_turns_each_step(self):
        odometry = street(length=10, visits=1)
        turned = f.Factor("yaw", 5).odometry(odometry, "a")
        self.assertTrue(np.allclose(turned[0], np.eye(4)))
        step = p.steps(turned)[4]
        self.assertAlmostEqual(np.degrees(np.arctan2(step[1, 3], step[0, 3])), -5)
        self.assertAlmostEqual(np.linalg.norm(step[:3, 3]), 1)

    def test_without_odometry_there_is_none(self):
        self.assertIsNone(f.NO_ODOMETRY.odometry(street(), "a"))

    def test_names_are_not_given_twice(self):
        self.assertEqual(len({factor.name for factor in f.ALL}), len(f.ALL))


class Poses(unittest.TestCase):
    def test_a_quaternion_and_its_matrix_are_the_same_rotation(self):
        random = np.random.default_rng(2)
        for q in random.standard_normal((20, 4)):
            q = q / np.linalg.norm(q) * (1 if q[3] >= 0 else -1)
            self.assertTrue(np.allclose(p.quaternion(p.matrices([[0, 0, 0, *q]])[0, :3, :3]), q))

    def test_angles_are_those_of_the_axis(self):
        self.assertAlmostEqual(float(p.angle_deg(np.eye(4), p.yaw_pose(np.radians(2)))), 2)
        self.assertAlmostEqual(float(p.angle_deg(np.eye(4), p.yaw_pose(np.pi))), 180)


class Loops(unittest.TestCase):
    def setUp(self):
        self.truth = street()  # rows 0 to 99 out, 100 to 199 back

    def loop(self, first, last, off_m=0.0):
        return first, last, p.between(self.truth[first], self.truth[last]) @ p.yaw_pose(0, off_m)

    def test_a_drive_back_is_one_visit_and_a_loop_ties_it(self):
        self.assertEqual(len(loops.visits(self.truth, 5.0, 40.0)), 1)
        self.assertEqual(loops.count([], self.truth, 5.0, 40.0).missed, 1)
        self.assertEqual(loops.count([self.loop(40, 159)], self.truth, 5.0, 40.0).missed, 0)

    def test_a_loop_that_is_off_is_wrong_and_ties_nothing(self):
        count = loops.count([self.loop(40, 159, 0.31)], self.truth, 5.0, 40.0)
        self.assertEqual((count.right, count.wrong, count.missed), (0, 1, 1))

    def test_where_nothing_is_driven_again_nothing_is_missed(self):
        count = loops.count([], self.truth, None, 40.0)
        self.assertEqual((count.visits, count.missed), (0, 0))


class Off(unittest.TestCase):
    def setUp(self):
        self.truth = street()

    def assert_off(self, judgement, because):
        self.assertTrue(any(because in reason for reason in judgement.reasons), judgement.reasons)

    def test_a_map_like_the_truth_is_right(self):
        self.assertEqual(judged(self.truth.copy(), self.truth).reasons, [])

    def test_where_the_first_scan_stands_does_not_matter(self):
        moved = p.yaw_pose(1.0, 20, 30) @ self.truth
        self.assertEqual(judged(moved, self.truth).reasons, [])

    def test_a_map_that_bends_by_more_than_its_limit_is_off(self):
        bent = self.truth.copy()
        bent[:, 2, 3] = np.linspace(0, 2.0, len(bent))  # 200 m: limit 0.6 m
        self.assert_off(judged(bent, self.truth, reach_m=None), "off in the mean")

    def test_one_scan_beside_its_place_is_off(self):
        torn = self.truth.copy()
        torn[50, 1, 3] += 0.51
        self.assert_off(judged(torn, self.truth), "torn")

    def test_two_visits_beside_each_other_are_off(self):
        double = self.truth.copy()
        double[100:, 1, 3] += np.minimum(0.56, 0.01 * np.arange(100))
        self.assert_off(judged(double, self.truth), "double")
        self.assertEqual(judged(double, self.truth, reach_m=None).reasons, [])

    def test_a_map_that_ends_early_is_off(self):
        self.assert_off(judged(self.truth[:150], self.truth), "50 of 200 scans are not in it")

    def test_a_program_that_fails_is_off(self):
        drive = types.SimpleNamespace(truth=self.truth, reach_m=None, gap_m=40.0, judge=judges.with_truth)
        result = types.SimpleNamespace(exit_status=4, problem="the pool is full", poses=None, rows=np.array([]), loops=[])
        self.assert_off(judges.judge(drive, np.arange(200), result), "the pool is full")

    def test_loops_within_the_straight_part_of_a_street_are_wrong_and_off(self):
        reference = street(length=860, visits=1)
        drive = types.SimpleNamespace(truth=reference, reach_m=None, gap_m=40.0, judge=judges.vlp16_street, revisit=(2, 801),
                                      revisit_reach=20, straight=(300, 480))

        def street_judged(closed):
            matches = [(a, b, p.between(reference[a], reference[b])) for a, b in closed]
            result = types.SimpleNamespace(exit_status=0, problem="", poses=reference, poses_without_loops=reference, rows=np.arange(860),
                                           loops=matches)
            return judges.judge(drive, np.arange(860), result)

        right = street_judged([(4, 805)])
        self.assertEqual((right.reasons, right.loops.right, right.loops.wrong, right.loops.missed), ([], 1, 0, 0))
        wrong = street_judged([(310, 340)])
        self.assert_off(wrong, "straight part")
        self.assertEqual((wrong.loops.right, wrong.loops.wrong, wrong.loops.missed), (0, 1, 1))
        json.dumps(wrong.figures)  # none of NumPy's own numbers


    def test_revisits_without_overlap_or_centimetres_apart_are_off(self):
        drive = types.SimpleNamespace(truth=self.truth, reach_m=5.0, gap_m=40.0, judge=judges.hannover1)

        def campus_judged(lost, revisits_m):
            groups = [{"name": name, "median_m": median_m, "without_overlap": lost, "pairs": 298}
                      for name, median_m in (("next", 0.02), ("five apart", 0.05), ("revisits", revisits_m))]
            result = types.SimpleNamespace(exit_status=0, problem="", poses=self.truth, rows=np.arange(200), loops=[],
                                           consistency=lambda: {"groups": groups})
            return judges.judge(drive, np.arange(200), result)

        self.assertEqual(campus_judged(0, 0.03).reasons, [])
        self.assert_off(campus_judged(1, 0.03), "1 of 298 pairs")
        self.assert_off(campus_judged(0, 0.061), "6.1 cm apart")
        self.assert_off(campus_judged(298, None), "298 of 298 pairs")


def row(is_off, verdict, name="a", wrong=0, has_to_be_right=False):
    return {"set": name, "family": name, "factor": "as-it-is", "drive": name, "change": "as it is", "is_off": is_off, "reasons": ["torn"] if is_off else [],
            "has_to_be_right": has_to_be_right, "text": "", "figures": {"error_m": 0.2, "limit_m": 0.3}, "verdict": verdict,
            "loops": {"right": 1, "wrong": wrong, "missed": 0, "visits": 1}, "median_ms": 1.0, "worst_ms": 2.0, "peer": None}


class Verdicts(unittest.TestCase):
    def test_a_map_that_is_off_is_not_to_be_called_good(self):
        self.assertEqual(table.problems([row(False, "good"), row(True, "bad"), row(True, "doubtful")]), [])
        self.assertEqual(len(table.problems([row(False, "good"), row(True, "good")])), 1)

    def test_most_of_the_right_ones_are_to_be_called_good(self):
        self.assertEqual(table.problems([row(False, "good")] * 9 + [row(False, "doubtful")]), [])
        self.assertEqual(len(table.problems([row(False, "good")] * 6 + [row(False, "doubtful")] * 4)), 1)

    def test_doubtful_for_everything_fails(self):
        self.assertEqual(len(table.problems([row(False, "doubtful"), row(True, "doubtful")])), 1)

    def test_a_program_without_verdicts_is_not_judged_by_them(self):
        self.assertEqual(table.problems([row(False, "-"), row(True, "-")]), [])

    def test_a_drive_that_has_to_be_right_is_asked_for_without_verdicts_too(self):
        self.assertEqual(table.problems([row(False, "-", has_to_be_right=True)]), [])
        self.assertEqual(len(table.problems([row(True, "-", has_to_be_right=True)])), 1)

    def test_every_row_of_the_table_has_as_many_cells(self):
        lines = [line for line in table.markdown([row(False, "good"), row(True, "bad")]).splitlines() if line.startswith("|")]
        self.assertEqual({line.count("|") for line in lines}, {9})


class LeaveOneOut(unittest.TestCase):
    def test_a_setting_that_is_only_good_where_it_was_chosen_is_not_chosen_by_the_rest(self):
        fitted = {("a", "x"): row(False, "-", "a"), ("b", "x"): row(True, "-", "b"), ("c", "x"): row(True, "-", "c")}
        steady = {("a", "x"): row(False, "-", "a", wrong=1), ("b", "x"): row(False, "-", "b"), ("c", "x"): row(False, "-", "c")}
        text = leave_one_out.table({"fitted": fitted, "steady": steady})
        self.assertIn("| a | steady | 0 of 1 off, 1 loops wrong", text)
        self.assertIn("All drives together choose steady", text)

    def test_drives_of_one_family_are_left_out_together(self):
        fitted = {(name, "x"): row(name == "c", "-", name) | {"family": "town" if name in "ab" else name} for name in "abc"}
        steady = {(name, "x"): row(name != "c", "-", name) | {"family": "town" if name in "ab" else name} for name in "abc"}
        text = leave_one_out.table({"fitted": fitted, "steady": steady})
        self.assertIn("| town | steady | 2 of 2 off", text)


if __name__ == "__main__":
    unittest.main()
