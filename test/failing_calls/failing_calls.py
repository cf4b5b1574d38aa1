#!/usr/bin/env python3
"""What the programs leave behind when a call fails, when they are killed, and when the power goes.

failing_calls.py calls BIN PRELOAD [RUNS]   each call fails once in each way, for every verb that writes; RUNS: a sample
failing_calls.py kills BIN PRELOAD [RUNS]   killed before a call, and at any time
failing_calls.py power BIN PRELOAD [CUTS]   power goes: unsynced writes are lost and reordered
failing_calls.py daemon BIN PRELOAD [RUNS]  alcesd's start, drive and stop on simulated wires, a call failing

BIN: the folder with alces, alcesd and alces-scanner-sim; PRELOAD: the library of preload.cpp. RUNS 0: all. Prints a table;
exit status 1, with a line each, where something is not as it should be:
  - no signal ends a program, and none hangs;
  - what was there before is there bit for bit, or the new one is, whole;
  - exit status 0 only with all of the new one; otherwise a sentence on standard error.
Where memory is refused to a library of others, it may abort: the files are whole all the same.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import power_cut

SEED = 1
LIMIT_S = 120  # of a run that takes tenths of a second
WORKERS = max(2, os.cpu_count() or 2)

HOWS = {
    'open': ['EIO', 'ENOSPC', 'EINTR', 'EMFILE'], 'read': ['EIO', 'EINTR', 'short'], 'fread': ['EIO'],
    'write': ['EIO', 'ENOSPC', 'EINTR', 'short'], 'fwrite': ['EIO', 'ENOSPC'], 'fsync': ['EIO', 'ENOSPC', 'EINTR'],
    'rename': ['EIO', 'ENOSPC', 'EXDEV', 'EINVAL'], 'mmap': ['ENOMEM'], 'malloc': ['ENOMEM'], 'socket': ['EIO', 'EINTR'],
    'poll': ['EIO', 'EINTR'], 'ioctl': ['EIO', 'EINTR'], 'close': ['EIO', 'ENOSPC', 'EINTR'],
    'ftruncate': ['EIO', 'ENOSPC', 'EINTR'], 'mkdir': ['EIO', 'ENOSPC'], 'unlink': ['EIO'], 'flock': ['EIO', 'EINTR'],
}


# ------------------------------------------------------------------------------------------ what is compared

def tree(path):
    """A file's bytes, or those of all files of a folder by their names; None: nothing is there."""
    if path.is_file():
        return path.read_bytes()
    if not path.is_dir():
        return None
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob('*')) if file.is_file()}


MEASURED = re.compile(r'"(median_ms|total_s|worst_ms|process_peak_bytes|mapping_s|read_wait_s|run_s|seconds|write_s)"')


def comparable(content):
    """Without what differs from run to run: the times that were measured, and where it happened."""
    if not isinstance(content, dict):
        return content
    out = dict(content)
    if 'run.json' in out:
        def strip(value):
            if isinstance(value, dict):
                return {key: strip(v) for key, v in value.items()
                        if not MEASURED.match(f'"{key}"') and key not in ('command_line', 'out', 'files', 'times', 'write')}
            if isinstance(value, str):
                return re.sub(r'/\S*/room\d+/', '', value)
            return [strip(v) for v in value] if isinstance(value, list) else value
        try:
            out['run.json'] = strip(json.loads(out['run.json']))
        except ValueError:
            pass
    if 'scans.csv' in out:
        lines = out['scans.csv'].decode(errors='replace').split('\n')
        measured = {i for i, name in enumerate(lines[0].split(',')) if name.endswith('_ms')}
        out['scans.csv'] = [[c for i, c in enumerate(line.split(',')) if i not in measured] for line in lines]
    return out


# ------------------------------------------------------------------------------------------ runs

class Scenario:
    """A verb with its inputs and with what was at its outputs before."""

    def __init__(self, name, arguments, outputs, share):
        self.name, self.arguments, self.outputs, self.share = name, arguments, outputs, share


