#!/usr/bin/env python3
"""Makes the first inputs of test/fuzz/corpus with the tree's own writers: make_corpora.py ALCES CORPUS

Small and valid, one or a few a target. What fuzzing found lies beside them and is left alone. Run again when a format or
the coding of an input (targets/devices.cpp, targets/mapping.cpp) changes.
"""
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

alces, corpus = sys.argv[1], pathlib.Path(sys.argv[2])


def run(*arguments):
    done = subprocess.run([alces, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f'alces {" ".join(map(str, arguments))}: {done.stdout}')


def seed(target, name, content):
    folder = corpus / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f'seed_{name}').write_bytes(content if isinstance(content, bytes) else content.encode())


def files(**contents):  # several files in one input: for_each_file in memory_file.h
    out = b''
    for name, content in contents.items():
        content = content if isinstance(content, bytes) else content.encode()
        out += b'== ' + name.replace('__', '.').encode() + b'\n' + content + (b'' if content.endswith(b'\n') else b'\n')
    return out


def joined(contents):
    return files(**contents)


# ------------------------------------------------------------------------------------------ clouds

def room(offset):
    """Corners and walls of a room, 60 points, cm of 3DTK's frame."""
    points = []
    for i in range(60):
        t = i * 37 % 100 / 50 - 1
        up = i * 53 % 100 / 2
        wall = [(t * 300, up, 400), (300, up, t * 400), (t * 300, -80, t * i), (-300, up, t * 200)][i % 4]
        points.append(tuple(round(c + o, 1) for c, o in zip(wall, (0, 0, -offset))))
    return points


def clouds(folder):
    scans = folder / 'scans'
    scans.mkdir()
    for number in range(3):
        offset = 40 * number
        (scans / f'scan{number:03}.3d').write_text(
            '60 x 1\n' + ''.join(f'{x} {y} {z}\n' for x, y, z in room(offset)))
        (scans / f'scan{number:03}.pose').write_text(f'0 0 {offset}\n0 0.5 0\n')
    one = (scans / 'scan000.3d').read_text()
    seed('uos', '3d', one)
    seed('uos', 'comment.3d', '# x y z r g b\n1.5 -2e1 nan 255 0 1\n\t3 4 5\r\n')
    for form in ('pcd', 'ply', 'las', 'csv', 'bin'):
        run('convert', scans / 'scan000.3d', folder / f'cloud.{form}')
        seed({'bin': 'kitti'}.get(form, form), form, (folder / f'cloud.{form}').read_bytes()[:2500])
    seed('pcd', 'ascii', 'VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n'
         'VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 255\nnan nan nan 0\n')
    numbers = struct.pack('<6f', 1, 4, 2, 5, 3, 6)
    packed = bytes([len(numbers) - 1]) + numbers  # LZF: one run of literals
    seed('pcd', 'compressed', b'VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n'
         b'DATA binary_compressed\n' + struct.pack('<II', len(packed), len(numbers)) + packed)
    seed('ply', 'ascii', 'ply\nformat ascii 1.0\ncomment x\nelement vertex 2\nproperty double x\nproperty float y\n'
         'property uchar z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n-1e3 5 255\n3 0 1 0\n')
    seed('pcd', 'channels', b'VERSION .7\nFIELDS x y z intensity t\nSIZE 4 4 4 4 4\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n'
         b'POINTS 2\nDATA binary\n' + struct.pack('<ffffIffffI', 1, 2, 3, 40, 0, 4, 5, 6, 90, 99_000_000))
    seed('csv', 'channels', 'x,y,z,Intensity,time [us]\n1,2,3,0.5,0\n4,5,6,1,99000\n')
    seed('deskew', 'poses', bytes([8 * 3]) + bytes([1, 2, 3] * 3) + bytes([0] + [9] * 40))
    seed('deskew', 'twist', bytes([1, 10, 0, 0, 0, 0, 2]) + bytes([0] + [7] * 40))
    seed('deskew', 'any', bytes([2 + 8]) + bytes(range(250)))
    seed('ply', 'big_endian', b'ply\nformat binary_big_endian 1.0\nelement camera 1\nproperty list uchar short a\n'
         b'element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n'
         b'\x02\x00\x01\x00\x02' + struct.pack('>3f', 1, 2, 3))
    seed('csv', 'names', '\ufeff# intensity;x;y;z\n1,5;2,25;3;4\n')
    seed('csv', 'count', '2\n1 2 3\n4\t5\t6\n')
    seed('kitti', 'five', struct.pack('<10f', 1, 2, 3, 0.5, 0, 4, 5, 6, 0.25, 1))
    seed('kitti', 'four', struct.pack('<8f', 1, 2, 3, 0.5, 4, 5, 6, 0.25))
    seed('lzf', 'references', b'\x20\x00' + bytes([3]) + b'abcd' + bytes([0x20, 3, 0xe0, 5, 1]))
    pose = (scans / 'scan001.pose').read_text()
    seed('scan_folder', '3dtk', joined({'scan000.3d': one[:300], 'scan001.3d': one[:200], 'scan000.pose': pose,
                                        'scan001.frames': ' '.join(map(str, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 9, 1, 2])) + '\n'}))
    ascii_pcd = (corpus / 'pcd' / 'seed_ascii').read_text()
    seed('scan_folder', 'stamps', joined({'1.5.pcd': ascii_pcd, '2.25.pcd': ascii_pcd,
                                          'odometry.tum': '1.5 0 0 0 0 0 0 1\n2.25 1 0 0 0 0 0 1\n'}))
    seed('scan_folder', 'kitti', joined({'000000.bin': struct.pack('<8f', 1, 2, 3, 0.5, 4, 5, 6, 0.25),
                                         'poses.txt': '1 0 0 0 0 1 0 0 0 0 1 0\n', 'times.txt': '0.0\n',
                                         'calib.txt': 'P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n'}))
    return scans


