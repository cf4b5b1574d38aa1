#!/usr/bin/env python3
"""Where the vehicle is, ten times a second, and each loop: libalces-client by ctypes. follow.py [PAGE [TIMES]]"""
import ctypes
import itertools
import os
import sys
import time

OK, NO_EVENT, EVENTS_LOST, RESTARTED = 0, -9, -10, -11
MAP_FROM_BODY = 2


class Pose(ctypes.Structure):  # alces_pose
    _fields_ = [("start_id", ctypes.c_uint64), ("sequence", ctypes.c_uint64), ("map_sequence", ctypes.c_uint64),
                ("stamp_ns", ctypes.c_int64), ("map_stamp_ns", ctypes.c_int64), ("age_ns", ctypes.c_int64),
                ("position_m", ctypes.c_double * 3), ("orientation_xyzw", ctypes.c_double * 4),
                ("covariance", ctypes.c_double * 36), ("velocity", ctypes.c_double * 6),
                ("is_extrapolated", ctypes.c_int32), ("is_of_scan", ctypes.c_int32)]


class Event(ctypes.Structure):  # alces_event
    _fields_ = [("start_id", ctypes.c_uint64), ("sequence", ctypes.c_uint64), ("stamp_ns", ctypes.c_int64),
                ("published_ns", ctypes.c_int64), ("distance_m", ctypes.c_double), ("correction_m", ctypes.c_double),
                ("correction_rad", ctypes.c_double), ("is_closed", ctypes.c_int32), ("first_scan", ctypes.c_uint32),
                ("last_scan", ctypes.c_uint32), ("reserved", ctypes.c_int32), ("verdict", ctypes.c_char * 64)]


def load():
    library = ctypes.CDLL(os.environ.get("ALCES_CLIENT_LIBRARY", "libalces-client.so.0"))
    library.alces_client_open.restype = ctypes.c_void_p
    library.alces_client_open.argtypes = [ctypes.c_char_p]
    library.alces_client_close.argtypes = [ctypes.c_void_p]
    library.alces_client_latest.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(Pose)]
    library.alces_client_next_event.argtypes = [ctypes.c_void_p, ctypes.POINTER(Event)]
    library.alces_client_text.restype = ctypes.c_char_p
    return library


def main():
    library = load()
    text = lambda result: library.alces_client_text(result).decode()
    client = library.alces_client_open(os.fsencode(sys.argv[1]) if len(sys.argv) > 1 else None)
    if not client:
        sys.exit("no memory")
    pose, event = Pose(), Event()
    for _ in range(int(sys.argv[2])) if len(sys.argv) > 2 else itertools.count():
        while (result := library.alces_client_next_event(client, event)) in (OK, EVENTS_LOST, RESTARTED):
            print(f"loop {event.first_scan}-{event.last_scan} {event.verdict.decode()}, moved {event.correction_m:.2f} m"
                  if result == OK else text(result))
        result = library.alces_client_latest(client, MAP_FROM_BODY, pose)
        if result < 0:
            print(f"no pose: {text(result)}", flush=True)
        else:
            x, y, z = pose.position_m
            sigma_m = (pose.covariance[0] + pose.covariance[7]) ** 0.5
            old = "" if result == OK else f": {text(result)}"
            print(f"{x:8.2f} {y:8.2f} {z:8.2f} m, +-{sigma_m:.2f} m, {pose.age_ns * 1e-9:.3f} s old{old}", flush=True)
        time.sleep(0.1)
    library.alces_client_close(client)


if __name__ == "__main__":
    main()
