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
    """Name of the setting -> (set, factor) -> row."""
    settings = {}
    for file in map(Path, files):
        settings[file.stem] = {(row["set"], row["factor"]): row for row in json.loads(file.read_text())["rows"]}
    return settings


def table(settings):
    """Markdown. Only what every setting was run on counts. Drives of one family are left out together, and every family counts the same,
    however many runs it has.
    """
    common = sorted(set.intersection(*(set(rows) for rows in settings.values())))
    family_of = {key: row["family"] for rows in settings.values() for key, row in rows.items()}
    families = sorted({family_of[key] for key in common})
    rows_of = {(name, family): [rows[key] for key in common if family_of[key] == family]
               for name, rows in settings.items() for family in families}
    cost = {key: float(np.mean([badness(row) for row in rows])) for key, rows in rows_of.items()}

    def mean_cost(name, over):
        return float(np.mean([cost[name, family] for family in over])) if over else 0.0

    def given(name, family):
        rows = rows_of[name, family]
        wrong = sum((row["loops"] or {}).get("wrong", 0) for row in rows)
        return f"{sum(row['is_off'] for row in rows)} of {len(rows)} off, {wrong} loops wrong ({cost[name, family]:.3f})"

    lines = [f"{len(settings)} settings, {len(common)} runs that all have.", "",
             "| left out | the others choose | which gives there | best there | which gives |", "|---|---|---|---|---|"]
    for left_out in families:
        rest = [family for family in families if family != left_out]
        chosen = min(settings, key=lambda name: mean_cost(name, rest))
        best = min(settings, key=lambda name: cost[name, left_out])
        lines.append(f"| {left_out} | {chosen} | {given(chosen, left_out)} | {best} | {given(best, left_out)} |")
    overall = min(settings, key=lambda name: mean_cost(name, families))
    lines += ["", f"All drives together choose {overall} ({mean_cost(overall, families):.3f}).", "",
              "| setting | " + " | ".join(families) + " | all |", "|---|" + "---|" * (len(families) + 1)]
    for name in settings:
        costs = [cost[name, family] for family in families] + [mean_cost(name, families)]
        lines.append(f"| {name} | " + " | ".join(f"{value:.3f}" for value in costs) + " |")
    return "\n".join(lines) + "\n"
