#!/usr/bin/env python3
"""What the system test asks of recordings and traces on the host. Each prints one line; exit status 1: it is not so.

traces.py poses RECORDING OUT.tum             the final poses that alcesd recorded
traces.py compare A.tum B.tum LIMIT_M         are the same scans in both, and no farther apart?
traces.py frames EXPORTED CANDUMP SLACK       has candump seen what is in the recording, and when? Prints the clocks' offset
traces.py trim EXPORTED CANDUMP OUT           candump's part of the recorded time, in the recording's clock
traces.py edges EXPORTED GPIOMON              the same of gpiomon
traces.py same EXPORTED PLAYED                candump's view of what canplayer played
traces.py span EXPORTED                       first and last stamp, s
traces.py error EVALUATION LIMIT_M            is the mean error of `alces evaluate --json` below this?
"""
import collections
import json
import re
import statistics
import struct
import sys


def messages(file, topics):
    """(topic, data) of an MCAP file without compression, in the order of the file."""
    names = {}

    def walk(data):
        at = 0
        while at + 9 <= len(data):
            kind, size = data[at], struct.unpack_from('<Q', data, at + 1)[0]
            record = data[at + 9:at + 9 + size]
            at += 9 + size
            if len(record) < size:
                return
            if kind == 0x06:
                compression = struct.unpack_from('<I', record, 28)[0]
                yield from walk(record[28 + 4 + compression + 8:])
            elif kind == 0x04:
                channel, _, length = struct.unpack_from('<HHI', record)
                names[channel] = bytes(record[8:8 + length]).decode()
            elif kind == 0x05:
                topic = names.get(struct.unpack_from('<H', record)[0])
                if topic in topics:
                    yield topic, record[22:]

    with open(file, 'rb') as source:
        yield from walk(memoryview(source.read())[8:])


class Cdr:
    def __init__(self, data):
        self.data, self.at = data[4:], 0

    def take(self, form):
        size = struct.calcsize(form)
        self.at = (self.at + size - 1) // size * size
        value = struct.unpack_from('<' + form, self.data, self.at)[0]
        self.at += size
        return value

    def stamp_ns(self):  # and passes over the header's frame
        value = self.take('i') * 1_000_000_000 + self.take('I')
        length = self.take('I')
        self.at += length
        return value

    def pose(self):
        stamp = self.stamp_ns()
        return stamp, [self.take('d') for _ in range(7)]


def poses(recording, out):
    at = {}
    for topic, data in messages(recording, ('/alces/pose', '/alces/path')):
        cdr = Cdr(data)
        if topic == '/alces/pose':
            stamp, pose = cdr.pose()
            at[stamp] = pose
        else:
            cdr.stamp_ns()
            at.update(cdr.pose() for _ in range(cdr.take('I')))
    with open(out, 'w') as file:
        for stamp in sorted(at):
            file.write(f'{stamp / 1e9:.9f} ' + ' '.join(repr(value) for value in at[stamp]) + '\n')
    print(f'{len(at)} poses')
    return len(at) > 0


def read_tum(name):
    rows = [list(map(float, line.split())) for line in open(name) if line.strip() and not line.startswith('#')]
    return {round(row[0], 4): row[1:] for row in rows}


def compare(a_name, b_name, limit_m):
    a, b = read_tum(a_name), read_tum(b_name)
    # A scan's stamp is the time between two profiles: another clock's microseconds do not matter.
    partner = {stamp: min(b, key=lambda other: abs(other - stamp)) for stamp in a} if b else {}
    lost = [stamp for stamp in a if not b or abs(partner[stamp] - stamp) > 0.01]
    worst = max((sum((a[s][i] - b[partner[s]][i]) ** 2 for i in range(3)) ** 0.5 for s in a if s not in lost), default=0)
    print(f'{len(a)} and {len(b)} scans, {len(lost)} without a partner, at worst {worst * 1000:.3f} mm apart')
    return len(a) == len(b) and len(a) > 0 and not lost and worst <= float(limit_m)


def read_log(name):
    """[(stamp, frame)] of a candump log; a recording's directions are left out."""
    rows = []
    for line in open(name, errors='replace'):
        match = re.match(r'\((\d+\.\d+)\) \S+ (\S+)', line)
        if match:
            # Newer kernels set a flag that says no more than FD (CANFD_FDF), and a remote frame's length 0 is not written.
            text = re.sub(r'##([0-9A-F])', lambda flags: f'##{int(flags[1], 16) & 3:X}', match[2].upper())
            rows.append((float(match[1]), re.sub(r'R0$', 'R', text)))
    return rows


