"""Which of several settings the other drives would choose for a drive, and what it gives there: a setting that is only good where it was
chosen is seen.
"""
import json
from pathlib import Path

import numpy as np


def badness(row):
    """Of a map; smaller is better. A map that is off counts most, then wrong loops, then how much of its limit the error takes."""
    loops = row["loops"] or {}
    return 1.0 * row["is_off"] + 0.5 * min(1.0, loops.get("wrong", 0) / max(1, loops.get("right", 0) + loops.get("wrong", 0))) + \
        0.25 * loops.get("missed", 0) / max(1, loops.get("visits", 0)) + 0.1 * _share_of_limit(row["figures"])


def _share_of_limit(figures):
    """A monotonic measure between 0 and 1, of a figure that each kind of drive has."""
    for name, limit in (("error_m", figures.get("limit_m")), ("revisits_m", 0.06), ("revisit_off_m", 0.3)):
        if figures.get(name) is not None and limit:
            return figures[name] / (figures[name] + limit)
    return 1.0


def read(files):
    """Setting's name -> (set, factor) -> row."""
    settings = {}
    for file in map(Path, files):
        settings[file.stem] = {(row["set"], row["factor"]): row for row in json.loads(file.read_text())["rows"]}
    return settings


def table(settings):
    """Markdown. Only what every setting was run on counts; every drive counts the same, however many factors it has."""
    common = sorted(set.intersection(*(set(rows) for rows in settings.values())))
    drives = sorted({drive for drive, _ in common})
    cost = {name: {drive: np.mean([badness(rows[key]) for key in common if key[0] == drive]) for drive in drives}
            for name, rows in settings.items()}

    def off(name, drive):
        chosen = [settings[name][key] for key in common if key[0] == drive]
        wrong = sum((row["loops"] or {}).get("wrong", 0) for row in chosen)
        return f"{sum(row['is_off'] for row in chosen)} of {len(chosen)} off, {wrong} loops wrong"

    lines = [f"{len(settings)} settings, {len(common)} runs that all have.", "",
             "| left out | the others choose | which gives there | best there | which gives |", "|---|---|---|---|---|"]
    for left_out in drives:
        rest = [drive for drive in drives if drive != left_out]
        chosen = min(settings, key=lambda name: np.mean([cost[name][drive] for drive in rest]) if rest else 0)
        best = min(settings, key=lambda name: cost[name][left_out])
        lines.append(f"| {left_out} | {chosen} | {off(chosen, left_out)} ({cost[chosen][left_out]:.3f}) | {best} | "
                     f"{off(best, left_out)} ({cost[best][left_out]:.3f}) |")
    overall = min(settings, key=lambda name: np.mean(list(cost[name].values())))
    lines += ["", f"All drives together choose {overall} ({np.mean(list(cost[overall].values())):.3f}).", "",
              "| setting | " + " | ".join(drives) + " | all |", "|---|" + "---|" * (len(drives) + 1)]
    for name in settings:
        lines.append(f"| {name} | " + " | ".join(f"{cost[name][drive]:.3f}" for drive in drives) +
                     f" | {np.mean(list(cost[name].values())):.3f} |")
    return "\n".join(lines) + "\n"
