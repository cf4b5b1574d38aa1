#!/usr/bin/env python3
"""A lidar carried by hand through a site, with full 6D motion. The poses that come with the data are others' estimates, good to a few
centimetres: the map is compared with them. It must not start from them: as odometry it gets these poses made to drift, each step 5 %
longer and turned 0.5 deg to the left, which after 177 scans is metres and tens of degrees away. Without any odometry the map comes apart
(docs/benchmarks.md).
"""
import json
import math

from drive import Drive, Pose, check_run, check_same_map, closed_loops, main, product, read_tum, turned


def drifted(poses, turn_deg, scale):
    half = math.radians(turn_deg) / 2
    turn = [0, 0, math.sin(half), math.cos(half)]
    result = [poses[0]]
    for before, after in zip(poses, poses[1:]):
        step, last = before.from_other(after), result[-1]
        way = turned(last.q, [scale * part for part in step.t])
        result.append(Pose([a + b for a, b in zip(last.t, way)] + product(last.q, product(step.q, turn))))
    return result


def write_tum(file, poses):
    file.write_text("".join(f"{i} " + " ".join(f"{part:.12f}" for part in pose.t + pose.q) + "\n" for i, pose in enumerate(poses)))


def against(drive, trajectory, truth):
    return json.loads(drive.run("evaluate", trajectory, "--truth", truth, "--align", "first", "--json"))


def test(options, figures):
    drive = Drive(options, "hilti_balm")
    estimates = drive.work / "hilti_balm_estimates.tum"
    drive.run("convert", drive.scans / "alidarPose.csv", estimates)
    theirs = read_tum(estimates)
    odometry = drive.work / "hilti_balm_odometry.tum"
    write_tum(odometry, drifted(theirs, 0.5, 1.05))

    out, run = drive.map("hilti_balm_map", "--memory", "64MiB", "--odometry", odometry)
    check_run(figures, run, 177, 64)
    small_out, small_run = drive.map("hilti_balm_map_16MiB", "--memory", "16MiB", "--odometry", odometry,
                                     "--archive", drive.work / "hilti_balm.archive")
    check_run(figures, small_run, 177, 16)
    check_same_map(figures, out, small_out)

    print("beside the others' poses")
    start, report = against(drive, odometry, estimates), against(drive, out, estimates)
    figures.equal("poses compared", report["associated"], 177)
    figures.equal("the truth is not what the map started from", report["truth_was_odometry"], False)
    figures.at_least("the odometry's distance, mean", start["absolute"]["translation_m"]["mean"], 5, "m")
    figures.at_least("the odometry's angle, mean", start["absolute"]["rotation_deg"]["mean"], 40, "deg")
    figures.at_most("the map's distance, mean", report["absolute"]["translation_m"]["mean"], 0.15, "m")
    figures.at_most("the map's angle, mean", report["absolute"]["rotation_deg"]["mean"], 0.4, "deg")

    loops = closed_loops(run)
    figures.at_least("loops closed", len(loops), 5)
    ours = read_tum(out / "trajectory.tum")
    offsets = [(ours[first].from_other(ours[last]), theirs[first].from_other(theirs[last])) for first, last in loops]
    figures.at_most("the worst loop", max((a.distance_m(b) for a, b in offsets), default=None), 0.25, "m")
    figures.at_most("the worst loop", max((a.angle_deg(b) for a, b in offsets), default=None), 1.0, "deg")


main(__doc__, test)
