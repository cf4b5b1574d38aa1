#!/usr/bin/env python3
"""live_wires.py BIN PRELOAD LIBRARY EXAMPLES: alcesd and a simulated vehicle, each its own process, on simulated wires in
real time; this process reads the page. alcesd is stopped for a second, killed in mid-drive, started again, and ended.

BIN: the folder with alces, alcesd and alces-scanner-sim; PRELOAD: failing_calls' library, which makes CAN of Unix sockets."""
import importlib.util
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

OK, STALE, ENDED, NO_PAGE, NOT_YET = 0, 1, 2, -1, -6
ODOM_FROM_BODY, MAP_FROM_ODOM, MAP_FROM_BODY = 0, 1, 2
SECOND = 10**9


def load_example(folder):
    spec = importlib.util.spec_from_file_location('follow', pathlib.Path(folder) / 'follow.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def configuration(programs, room):
    """One laser of 101 rays on a head that turns once a scan; the drive tells the angle: no GPIO line."""
    text = subprocess.run([programs / 'alces', 'simulate', '--print-config'], stdout=subprocess.PIPE, text=True, check=True).stdout
    for key, value in {'lines': '[]', 'index_line': '-1', 'lasers': '1', 'turn_deg': '360', 'expected_profiles': '90',
                       'minimum_profiles': '40', 'memory': '"24MiB"', 'field_of_view_deg': '100', 'rays_per_profile': '101',
                       'target_velocity_units': '3000', 'expected_speed_deg_s': '300', 'path': f'"{room}/page"'}.items():
        text, times = re.subn(rf'^{key} = [^#\n]*', f'{key} = {value} ', text, flags=re.M)
        if times == 0:
            sys.exit(f'the configuration has no {key}')
    return text.replace('/dev/ttyUSB', f'{room}/line')


class Wires:
    def __init__(self, programs, preload, room):
        self.programs, self.room = programs, room
        self.environment = dict(os.environ, LD_PRELOAD=str(preload), ALCES_CAN_WIRE=str(room), RUNTIME_DIRECTORY=str(room))
        (room / 'vehicle.toml').write_text(configuration(programs, room))
        self.processes = []

    def start(self, program, *options, **pipes):
        process = subprocess.Popen([self.programs / program, '--config', self.room / 'vehicle.toml', *options],
                                   env=self.environment, text=True, **pipes)
        self.processes.append(process)
        return process

    def start_alcesd(self):
        return self.start('alcesd', stdout=subprocess.DEVNULL, stderr=(self.room / 'alcesd.log').open('w'))

    def start_simulator(self):
        simulator = self.start('alces-scanner-sim', '--scans', '40', '--standstill', '8', '--seed', '2', stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL)
        simulator.stdout.readline()  # the wires are there
        return simulator

    def end(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.kill()
                process.wait()


class Reader:
    def __init__(self, example, page):
        self.library, self.pose = example.load(), example.Pose()
        self.client = self.library.alces_client_open(os.fsencode(page))

    def latest(self, transform):
        return self.library.alces_client_latest(self.client, transform, self.pose)

    def wait(self, transform, result, seconds=60):
        end = time.monotonic() + seconds
        while (got := self.latest(transform)) != result:
            if time.monotonic() > end:
                sys.exit(f'transform {transform} is {self.library.alces_client_text(got).decode()!r}, not '
                         f'{self.library.alces_client_text(result).decode()!r}')
            time.sleep(0.005)


def expect(holds, what):
    print(('ok: ' if holds else 'FAILED: ') + what, flush=True)
    if not holds:
        sys.exit(1)


def watch_odometry(reader, seconds):
    """Rate of publication, and the worst that a pose lies from the one before beyond what the speed explains."""
    reader.wait(ODOM_FROM_BODY, OK)
    first = last = (reader.pose.sequence, reader.pose.stamp_ns, list(reader.pose.position_m), reader.pose.velocity[0])
    worst_m, oldest_ns, way_m = 0.0, 0, 0.0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if reader.latest(ODOM_FROM_BODY) == OK and reader.pose.sequence != last[0]:
            now = (reader.pose.sequence, reader.pose.stamp_ns, list(reader.pose.position_m), reader.pose.velocity[0])
            step_m = sum((a - b)**2 for a, b in zip(now[2], last[2]))**0.5
            duration_s = (now[1] - last[1]) * 1e-9
            if duration_s < 0.1:
                worst_m = max(worst_m, step_m - max(abs(now[3]), abs(last[3])) * duration_s)
            oldest_ns, way_m, last = max(oldest_ns, reader.pose.age_ns), way_m + step_m, now
        time.sleep(0.002)
    return (last[0] - first[0]) / ((last[1] - first[1]) * 1e-9), worst_m, oldest_ns * 1e-9, way_m


def main():
    programs, preload, library, examples = sys.argv[1:]
    os.environ['ALCES_CLIENT_LIBRARY'] = library
    with tempfile.TemporaryDirectory(dir='/dev/shm', prefix='alces_live_') as name:
        room = pathlib.Path(name)
        wires = Wires(pathlib.Path(programs).resolve(), pathlib.Path(preload).resolve(), room)
        reader = Reader(load_example(examples), room / 'page')
        try:
            run(wires, reader)
        finally:
            wires.end()


def run(wires, reader):
    expect(reader.latest(MAP_FROM_BODY) == NO_PAGE, 'there is no page before alcesd')
    simulator = wires.start_simulator()
    alcesd = wires.start_alcesd()
    reader.wait(ODOM_FROM_BODY, OK)
    before = reader.pose.start_id
    reader.wait(MAP_FROM_BODY, OK)
    expect(reader.pose.map_sequence > 0, 'odometry carries the first scans on')
    simulator.stdout.readline()  # it rolls
    rate, worst_m, oldest_s, way_m = watch_odometry(reader, 8)
    expect(way_m > 3, f'the vehicle drives: {way_m:.1f} m')
    expect(rate >= 50, f'odom -> body comes {rate:.0f} times a second')
    expect(worst_m < 0.01, f'and never jumps: {worst_m * 1000:.1f} mm at most')
    print(f'the oldest was {oldest_s * 1000:.0f} ms old')
    expect(reader.latest(MAP_FROM_ODOM) == OK and reader.pose.sequence >= 5, 'map -> odom comes after each scan')
    alcesd.send_signal(signal.SIGSTOP)
    reader.wait(ODOM_FROM_BODY, STALE, 5)
    expect(reader.pose.age_ns > SECOND // 2, 'a page that stands still is stale')
    alcesd.send_signal(signal.SIGCONT)
    reader.wait(ODOM_FROM_BODY, OK, 20)
    second = wires.start('alcesd', stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = second.communicate(timeout=20)[1]
    expect(second.returncode == 5 and 'another alcesd writes this page' in said, 'a second alcesd is refused the page')
    lines = re.findall(r'poses ([0-9.]+) s late, worst ([0-9.]+)', (wires.room / 'alcesd.log').read_text())
    expect(bool(lines), f'the status line says how late poses are: {lines[-1:]}')
    alcesd.kill()
    alcesd.wait()
    reader.wait(MAP_FROM_BODY, STALE, 5)
    expect(reader.pose.start_id == before, 'a killed alcesd leaves an old page')
    simulator.kill()
    simulator.wait()
    for socket in filter(pathlib.Path.is_socket, wires.room.iterdir()):
        socket.unlink()
    wires.start_simulator()
    alcesd = wires.start_alcesd()
    reader.wait(ODOM_FROM_BODY, OK)
    expect(reader.pose.start_id != before, 'the reader follows the next start by itself')
    time.sleep(1)
    alcesd.send_signal(signal.SIGTERM)
    alcesd.wait(100)
    expect(reader.latest(ODOM_FROM_BODY) == ENDED, 'and is told of the end')


if __name__ == '__main__':
    main()