# ------------------------------------------------------------------------------------------ maps and graphs

def maps(folder, scans):
    out = folder / 'map'
    run('map', scans, '--out', out, '--odometry', '')
    texts = {name: (out / name).read_bytes() for name in
             ('run.json', 'trajectory.tum', 'trajectory_without_loops.tum', 'graph.g2o', 'scans.csv')}
    ply = (out / 'map.ply').read_bytes()
    texts['counters.csv'] = 'time_s,motor.attempts,gps.fixes\n0,0,0\n1.5,1,7\n'
    texts['map.ply'] = ply
    seed('map_folder', 'whole', joined(texts))
    seed('scans_alces', 'whole', (out / 'scans.alces').read_bytes())
    # the first record alone: a header of 24 bytes, a head of 24 bytes
    scans_file = (out / 'scans.alces').read_bytes()
    length = struct.unpack_from('<I', scans_file, 24 + 4)[0]
    seed('stored_scan', 'record', scans_file[48:48 + length])
    seed('graph', 'g2o', (out / 'graph.g2o').read_bytes())
    for form in ('graph', 'tum', 'kitti'):
        run('convert', out / 'graph.g2o' if form == 'graph' else out, folder / f'map.{form}')
    seed('graph', 'toro', (folder / 'map.graph').read_bytes())
    seed('graph', 'plane', 'VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.1\nVERTEX_SE2 2 1 1 1.6\nFIX 0\n'
         'EDGE_SE2 0 1 1 0 0.1 500 0 0 500 0 500\nEDGE_SE2 1 2 0 1 1.5 500 0 0 500 0 500\n'
         'EDGE_SE2 2 0 -1 -1 -1.6 100 0 0 100 0 100\n')
    seed('graph', 'edges_only', 'EDGE_SE2 0 1 1 0 0.1 500 0 0 500 0 500\nEDGE_SE2 1 2 0 1 1.5 500 0 0 500 0 500\n')
    seed('graph', 'toro_plane', 'VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0\n# loop\nEDGE2 0 1 1 0 0 1 0 1 1 0 0\n')
    seed('trajectory', 'tum', (folder / 'map.tum').read_bytes())
    seed('trajectory', 'kitti', (folder / 'map.kitti').read_bytes())
    seed('trajectory', 'names', '#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z,v_x\n1403636580838555648,1,2,3,1,0,0,0,9\n'
         '1403636580843555648,1,2,3,0.5,0.5,0.5,0.5,9\n')
    seed('trajectory', 'matrices', '1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 17.5\n' * 2)
    seed('pose_file', 'pose', '1 2 3\n0.5 -10 90\n')
    seed('pose_file', 'frames', '1 0 0 0 0 1 0 0 0 0 1 0 5 0 9 1 2\n' * 2)
    seed('pose_file', 'calib', 'P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n')
    seed('outlines', 'text', 'building 9.5 1\n0 0\n10 0\n10 8\n# end\nbuilding 3\n20 20\n21 20\n21 21\n')
    seed('outlines', 'geojson', '{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"height":7},'
         '"geometry":{"type":"Polygon","coordinates":[[[0,0],[10,0],[10,8],[0,0]],[[2,1],[3,1],[3,2],[2,1]]]}}]}')
    seed('checkpoint', 'short', b'alces lum\n')


