#!/usr/bin/env python3
"""Time a scan, estimated: instructions (standard input, from instruction_counter) by clock and instructions a cycle."""
import re
import sys

BUDGET_S = 1.2  # half a turn of the head (paper, section 4)
# Name, clock in Hz, instructions a cycle. Assumptions, on the careful side: an in-order core waits for every load that misses
# its cache; what the paper's robot had issued up to three a cycle and rarely did.
PROCESSORS = (
    ("700 MHz, in order (the paper's class)", 700e6, 0.5),
    ("Cortex-A53, 1.2 GHz", 1.2e9, 0.7),
    ("Cortex-A72, 1.5 GHz", 1.5e9, 1.2),
)


def main():
    text = sys.stdin.read()
    match = re.search(r"(\d+) stretches, mean (\d+), largest (\d+)", text)
    if not match or int(match.group(1)) == 0:
        print("no instructions were counted", file=sys.stderr)
        return 1
    mean, largest = int(match.group(2)), int(match.group(3))
    print(f"\n{mean / 1e6:.0f} million instructions a scan, {largest / 1e6:.0f} million at most\n")
    print("| processor | instructions a cycle, assumed | a scan | of 1.2 s | the longest scan, or loop | of 1.2 s |")
    print("|---|--:|--:|--:|--:|--:|")
    for name, clock_hz, per_cycle in PROCESSORS:
        times = [count / clock_hz / per_cycle for count in (mean, largest)]
        shown = " | ".join(f"{t:.2f} s | {100 * t / BUDGET_S:.0f} %" for t in times)
        print(f"| {name} | {per_cycle} | {shown} |")
    return 0


sys.exit(main())