def is_response(frame):
    return frame.startswith('581#') and len(frame) == 20


def offset_s(exported, dumped):
    """From the recording's clock to candump's: by the drive's answers, which both have in one order."""
    a = [row for row in exported if is_response(row[1])]
    b = [row for row in dumped if is_response(row[1])]
    count = min(len(a), len(b), 20)
    if count < 5 or any(a[i][1] != b[i][1] for i in range(count)):
        sys.exit('the recording and candump have no answers of the drive in common')
    return statistics.median(b[i][0] - a[i][0] for i in range(count))


def frames(exported_name, dumped_name, slack):
    exported, dumped = read_log(exported_name), read_log(dumped_name)
    offset = offset_s(exported, dumped)
    first, last = exported[0][0] + offset - 0.001, exported[-1][0] + offset + 0.001
    inside = [row for row in dumped if first <= row[0] <= last]
    a, b = (collections.Counter(frame for _, frame in rows) for rows in (exported, inside))
    only_a, only_b = sum((a - b).values()), sum((b - a).values())
    # When: frames that occur once say it best.
    at = {frame: stamp for stamp, frame in inside if b[frame] == 1}
    late = sorted(abs(at[frame] - stamp - offset) for stamp, frame in exported if a[frame] == 1 and frame in at)
    typical = late[len(late) // 2] if late else 0
    print(f'{len(exported)} recorded, {len(inside)} dumped, {only_a} and {only_b} in one only; clocks {offset:.6f} s apart, '
          f'stamps differ by {typical * 1e6:.0f} us (half of them by less)')
    return only_a + only_b <= int(slack) and typical < 1e-3


def trim(exported_name, dumped_name, out):
    exported, dumped = read_log(exported_name), read_log(dumped_name)
    offset = offset_s(exported, dumped)
    # A little earlier than alcesd began: drivers that are replayed must have asked before the answers come.
    begin = exported[0][0] - 0.03
    with open(out, 'w') as file:
        kept = 0
        for line in open(dumped_name):
            match = re.match(r'\((\d+\.\d+)\)(.*)', line)
            stamp = float(match[1]) - offset
            if begin <= stamp <= exported[-1][0]:
                file.write(f'({stamp:017.6f}){match[2]}\n')
                kept += 1
    print(f'{kept} frames')
    return kept > 0


def edges(exported_name, gpiomon_name):
    def read(name):
        rows = []
        for line in open(name):
            stamp = re.search(r'(\d+\.\d{9})', line)
            if stamp:
                rows.append((float(stamp[1]), 'rising' in line.lower()))
        return rows
    exported, watched = read(exported_name), read(gpiomon_name)
    inside = [row for row in watched if exported and exported[0][0] - 0.01 <= row[0] <= exported[-1][0] + 0.01]
    same = [row[1] for row in exported] == [row[1] for row in inside]
    worst = max((abs(a[0] - b[0]) for a, b in zip(exported, inside)), default=0)
    print(f'{len(exported)} recorded, {len(inside)} watched, at worst {worst * 1e6:.0f} us apart')
    return same and len(exported) > 0 and worst < 0.002


def same(exported_name, played_name):
    exported, played = read_log(exported_name), read_log(played_name)
    a, b = [frame for _, frame in exported], [frame for _, frame in played]
    differ = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
    print(f'{len(a)} exported, {len(b)} played' + ('' if a == b else f', the first difference is in line {differ + 1}'))
    return a == b and len(a) > 0


def span(exported_name):
    rows = read_log(exported_name)
    print(f'{rows[0][0]:.3f} {rows[-1][0]:.3f}')
    return True


def error(evaluation, limit_m):
    translation = json.load(open(evaluation))['absolute']['translation_m']
    print(f'{translation["count"]} scans, translation error {translation["mean"]:.3f} m in the mean, {translation["max"]:.3f} m at worst')
    return translation['count'] > 0 and translation['mean'] < float(limit_m)


if __name__ == '__main__':
    task = {'poses': poses, 'compare': compare, 'frames': frames, 'trim': trim, 'edges': edges, 'same': same, 'span': span, 'error': error}
    sys.exit(0 if task[sys.argv[1]](*sys.argv[2:]) else 1)