# ------------------------------------------------------------------------------------------ settings and CAN

def without_comments(toml):
    lines = (line.split('#')[0].rstrip() for line in toml.split('\n'))
    return '\n'.join(line for line in lines if line) + '\n'


def settings(examples):
    vehicle = (examples / 'vehicle.toml').read_text()
    seed('vehicle_toml', 'example', without_comments(vehicle))
    for motor in ('motor-epos4', 'motor-ipos'):
        text = (examples / f'{motor}.toml').read_text()
        seed('vehicle_toml', motor, without_comments(text))
    seed('vehicle_toml', 'permit', '[motor]\npermit = "can"\npermit_cob_id = 0x301\n[gps]\n[laser.a]\nmake = "lms5xx"\ntcp = "10.0.0.1"\n')
    text = (examples / 'map.toml').read_text()
    seed('map_toml', 'example', without_comments(text))
    eds = ('[FileInfo]\r\nFileName=motor.eds\r\n[DeviceInfo]\r\nVendorName=Maker\r\nProductName=Motor\r\n'
           '[DeviceComissioning]\r\nNodeID=0x01\r\n[1000]\r\nParameterName=Device type ; comment\r\nObjectType=0x7\r\n'
           'DataType=0x0007\r\nAccessType=ro\r\nDefaultValue=0x00020192\r\n[1018]\r\nParameterName=Identity\r\n'
           'ObjectType=0x9\r\nSubNumber=2\r\n[1018sub0]\r\nParameterName=Entries\r\nDataType=5\r\nDefaultValue=1\r\n'
           '[1018sub1]\r\nParameterName=Vendor\r\nDataType=7\r\nParameterValue=$NODEID+0x180\r\n'
           '[1A00]\r\nParameterName=TPDO1\r\nObjectType=9\r\nCompactSubObj=4\r\nDataType=7\r\n[1A00Name]\r\n'
           'NrOfEntries=1\r\n1=Status\r\n[1A00Value]\r\nNrOfEntries=1\r\n1=0x60410010\r\n')
    seed('eds', 'dcf', eds)
    return eds


def take_can(text, most):
    lines = [line for line in text.split('\n') if ' can0 11' not in line]  # odometry is most of it
    return '\n'.join(lines[:most]) + '\n'


# ------------------------------------------------------------------------------------------ drives

