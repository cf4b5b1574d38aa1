"""The table: rows as JSON, as Markdown, and the sums below it."""
from dataclasses import asdict

import numpy as np

import factors as f

GOOD_SHARE = 0.9  # of the maps that are right, at least


def row(drive, factor, judgement, result, peer):
    loops = judgement.loops
    return {"set": drive.name, "family": drive.family, "factor": factor.name, "drive": drive.title, "change": factor.title, "is_off": bool(judgement.reasons),
            "has_to_be_right": drive.holds and factor == f.AS_IT_IS,
            "reasons": judgement.reasons, "text": judgement.text, "figures": judgement.figures,
            "loops": None if loops is None else asdict(loops), "verdict": result.verdict,
            "scans": len(result.scan_ms), "median_ms": float(np.median(result.scan_ms)) if result.scan_ms else None,
            "worst_ms": max(result.scan_ms) if result.scan_ms else None, "peer": peer}


def summary(rows):
    """Of maps that are off and of those that are right, how many are called what."""
    def counts(chosen):
        verdicts = [entry["verdict"] for entry in chosen]
        return {"maps": len(chosen), **{verdict: verdicts.count(verdict) for verdict in ("good", "doubtful", "bad", "-")}}
    off, right = counts([entry for entry in rows if entry["is_off"]]), counts([entry for entry in rows if not entry["is_off"]])
    return {"off": off, "right": right, "has_verdicts": any(entry["verdict"] != "-" for entry in rows)}


def problems(rows):
    """Maps that have to be right and are not, and what the verdicts promise and do not hold; sentences."""
    found, sums = [], summary(rows)
    for entry in rows:
        if entry["is_off"] and entry["has_to_be_right"] and entry["verdict"] not in ("doubtful", "bad"):
            found.append(f"{entry['drive']}, {entry['change']}: is off: {'; '.join(entry['reasons'])}")
    if not sums["has_verdicts"]:
        return found
    for entry in rows:
        if entry["is_off"] and entry["verdict"] == "good":
            found.append(f"{entry['drive']}, {entry['change']}: is called good, and is off: {'; '.join(entry['reasons'])}")
    right = sums["right"]
    if right["maps"] and right["good"] < GOOD_SHARE * right["maps"]:
        found.append(f"of {right['maps']} maps that are right only {right['good']} are called good")
    return found


def markdown(rows):
    has_peer = any(entry["peer"] for entry in rows)
    lines = ["| drive | what is changed | error or consistency | loops right / wrong / missed | is | verdict | ms a scan | worst scan |"
             + (" PCL's GICP |" if has_peer else ""), "|---|---|---|---|---|---|---|---|" + ("---|" if has_peer else "")]
    drive = None
    for entry in rows:
        loops = entry["loops"]
        counted = "-" if loops is None else f"{loops['right']} / {loops['wrong']} / {loops['missed']} of {loops['visits']}"
        times = [f"{entry[name]:.1f}" if entry[name] is not None else "-" for name in ("median_ms", "worst_ms")]
        cells = ["" if entry["drive"] == drive else entry["drive"], entry["change"], entry["text"], counted,
                 "off" if entry["is_off"] else "right", entry["verdict"], *times]
        if has_peer:
            cells.append((entry["peer"] or {}).get("text", ""))
        lines.append("| " + " | ".join(cells) + " |")
        drive = entry["drive"]
    return "\n".join(lines + ["", *summary_lines(rows)]) + "\n"


def summary_lines(rows):
    sums = summary(rows)
    off, right = sums["off"], sums["right"]
    wrong = sum(entry["loops"]["wrong"] for entry in rows if entry["loops"])
    lines = [f"{len(rows)} maps. {off['maps']} are off: {_called(off)} (good must be none). "
             f"{right['maps']} are right: {_called(right)} (good must be at least {GOOD_SHARE:.0%}).",
             f"Loops that are wrong: {wrong}."]
    if not sums["has_verdicts"]:
        lines[0] = f"{len(rows)} maps. {off['maps']} are off, {right['maps']} are right; the program gives no verdict."
    return lines


def _called(counts):
    if not counts["maps"]:
        return "none called anything"
    share = f"{counts['good'] / counts['maps']:.0%}"
    without = f", {counts['-']} without a verdict" if counts["-"] else ""
    return f"{counts['good']} called good ({share}), {counts['doubtful']} doubtful, {counts['bad']} bad{without}"
