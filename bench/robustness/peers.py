"""PCL's GICP from scan to scan on the same folder of scans, without loops: bench_pcl_drive. Judged as our maps are."""
import re
import subprocess

import factors as f
import judges
import maps
import poses as p


class GicpMap:
    """Has what a judge asks of maps.Map."""
    exit_status, problem, loops = 0, "", ()

    def __init__(self, folder, variant, place, pairs):
        self._folder, self._variant, self._place, self._pairs = folder, variant, place, pairs
        rows, self.poses = p.read_tum(folder / "trajectory.tum")
        self.rows, self.poses_without_loops = rows.astype(int), self.poses

    def consistency(self):
        return maps.consistency(self._folder / "trajectory.tum", self.rows, self._folder, self._variant, self._place, self._pairs)


def gicp(program, drive, factor, variant, place):
    folder = place.work / "peers" / f"v{f.VERSION}" / drive.name / factor.name
    said = folder / "said.txt"
    if not said.exists():
        folder.mkdir(parents=True, exist_ok=True)
        ended = subprocess.run([program, "--method", "gicp", "--folder", variant.folder, "--out", folder / "trajectory.tum"],
                               capture_output=True, text=True, check=True)
        said.write_text(ended.stdout)
    judgement = judges.judge(drive, variant.rows, GicpMap(folder, variant, place, drive.pairs))
    times = re.search(r"median ([\d.]+), mean [\d.]+, worst ([\d.]+)", said.read_text())
    is_off = bool(judgement.reasons)
    return {"figures": judgement.figures, "is_off": is_off, "reasons": judgement.reasons, "median_ms": float(times[1]),
            "worst_ms": float(times[2]), "text": f"{judgement.text}, {'off' if is_off else 'right'}, {float(times[1]):.0f} ms"}
