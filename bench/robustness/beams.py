"""Which beam of the scanner a point is of, found from the points alone: a number from 0 for each, neighbours beside each other.

A spinning lidar has a fixed number of lasers, each of which draws a ring (a cone of one elevation). A 2D laser on a turning head
draws one profile (a half plane) after the other.
"""
import numpy as np

BANDS = 64
HEAD_HEIGHT_M = 1.0  # of a turning laser over the body's origin, about: only jumps of its angle are looked for


def rings(points):
    """By the order of the file where it goes round ring by ring, by clusters of elevation where there are such, else 64 bands of
    elevation (a lidar of 64 lasers whose points were shuffled; its rings lie 0.4 deg apart and are 0.3 deg thick).
    """
    by_order = _rings_by_order(points)
    return by_order if by_order is not None else _rings_by_elevation(points)


def _elevation_deg(points):
    return np.degrees(np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])))


def _rings_by_order(points):
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    ring = np.concatenate([[0], np.cumsum(np.abs(np.diff(azimuth)) > np.pi)])
    if not 8 <= ring[-1] + 1 <= 130:
        return None
    # Column by column the azimuth crosses the seam in bursts; what lies between has all elevations.
    elevation = _elevation_deg(points)
    counts = np.bincount(ring)
    mean = np.bincount(ring, elevation) / counts
    return ring if np.median(np.abs(elevation - mean[ring])) < 0.5 else None


def _rings_by_elevation(points):
    elevation = _elevation_deg(points)
    bin_deg = 0.1
    counts, edges = np.histogram(elevation, np.arange(elevation.min() - 1, elevation.max() + 1, bin_deg))
    smooth = np.convolve(counts, [0.25, 0.5, 0.5, 0.5, 0.25], "same")
    is_peak = (smooth > np.roll(smooth, 1)) & (smooth >= np.roll(smooth, -1)) & (smooth > 0.1 * len(points) / 64)
    peaks = []  # centre, height
    for centre, height in zip(edges[:-1][is_peak] + bin_deg / 2, smooth[is_peak]):
        if not peaks or centre - peaks[-1][0] >= 0.6:
            peaks.append((centre, height))
        elif height > peaks[-1][1]:  # two tops of one ring
            peaks[-1] = (centre, height)
    centres = np.array([centre for centre, _ in peaks])
    if len(centres) >= 8:
        number = np.searchsorted((centres[1:] + centres[:-1]) / 2, elevation)
        is_near = np.abs(elevation - centres[number]) < 0.2 * np.median(np.diff(centres))
        if np.mean(is_near) > 0.8:  # 0.4 if there were no rings
            return number
    low, high = np.percentile(elevation, [0.1, 99.9])
    return np.clip(((elevation - low) / (high - low) * BANDS).astype(int), 0, BANDS - 1)


def profiles(points):
    """A profile begins where the laser's angle in its plane jumps back."""
    angle = np.degrees(np.arctan2(points[:, 2] - HEAD_HEIGHT_M, np.hypot(points[:, 0], points[:, 1])))
    change = np.diff(angle)
    back = np.median(np.sign(change)) * change < -15
    return np.concatenate([[0], np.cumsum(back)])
