#!/usr/bin/env python3
"""A candump log that no bus should carry: for canplayer, against alcesd and the motor drive of node 1.

Everything that is sent to, from and about the drive, at the wrong time and with the wrong content, and noise: with a
fixed seed, so that a failure can be had again.
"""
import random

random.seed(1)
interface, at = 'vcan0', 0.0


def frame(identifier, data='', gap_s=0.001, extended=False):
    global at
    at += gap_s
    print(f'({at:.6f}) {interface} {identifier:0{8 if extended else 3}X}#{data}')


def noise(size):
    return ''.join(f'{random.randrange(256):02X}' for _ in range(size))


for burst in range(6):
    for _ in range(40):  # the drive's own: positions, speeds and states that are not
        frame(0x181, noise(6))
        frame(0x281, noise(4))
    frame(0x181, 'FF')  # too short
    frame(0x181)
    frame(0x701, '00')  # booted up again?
    for state in ('04', '05', '7F', '80', 'FF', ''):
        frame(0x701, state)
    for code in ('1081', '3023', 'FFFF', '0000'):  # emergencies
        frame(0x081, code + '01' + noise(5))
    for command in ('43', '4F', '60', '80', '00', 'FF'):  # SDO answers that nobody asked for
        frame(0x581, command + noise(7))
    frame(0x581, '80')
    frame(0x000, '0201')  # NMT: the drive is to stop
    frame(0x000, '8101')  # NMT: and to begin anew
    frame(0x000)
    frame(0x601, '2F60600000000000')  # somebody else writes to it: no mode
    frame(0x601, noise(8))
    frame(0x110, noise(8))  # odometry: absurd, short, empty
    frame(0x110, noise(2))
    frame(0x111)
    frame(0x111, noise(8))
    for _ in range(300):  # anything
        if random.random() < 0.2:
            frame(random.randrange(1 << 29), noise(random.randrange(9)), 0.0005, extended=True)
        else:
            frame(random.randrange(1 << 11), noise(random.randrange(9)), 0.0005)
    for _ in range(20):
        frame(random.randrange(1 << 11), f'R{random.randrange(9)}', 0.0005)
    at += 0.5
