#!/usr/bin/env python3
"""A lidar carried by hand through a site, with full 6D motion. The poses that come with the data are estimates too, good to a few
centimetres: the map is compared with them.
"""
import json

from drive import Drive, check_run, check_same_map, closed_loops, main, read_tum


def test(options, figures):
    drive = Drive(options, "hilti_balm")
    out, run = drive.map("hilti_balm_map", "--memory", "64MiB")
    check_run(figures, run, 177, 64)
    small_out, small_run = drive.map("hilti_balm_map_16MiB", "--memory", "16MiB", "--archive", drive.work / "hilti_balm.archive")
    check_run(figures, small_run, 177, 16)
    check_same_map(figures, out, small_out)

    print("beside the others' poses")
    estimates = drive.scans / "alidarPose.csv"
    report = json.loads(drive.run("evaluate", out, "--truth", estimates, "--align", "first", "--json"))
    figures.equal("poses compared", report["associated"], 177)
    figures.at_most("distance, mean", report["absolute"]["translation_m"]["mean"], 0.15, "m")

    loops = closed_loops(run)
    figures.at_least("loops closed", len(loops), 15)
    drive.run("convert", estimates, drive.work / "hilti_balm_estimates.tum")
    ours, theirs = read_tum(out / "trajectory.tum"), read_tum(drive.work / "hilti_balm_estimates.tum")
    offsets = [(ours[first].from_other(ours[last]), theirs[first].from_other(theirs[last])) for first, last in loops]
    figures.at_most("the worst loop", max((a.distance_m(b) for a, b in offsets), default=None), 0.25, "m")
    figures.at_most("the worst loop", max((a.angle_deg(b) for a, b in offsets), default=None), 1.0, "deg")


main(__doc__, test)