def small_mcap(data, with_crc):
    """The recording's first messages of each topic, with the schemas' and the attachment's texts left out."""
    records = []
    wanted = {}

    def walk(part):
        at = 0
        while at + 9 <= len(part):
            kind, size = part[at], struct.unpack_from('<Q', part, at + 1)[0]
            content = bytes(part[at + 9:at + 9 + size])
            at += 9 + size
            if kind == 6:
                name = struct.unpack_from('<I', content, 28)[0]
                walk(content[32 + name + 8:])
            elif kind in (3, 4, 5, 12):
                records.append((kind, content))

    walk(data[8:])

    def record(kind, content):
        return bytes([kind]) + struct.pack('<Q', len(content)) + content

    def text(value):
        return struct.pack('<I', len(value)) + value

    head, messages = [], []
    seen, schemas_needed, channel_records, schema_records = {}, set(), {}, {}
    for kind, content in records:
        if kind == 3:
            schema_records.setdefault(struct.unpack_from('<H', content)[0], content)
        elif kind == 4:
            channel_records.setdefault(struct.unpack_from('<H', content)[0], content)
        elif kind == 5:
            channel = struct.unpack_from('<H', content)[0]
            if seen.get(channel, 0) < 2 and len(content) < 500:
                seen[channel] = seen.get(channel, 0) + 1
                messages.append(record(5, content))
    for channel in seen:
        content = channel_records[channel]
        schema = struct.unpack_from('<H', content, 2)[0]
        if schema not in schemas_needed:
            schemas_needed.add(schema)
            old = schema_records[schema]
            size = struct.unpack_from('<I', old, 2)[0]
            name = old[6:6 + size]
            head.append(record(3, old[:2] + text(name) + text(b'ros2msg') + text(b'')))
        head.append(record(4, content))
    half = len(messages) // 2
    out = b'\x89MCAP0\r\n' + record(1, text(b'ros2') + text(b'alces')) + b''.join(head)
    metadata = text(b'format') + text(b'1') + text(b'utc_offset_ns') + text(b'1700000000000000000')
    out += record(12, text(b'alces') + text(metadata))
    toml = b'[motor]\nnode = 1\n'
    attachment = struct.pack('<QQ', 0, 0) + text(b'vehicle.toml') + text(b'text/plain') + struct.pack('<Q', len(toml)) + toml
    out += record(9, attachment + struct.pack('<I', zlib.crc32(attachment) if with_crc else 0))
    for part in (messages[:half], messages[half:]):
        inner = b''.join(part)
        out += record(6, struct.pack('<QQQI', 0, 2**62, len(inner), zlib.crc32(inner) if with_crc else 0) + text(b'') +
                      struct.pack('<Q', len(inner)) + inner)
    out += record(15, struct.pack('<I', 0)) + record(2, struct.pack('<QQI', 0, 0, 0)) + b'\x89MCAP0\r\n'
    return out


steps_ns = [0, 10_000, 100_000, 1_000_000, 3_000_000, 5_000_000, 10_000_000, 13_000_000]  # targets/devices.cpp


class ScannerInput:
    """An input of the target `scanner`: event after event, with about their times."""

    def __init__(self, choice):
        self.out = bytearray([choice])
        self.now_ns = None

    def event(self, stamp_ns, kind, content):
        if self.now_ns is None:
            self.now_ns = stamp_ns
        ticks, rest = divmod(max(0, stamp_ns - self.now_ns), 10_000_000)
        while ticks > 0:
            count = min(ticks, 255)
            self.out += bytes([0, count])
            ticks -= count
            self.now_ns += count * 10_000_000
        code = min(range(len(steps_ns) - 2), key=lambda i: abs(steps_ns[i] - rest))
        self.now_ns += steps_ns[code]
        self.out += bytes([code << 4 | kind]) + content

    def frame(self, stamp_ns, identifier, data):
        self.event(stamp_ns, 2, struct.pack('<H', identifier | len(data) << 12) + data)

    def bytes(self, stamp_ns, channel, data, framed=False):
        self.event(stamp_ns, 7 if framed else 8, bytes([channel]) + struct.pack('<H', len(data)) + data)


