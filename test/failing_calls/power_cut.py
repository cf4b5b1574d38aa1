"""A disk as a power cut leaves it, from the log that preload.cpp keeps.

The model is that of a file system with a journal (ext4, xfs, btrfs):
  - names (create, rename, exchange, link, mkdir, unlink) reach the disk in their order: after a cut there is a beginning of
    them, at least as far as the last sync;
  - bytes reach the disk in any order or not at all until their file, or the whole file system, is synced: each unsynced
    write is there or not, and where it is not there may be zeros instead or a shorter file.
"""
import pathlib


class File:
    def __init__(self, content=b''):
        self.content = content  # before the log
        self.changes = []       # (time, 'data', at, bytes) or (time, 'cut', size)
        self.synced = -1        # changes up to this time are on the disk

    def after(self, time, dice=None):
        """Its bytes when the power goes at a time; without dice all of its changes have arrived."""
        content = bytearray(self.content)
        for when, kind, at, data in self.changes:
            if when > time:
                break
            is_safe = dice is None or when <= self.synced_at(time)
            if kind == 'cut':
                if is_safe or dice.random() < 0.5:
                    content = content[:at] + bytes(max(0, at - len(content)))
                continue
            fate = 1 if is_safe else dice.choice((0, 0.5, 1, 'zeros'))
            if fate == 0:
                continue
            piece = bytes(len(data)) if fate == 'zeros' else data[:int(len(data) * fate)]
            if len(content) < at:
                content += bytes(at - len(content))
            content[at:at + len(piece)] = piece
        return bytes(content)

    def synced_at(self, time):
        return max((when for when in self.syncs if when <= time), default=-1)


class Disk:
    """The folder's files before the log, then what happened to them."""

    def __init__(self, folder):
        self.folder = str(folder)
        self.first = {}
        self.inodes = {}
        for path in pathlib.Path(folder).rglob('*'):
            if path.is_dir():
                self.first[str(path)] = None
            else:
                file = File(path.read_bytes())
                file.syncs = []
                self.first[str(path)] = file
                self.inodes[path.stat().st_ino] = file
        self.names = []   # (time, kind, ...)
        self.syncs = []   # times from which on names are on the disk
        self.end = 0

    def take(self, log):
        now = dict(self.first)
        for time, line in enumerate(log.split('\n')):
            self.end = time
            word, *rest = line.split(' ')
            if word == 'open':
                inode, is_emptied, path = int(rest[0]), rest[1] == '1', rest[2]
                if not path.startswith(self.folder):
                    self.inodes.pop(inode, None)
                    continue
                file = now.get(path)
                if file is None:
                    file = File()
                    file.syncs = []
                    now[path] = file
                    self.names.append((time, 'create', path, file))
                elif is_emptied:
                    file.changes.append((time, 'cut', 0, b''))
                self.inodes[inode] = file
            elif word == 'data':
                file = self.inodes.get(int(rest[0]))
                if file is not None:
                    file.changes.append((time, 'data', int(rest[1]), bytes.fromhex(rest[2])))
            elif word == 'cut':
                file = self.inodes.get(int(rest[0]))
                if file is not None:
                    file.changes.append((time, 'cut', int(rest[1]), b''))
            elif word == 'sync':
                self.syncs.append(time)
                everything = rest[1] == 'syncfs'
                for inode, file in self.inodes.items():
                    if everything or inode == int(rest[0]):
                        file.syncs.append(time)
            elif word in ('rename', 'link', 'mkdir', 'unlink'):
                self.names.append((time, word, *rest))
                self.apply(now, self.names[-1])

    def apply(self, names, change):
        kind = change[1]
        if kind == 'create':
            names[change[2]] = change[3]
        elif kind == 'mkdir':
            names[change[2]] = None
        elif kind == 'unlink':
            names.pop(change[2], None)
        elif kind == 'link':
            names[change[3]] = names.get(change[2])
        else:  # rename, of a file or a folder with all in it; flag 2: both change places
            flags, a, b = int(change[2]), change[3], change[4]
            taken = {path: names.pop(path) for path in list(names) if path == a or path.startswith(a + '/')}
            other = {path: names.pop(path) for path in list(names) if path == b or path.startswith(b + '/')}
            names.update({b + path[len(a):]: file for path, file in taken.items()})
            if flags & 2:
                names.update({a + path[len(b):]: file for path, file in other.items()})

    def tree(self, names, path, content_of):
        path = str(path)
        if names.get(path) is not None:
            return content_of(names[path])
        if path not in names:
            return None
        return {name[len(path) + 1:]: content_of(file) for name, file in sorted(names.items())
                if name.startswith(path + '/') and file is not None}

    def everything(self, path):
        names = dict(self.first)
        for change in self.names:
            self.apply(names, change)
        return self.tree(names, path, lambda file: file.after(self.end))

    def after_a_cut(self, dice):
        """A function from paths to what is there."""
        time = dice.randint(0, self.end)
        safe = max((when for when in self.syncs if when <= time), default=-1)
        lost_from = dice.randint(safe, time)
        names = dict(self.first)
        for change in self.names:
            if change[0] <= max(safe, lost_from):
                self.apply(names, change)
        contents = {}

        def content_of(file):
            if id(file) not in contents:
                contents[id(file)] = file.after(time, dice)
            return contents[id(file)]
        return lambda path: self.tree(names, path, content_of)