class Bench:
    def __init__(self, programs, preload, folder):
        self.programs, self.preload, self.folder = pathlib.Path(programs).resolve(), pathlib.Path(preload).resolve(), folder
        self.pristine = folder / 'pristine'
        self.pristine.mkdir()
        self.numbers = iter(range(10**9))
        self.problems = []
        self.make_inputs()

    def alces(self, *arguments, cwd=None):
        done = subprocess.run([self.programs / 'alces', *arguments], cwd=cwd or self.pristine, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            sys.exit(f'alces {" ".join(arguments)}: {done.returncode}: {done.stderr}')

    def make_inputs(self):
        """Scans of a room, a drive of seconds; and an older result under each name that will be written."""
        for number in range(4):
            rows = []
            for i in range(60):
                t, up = i * 37 % 100 / 50 - 1, i * 53 % 100 / 2
                x, y, z = [(t * 300, up, 400), (300, up, t * 400), (t * 300, -80, t * i), (-300, up, t * 200)][i % 4]
                rows.append(f'{x:.1f} {y:.1f} {z - 40 * number:.1f}\n')
            for folder in ('scans', 'older')[:2 if number < 3 else 1]:
                (self.pristine / folder).mkdir(exist_ok=True)
                (self.pristine / folder / f'scan{number:03}.3d').write_text('60 x 1\n' + ''.join(rows))
                (self.pristine / folder / f'scan{number:03}.pose').write_text(f'0 0 {40 * number}\n0 0.5 0\n')
        self.alces('map', 'scans', '--out', 'map')
        for out in ('old_map', 'old_replay', 'old_optimize'):
            self.alces('map', 'older', '--out', out)
        self.alces('report', 'old_map', '--out', 'page.html')
        self.alces('convert', 'old_map', 'cloud.las')
        self.alces('convert', 'old_map', 'map.mcap')
        self.alces('simulate', '--scans', '1', '--standstill', '0', '--seed', '2', '--out', 'new.mcap')
        self.alces('convert', 'new.mcap', 'traces')
        self.alces('simulate', '--scans', '1', '--standstill', '0', '--out', 'drive.mcap')
        self.scenarios = [
            Scenario('map', ['map', 'scans', '--out', 'old_map'], ['old_map'], 5),
            Scenario('replay', ['replay', 'drive.mcap', '--out', 'old_replay'], ['old_replay'], 3),
            Scenario('optimize', ['optimize', 'map', '--out', 'old_optimize'], ['old_optimize'], 3),
            Scenario('report', ['report', 'map', '--out', 'page.html'], ['page.html'], 2),
            Scenario('convert to LAS', ['convert', 'map', 'cloud.las'], ['cloud.las'], 2),
            Scenario('convert to MCAP', ['convert', 'map', 'map.mcap'], ['map.mcap'], 2),
            Scenario('convert to traces', ['convert', 'drive.mcap', 'traces'], ['traces'], 3),
            Scenario('simulate', ['simulate', '--scans', '1', '--standstill', '0', '--out', 'new.mcap'],
                     ['new.mcap', 'new.truth.tum'], 1),
        ]

    def room(self):
        """A copy of the inputs and the older results, links where files are only read."""
        room = self.folder / f'room{next(self.numbers)}'
        shutil.copytree(self.pristine, room)
        return room

    def environment(self, **more):
        return dict(os.environ, LD_PRELOAD=str(self.preload), **more)

    def undisturbed(self, scenario):
        """Counts of its calls; and its older and new outputs."""
        room = self.room()
        old = [tree(room / output) for output in scenario.outputs]
        counts_file = self.folder / f'counts.{scenario.name.replace(" ", "_")}'
        done = subprocess.run([self.programs / 'alces', *scenario.arguments], cwd=room, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True, env=self.environment(ALCES_FAIL_COUNTS=str(counts_file)))
        if done.returncode != 0:
            sys.exit(f'{scenario.name}: {done.returncode}: {done.stderr}')
        new = [tree(room / output) for output in scenario.outputs]
        shutil.rmtree(room)
        if any(comparable(a) == comparable(b) for a, b in zip(old, new)):
            sys.exit(f'{scenario.name}: the older output is the new one, so that nothing could be told')
        counts = dict(line.split() for line in counts_file.read_text().split('\n') if line)
        return {call: int(count) for call, count in counts.items()}, old, [comparable(content) for content in new]

    def state(self, room, scenario, old, new):
        """old, new, or what is wrong; of several outputs each for itself."""
        found = []
        for output, before, after in zip(scenario.outputs, old, new):
            content = tree(room / output)
            found.append('new' if comparable(content) == after else 'old' if content == before else
                         f'{output} is gone' if content is None else f'{output} is a mix')
        for state in found:
            if state not in ('old', 'new'):
                return state
        return found[0] if len(set(found)) == 1 else 'one of each'

    def run(self, room, scenario, fail=None, kill_after_s=None):
        """Exit status (None: hung) and standard error."""
        process = subprocess.Popen([self.programs / 'alces', *scenario.arguments], cwd=room, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True, errors='replace',
                                   env=self.environment(**({'ALCES_FAIL': fail} if fail else {})))
        try:
            if kill_after_s is not None:
                try:
                    process.wait(kill_after_s)
                except subprocess.TimeoutExpired:
                    process.kill()
            _, errors = process.communicate(timeout=LIMIT_S)
            return process.returncode, errors
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return None, ''

    def complain(self, scenario, fail, what, errors=''):
        last = errors.strip().split('\n')[-1][:200]
        self.problems.append(f'{scenario}, {fail}: {what}' + (f' ({last})' if last else ''))

    def finish(self):
        for problem in self.problems:
            print(problem)
        return 1 if self.problems else 0


def spread(groups, budget):
    """As many of the lists' items as the budget has, evenly from each list; all where it is 0."""
    if budget == 0:
        return [item for group in groups for item in group]
    chosen = []
    dice = random.Random(SEED)
    shares = [min(len(group), max(1, budget // max(1, len(groups)))) for group in groups]
    for group, share in zip(groups, shares):
        step = len(group) / share  # somewhere in each part of the list
        chosen += [group[int((i + dice.random()) * step)] for i in range(share)]
    return dice.sample(chosen, min(len(chosen), budget))


# ------------------------------------------------------------------------------------------ failing calls

def check_call(bench, scenario, old, new, fail):
    room = bench.room()
    status, errors = bench.run(room, scenario, fail)
    state = bench.state(room, scenario, old, new)
    is_memory = fail.startswith('malloc') or fail.startswith('mmap')
    outcome = 'new' if status == 0 else 'named' if status is not None and status > 0 else 'aborted'
    if status is None:
        bench.complain(scenario.name, fail, 'hangs')
    elif status < 0 and not is_memory:
        bench.complain(scenario.name, fail, f'ends by signal {-status}', errors)
    elif state not in ('old', 'new', 'one of each'):
        bench.complain(scenario.name, fail, f'exit status {status}, and {state}', errors)
    elif status == 0 and state != 'new':
        bench.complain(scenario.name, fail, f'exit status 0, and the output is {state}', errors)
    elif status > 0 and not errors.strip() and not fail.startswith(('write', 'fwrite')):
        bench.complain(scenario.name, fail, f'exit status {status} without a word')
    elif status > 0 and 'a defect of' in errors and not is_memory:
        bench.complain(scenario.name, fail, 'is called a defect', errors)
    shutil.rmtree(room)
    return outcome


def calls(bench, budget):
    total = collections.Counter()
    shares = sum(scenario.share for scenario in bench.scenarios)
    for scenario in bench.scenarios:
        counts, old, new = bench.undisturbed(scenario)
        groups = [[f'{call}:{number}:{how}' for number in range(1, counts.get(call, 0) + 1)]
                  for call, hows in HOWS.items() for how in hows if counts.get(call, 0) > 0]
        chosen = spread(groups, 0 if budget == 0 else max(1, budget * scenario.share // shares))
        with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
            outcomes = collections.Counter(
                pool.map(lambda fail: check_call(bench, scenario, old, new, fail), chosen))
        total += outcomes
        print(f'{scenario.name:20} {len(chosen):6} runs of {sum(map(len, groups)):6}: {outcomes["new"]} done all the same, '
              f'{outcomes["named"]} refused with a sentence, {outcomes["aborted"]} ended by others for want of memory',
              flush=True)
    print(f'{"all":20} {sum(total.values()):6} runs')


# ------------------------------------------------------------------------------------------ kills

def check_kill(bench, scenario, old, new, fail, kill_after_s):
    room = bench.room()
    status, errors = bench.run(room, scenario, fail, kill_after_s)
    what = fail or f'killed after {kill_after_s:.3f} s'
    state = bench.state(room, scenario, old, new)
    if state not in ('old', 'new', 'one of each'):
        bench.complain(scenario.name, what, state)
    if status == 0 and state != 'new':
        bench.complain(scenario.name, what, f'exit status 0, and the output is {state}')
    status, errors = bench.run(room, scenario)
    if status != 0 or bench.state(room, scenario, old, new) != 'new':
        bench.complain(scenario.name, what, f'the next run does not mend it: exit status {status}', errors)
    shutil.rmtree(room)
    return state


def kills(bench, budget):
    dice = random.Random(SEED)
    shares = sum(scenario.share for scenario in bench.scenarios)
    for scenario in bench.scenarios:
        counts, old, new = bench.undisturbed(scenario)
        room = bench.room()
        begin = time.monotonic()
        bench.run(room, scenario)
        duration_s = time.monotonic() - begin
        shutil.rmtree(room)
        by_call = [f'any:{number}:kill' for number in range(1, counts['any'] + 1)]
        if budget != 0:
            share = max(2, budget * scenario.share // shares)
            by_call = dice.sample(by_call, min(len(by_call), (share + 1) // 2))
        by_time = [dice.uniform(0, 1.1 * duration_s) for _ in range(100 if budget == 0 else max(1, share // 2))]
        jobs = [(fail, None) for fail in by_call] + [(None, after_s) for after_s in by_time]
        with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
            states = collections.Counter(pool.map(lambda job: check_kill(bench, scenario, old, new, *job), jobs))
        print(f'{scenario.name:20} {len(jobs):6} kills: {states["old"]} times the old one, {states["new"]} the new one, '
              f'{states["one of each"]} one of each', flush=True)


# ------------------------------------------------------------------------------------------ power cuts

def power(bench, budget):
    for scenario in bench.scenarios:
        if scenario.name == 'report':
            continue  # one file, written as those of convert
        _, old, new = bench.undisturbed(scenario)
        room = bench.room()
        disk = power_cut.Disk(room)
        log = bench.folder / 'write.log'
        log.unlink(missing_ok=True)
        process = subprocess.run([bench.programs / 'alces', *scenario.arguments], cwd=room, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL, env=bench.environment(ALCES_WRITE_LOG=str(log)))
        disk.take(log.read_text())
        for output in scenario.outputs:
            if disk.everything(room / output) != tree(room / output):
                bench.complain(scenario.name, 'power', f'the log of writes is not all that happened to {output}')
        states = collections.Counter()
        dice = random.Random(SEED)
        count = budget or 2000
        for _ in range(count):
            seen = disk.after_a_cut(dice)
            found = []
            for output, before, after in zip(scenario.outputs, old, new):
                content = seen(room / output)
                found.append('old' if content == before else 'new' if comparable(content) == after else
                             'gone' if content is None else 'a mix')
            states['/'.join(sorted(set(found)))] += 1
        for state, times in states.items():
            if state not in ('old', 'new', 'new/old'):
                bench.complain(scenario.name, f'power cut, {times} of {count}', f'the output is {state}')
        print(f'{scenario.name:20} {count:6} power cuts: ' + ', '.join(f'{times} times {state}' for state, times in
                                                                      sorted(states.items())), flush=True)
        shutil.rmtree(room)
        if process.returncode != 0:
            bench.complain(scenario.name, 'power', f'exit status {process.returncode}')


# ------------------------------------------------------------------------------------------ alcesd

class Daemon:
    """A vehicle on simulated wires in a folder of its own: CAN by Unix sockets, lines by pseudo terminals."""

    def __init__(self, bench):
        self.bench = bench
        text = subprocess.run([bench.programs / 'alces', 'simulate', '--print-config'], stdout=subprocess.PIPE, text=True,
                              check=True).stdout
        for key, value in {'lines': '[]', 'index_line': '-1', 'lasers': '1', 'turn_deg': '360', 'expected_profiles': '90',
                           'minimum_profiles': '40', 'memory': '"24MiB"', 'recording_reserve': '"0"',
                           'field_of_view_deg': '100', 'rays_per_profile': '101', 'target_velocity_units': '3000',
                           'expected_speed_deg_s': '300'}.items():
            text, times = re.subn(rf'^{key} = [^#\n]*', f'{key} = {value} ', text, flags=re.M)
            if times == 0:
                sys.exit(f'the configuration has no {key}')
        self.text = text

    def recording_after_cuts(self, disk, room, log, count):
        """What a power cut leaves of a recording: nothing yet, or a file that can be read. "", or what is wrong."""
        recording = room / 'drive.mcap'
        disk.take(log)
        if disk.everything(recording) != recording.read_bytes():
            return 'the log of writes is not all that happened to the recording'
        states = collections.Counter()
        dice = random.Random(SEED)
        for _ in range(count):
            content = disk.after_a_cut(dice)(recording)
            if not content or not content.startswith(b'\x89MCAP0\r\n'):
                states['nothing'] += 1  # the first bytes had not been synced
                continue
            (room / 'cut.mcap').write_bytes(content)
            info = subprocess.run([self.bench.programs / 'alces', 'info', room / 'cut.mcap'], stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)
            if info.returncode != 0:
                return f'a recording cannot be read after a power cut: {info.stdout[-200:]}'
            states['whole' if 'is whole: true' in info.stdout else 'a beginning'] += 1
        print(f'alcesd               {count:6} power cuts: its recording is ' +
              ', '.join(f'{times} times {state}' for state, times in sorted(states.items())), flush=True)
        return ''

    def drive(self, fail=None, kill=False, cuts=0):
        """Starts the vehicle and alcesd, stops alcesd once it scans, and says what came of it."""
        with tempfile.TemporaryDirectory(dir=self.bench.folder) as name:
            room = pathlib.Path(name)
            config = room / 'vehicle.toml'
            config.write_text(self.text.replace('/dev/ttyUSB', str(room / 'line')))
            wires = {'ALCES_CAN_WIRE': str(room), 'RUNTIME_DIRECTORY': str(room)}
            simulator = subprocess.Popen([self.bench.programs / 'alces-scanner-sim', '--config', config, '--scans', '40',
                                          '--standstill', '1'], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                         env=self.bench.environment(**wires))
            try:
                simulator.stdout.readline()  # the wires are there
                more = {'ALCES_FAIL': fail} if fail else {'ALCES_FAIL_COUNTS': str(room / 'counts')}
                if cuts:
                    disk = power_cut.Disk(room)
                    more['ALCES_WRITE_LOG'] = str(room / 'write.log')
                log = (room / 'alcesd.log').open('w')
                alcesd = subprocess.Popen([self.bench.programs / 'alcesd', '--config', config, '--record', room / 'drive.mcap'],
                                          stdout=log, stderr=log, env=self.bench.environment(**wires, **more))
                begin = time.monotonic()
                while alcesd.poll() is None and time.monotonic() - begin < 40:
                    if (room / 'alcesd.log').read_text(errors='replace').find('scanner: scanning') >= 0:
                        break
                    time.sleep(0.1)
                alcesd.send_signal(signal.SIGKILL if kill else signal.SIGTERM) if alcesd.poll() is None else None
                try:
                    alcesd.wait(100)
                except subprocess.TimeoutExpired:
                    alcesd.kill()
                    alcesd.wait()
                    return None, '', 'hangs', {}
            finally:
                simulator.send_signal(signal.SIGTERM)
                said, _ = simulator.communicate()
            output = (room / 'alcesd.log').read_text(errors='replace')
            counts = {}
            if (room / 'counts').exists():
                counts = {line.split()[0]: int(line.split()[1]) for line in (room / 'counts').read_text().split('\n') if line}
            what = ''
            stands = 'head: 0.00 rpm' in said and 'operation enabled' not in said
            recording = room / 'drive.mcap'
            whole = readable = False
            if recording.exists():
                info = subprocess.run([self.bench.programs / 'alces', 'info', recording], stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True)
                whole, readable = 'is whole: true' in info.stdout, info.returncode == 0
            if alcesd.returncode == 0 and not stands:
                what = 'exit status 0, and the head turns: ' + said.strip().replace('\n', ' ')[:200]
            elif alcesd.returncode == 0 and not whole:
                what = 'exit status 0, and the recording is not whole'
            elif recording.exists() and recording.stat().st_size > 100_000 and not readable:
                what = 'the recording cannot be read'
            elif not kill and alcesd.returncode < 0 and not (fail or '').startswith(('malloc', 'mmap')):
                what = f'ends by signal {-alcesd.returncode}'
            elif alcesd.returncode > 0 and not output.strip():
                what = f'exit status {alcesd.returncode} without a word'
            # 6: on a machine that is too busy the drive may not confirm in time
            if cuts and not what:
                what = self.recording_after_cuts(disk, room, (room / 'write.log').read_text(), cuts)
            if not fail and not kill and alcesd.returncode not in (0, 6):
                what = what or f'undisturbed: exit status {alcesd.returncode}: ' + output[-500:]
            return alcesd.returncode, output, what, counts


def daemon(bench, budget):
    vehicle = Daemon(bench)
    status, _, what, counts = vehicle.drive(cuts=500 if budget == 0 else 20)
    if what:
        bench.complain('alcesd', 'nothing fails', what)
        return
    print(f'alcesd               undisturbed: exit status {status}; ' +
          ', '.join(f'{call} {count}' for call, count in counts.items() if count > 0))
    # What is called thousands of times a second is the same call over and over: of these, spread over the drive.
    groups = []
    for call, hows in HOWS.items():
        count = counts.get(call, 0)
        numbers = list(range(1, count + 1)) if count <= 200 else \
            sorted(set(range(1, 101)) | {100 + (count - 100) * i // 100 for i in range(1, 100)})
        groups += [[f'{call}:{number}:{how}' for number in numbers] for how in hows if numbers]
    chosen = spread(groups, budget)
    jobs = [(fail, False) for fail in chosen] + [(None, True)] * (1 if budget else 20)

    def one(job):
        status, output, what, _ = vehicle.drive(*job)
        if what:
            bench.complain('alcesd', job[0] or 'killed', what, output)
        return 'hung' if status is None else 'by signal' if status < 0 else f'exit status {status}'
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        outcomes = collections.Counter(pool.map(one, jobs))
    print(f'alcesd               {len(jobs):6} runs of {sum(map(len, groups))}: ' +
          ', '.join(f'{times} {outcome}' for outcome, times in sorted(outcomes.items())), flush=True)


def main():
    what, programs, preload = sys.argv[1:4]
    budget = int(sys.argv[4]) if len(sys.argv) > 4 else 0
    with tempfile.TemporaryDirectory(prefix='alces_failing_calls.') as folder:
        bench = Bench(programs, preload, pathlib.Path(folder))
        {'calls': calls, 'kills': kills, 'power': power, 'daemon': daemon}[what](bench, budget)
        sys.exit(bench.finish())


main()