def scanner_input(traces, begin_s, seconds, lasers):
    """A drive's events; each profile but the first as the one before."""
    def lines(name):
        return iter((traces / name).read_text().split('\n')) if (traces / name).exists() else iter(())

    can, gpio = lines('can0.log'), lines('gpio.txt')
    pieces = {}
    for channel, name in enumerate(('laser_a', 'laser_b', 'gps')):
        if (traces / f'{name}.bin').exists():
            pieces[name] = (channel, (traces / f'{name}.bin').read_bytes(), lines(f'{name}.times'), [0], [b''])
    result = ScannerInput(0 if lasers == 2 else 1)
    first_ns = None
    has_profile = False
    for line in (traces / 'events.txt').read_text().split('\n'):
        if line.startswith('#') or not line:
            continue
        stamp, kind, *more = line.split()
        stamp_ns = int(stamp)
        first_ns = first_ns if first_ns is not None else stamp_ns
        is_in = begin_s <= (stamp_ns - first_ns) / 1e9 < begin_s + seconds
        if kind == 'can0' and not more:
            _, _, frame, direction = next(can).split()
            identifier, data = frame.split('#')
            if direction == 'R' and is_in and not (identifier in ('110', '111', '112') and stamp_ns // 1_000_000 % 7):
                result.frame(stamp_ns, int(identifier, 16), bytes.fromhex(data))
        elif kind == 'gpio':
            edge = next(gpio).split()
            if is_in:
                result.event(stamp_ns, 5, bytes([8 if edge[1] == 'rising' else 0]))
        elif kind in pieces and not more:
            channel, data, times, at, pending = pieces[kind]
            size = int(next(times).split()[1])
            pending[0] += data[at[0]:at[0] + size]
            at[0] += size
            while pending[0] and channel < 2:
                telegram = pending[0][:1]  # an acknowledgement, unless it begins a telegram
                if telegram == b'\x02':
                    if len(pending[0]) < 4:
                        break
                    telegram = pending[0][:6 + struct.unpack_from('<H', pending[0], 2)[0]]
                    if len(telegram) < 6 + struct.unpack_from('<H', pending[0], 2)[0]:
                        break
                pending[0] = pending[0][len(telegram):]
                if not is_in:
                    continue
                if len(telegram) < 100:
                    result.bytes(stamp_ns, channel, telegram)
                    continue
                rays = bytes([0xb0, 0xb5, 0x40]) + struct.pack('<181H', *([500] * 181))
                result.bytes(stamp_ns, channel, b'' if has_profile else rays, True)
                has_profile = True
            if channel == 2:
                if is_in:
                    result.bytes(stamp_ns, channel, pending[0])
                pending[0] = b''
        elif more and more[0] == 'up' and kind in ('laser_a', 'laser_b', 'gps'):
            if is_in:
                result.event(stamp_ns, 11, bytes([('laser_a', 'laser_b', 'gps').index(kind) | 4]))
    return bytes(result.out)


def drives(folder, eds):
    drive, traces = folder / 'drive.mcap', folder / 'traces'
    run('simulate', '--scans', 4, '--standstill', 1, '--out', drive)
    run('convert', drive, traces)
    data = drive.read_bytes()
    seed('mcap', 'crc', small_mcap(data, True))
    seed('mcap', 'no_crc', small_mcap(data, False))
    can = (traces / 'can0.log').read_text()
    seed('candump', 'log', take_can(can, 40))
    seed('candump', 'screen', " (1436509052.249713)  can0  181   [8]  21 04 FF FF 00 00 00 00   '!.......'\n"
         '  can1  RX - -  00000181   [0]  remote request\n (000.000100)  vcan0  123   [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n'
         '  can0  20000088   [8]  00 00 08 00 00 00 00 00   ERRORFRAME\n\tcontroller-problem{}\n(1.5) can0 1F334455#R4\n'
         '(1.6) can0 123##1DEADBEEF\n')
    seed('explain_can', 'start', joined({'motor.eds': eds, 'candump.log': take_can(can, 60)}))
    gpio = (traces / 'gpio.txt').read_text()
    events = '\n'.join((traces / 'events.txt').read_text().split('\n')[:60]) + '\n'
    seed('trace_folder', 'ours', joined({'can0.log': '\n'.join(can.split('\n')[:40]) + '\n', 'gpio.txt': gpio,
                                         'events.txt': events, 'laser_a.bin': (traces / 'laser_a.bin').read_bytes()[:60],
                                         'laser_a.times': '\n'.join((traces / 'laser_a.times').read_text().split('\n')[:5]) + '\n'}))
    gps = (traces / 'gps.bin').read_text()
    seed('trace_folder', 'others', joined({'can0.log': take_can(can, 20), 'gps.nmea': '\n'.join(gps.split('\n')[:4]) + '\n',
                                           'laser_a.bin': (traces / 'laser_a.bin').read_bytes()[:100],
                                           'gpio.txt': 'event:  RISING EDGE offset: 3 timestamp: [    1608.012345678]\n'}))
    seed('scanner', 'bring_up', scanner_input(traces, 0, 3.2, 2))
    seed('scanner', 'start_to_scan', scanner_input(traces, 0, 7.5, 2))
    fix = ScannerInput(0x30)
    for second in range(4):
        line = f'GPGGA,12350{second}.00,4807.0{38 + second},N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,'
        fix.bytes(second * 10**9, 2, line.encode(), True)
        fix.bytes(second * 10**9 + 10**8, 2, b'GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W', True)
    seed('scanner', 'gps', bytes(fix.out))
    tim = ScannerInput(0x37)  # CoLa B, listening only, no motor, no odometry
    tim.event(0, 11, bytes([4]))
    scan = (b'sSN LMDscandata \x00\x01\x00\x01\x01\x02\x03\x04\x00\x00\x00\x07\x00\x09' + struct.pack('>II', 1000, 1500) +
            b'\x00\x00\x00\x00\x00' + struct.pack('>II', 5000, 720) + b'\x00\x00\x00\x01DIST1' + struct.pack('>ffiHH', 1, 0, -50000, 5000, 20) +
            struct.pack('>20H', *range(900, 920)) + b'\x00' * 12)
    for step in range(8):
        tim.bytes(step * 40_000_000, 0, scan, True)
        tim.event(step * 40_000_000, 5, bytes([8 * (step & 1)]))
    seed('scanner', 'cola_b', bytes(tim.out))
    # encoder: positions, an index pulse a turn, ticks and questions
    out = bytearray([1])
    for step in range(400):
        out += bytes([2, 0]) + struct.pack('<h', 20)
        out += bytes([6 | 5 << 3, 0])
        if step % 205 == 100:
            out += bytes([32, 9, 0, 2])
        if step % 5 == 0:
            out += bytes([7 | 3 << 3, 40])
    seed('encoder', 'drive', bytes(out[:2500]))
    out = bytearray([2 + 8])
    for step in range(300):
        line = [1, 2][step % 2]
        out += bytes([line << 3 | (32 if step % 4 < 2 else 0), 0, 6 | 1 << 3, 0])
    seed('encoder', 'quadrature', bytes(out))


def mapper_inputs():
    def scan(form, count, *content):
        return bytes([form, count]) + b''.join(content)
    walls = b''.join(scan(1 | 8, 120, bytes([32]), bytes([16, 0, 4, 0])) for _ in range(12))
    seed('add_scan', 'walls', walls)
    around = b''.join(scan(1 | 8 | 16, 90, bytes([40]), struct.pack('<3bb', 60, 0, 50, 3)) for _ in range(20))
    seed('add_scan', 'around', around)
    odd = scan(3, 4, bytes([16]), struct.pack('<12f', math.nan, 1, 2, 1e38, -1e38, 3, 1e-40, 0, 0, math.inf, 1, 1), b'\x00')
    odd += scan(1 | 8 | 4, 60, bytes([16]), struct.pack('<7d', 1e300, math.nan, 0, 0, 0, 0, 1), b'\x00')
    odd += scan(1 | 8 | 4 | 64, 60, bytes([16]), struct.pack('<7d', 5, 5, 0, 0, 0, 0, 1), b'\x00\x00')
    seed('add_scan', 'odd', odd)
    seed('mapper_config', 'standard', bytes([0, 0]) + walls)
    seed('mapper_config', 'paper', bytes([1, 2, 8, 0]) + struct.pack('<h', 256) + bytes([30, 1]) + struct.pack('<d', 0.5) + walls)


with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    scans = clouds(folder)
    maps(folder, scans)
    eds = settings(pathlib.Path(__file__).resolve().parents[2] / 'docs' / 'examples')
    drives(folder, eds)
    mapper_inputs()
