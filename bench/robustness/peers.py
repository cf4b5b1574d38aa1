"""PCL's GICP from scan to scan on the same folder of scans, without loops: bench_pcl_drive."""
import re
import subprocess

import numpy as np

import factors as f
import judges
import poses as p


def gicp(program, drive, factor, variant, place):
    """None where the drive has no truth to measure it by."""
    if drive.judge is not judges.with_truth:
        return None
    folder = place.work / "peers" / f"v{f.VERSION}" / drive.name
    folder.mkdir(parents=True, exist_ok=True)
    trajectory, said = folder / f"{factor.name}.tum", folder / f"{factor.name}.txt"
    if not said.exists():
        unfinished = folder / f"{factor.name}.unfinished.tum"
        ended = subprocess.run([program, "--method", "gicp", "--folder", variant.folder, "--out", unfinished], capture_output=True, text=True,
                               check=True)
        unfinished.rename(trajectory)
        said.write_text(ended.stdout)
    rows, poses = p.read_tum(trajectory)
    truth = drive.truth[variant.rows][rows.astype(int)]
    error = p.distance_m(truth[0] @ p.inverse(poses[0]) @ poses, truth)
    times = re.search(r"median ([\d.]+), mean [\d.]+, worst ([\d.]+)", said.read_text())
    return {"error_m": float(error.mean()), "worst_m": float(np.max(error)), "median_ms": float(times[1]), "worst_ms": float(times[2]),
            "text": f"{error.mean():.2f} m, {float(times[1]):.0f} ms"}
