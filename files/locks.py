"""Give each folder one owner, the only process that writes into it, and take over folders of dead owners.

The owner holds a lock on the file `.owner` in the folder, which holds its process id, host and start. The system
releases the lock when the process ends, however it ends; so a free lock on an existing file belonged to a dead owner.
Locks do not reach from host to host everywhere: the owner touches its file every minute, and an owner on another host
counts as dead after ten minutes without a touch.
"""

import json
import os
import socket
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from springfoot.errors import SpringfootError

try:
    import fcntl
except ImportError:  # a system without such locks: every owner is taken as one on another host
    fcntl = None

OWNER = ".owner"
"""File that names the owner of its folder."""
MOST_OWNER_BYTES = 4096
"""Most bytes that are read of an owner's file; chosen, tens of times a usual one."""
BEAT, DEAD = 60.0, 600.0
"""Time between two touches, and time without a touch after which an owner on another host is dead [s]; chosen."""
_NAMED_WITHIN = 1.0
"""Longest time between a lock and the owner's name in its file [s]; chosen."""
_NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Flags with which a link is not followed, and a pipe does not wait for its other end."""
_KEYS = {"pid", "host", "began"}
"""Keys of an owner's record."""


class TakenError(SpringfootError):
    """Another process owns the folder."""


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Own `folder` until the block ends.

    A missing folder is made, and removed at the end if it is empty. A message on standard error says when the folder
    comes from a dead owner. Raises `SpringfootError`, with nothing changed, if the folder cannot be made, and if the
    folder or its owner's file is a link, or the latter no regular file. Raises `TakenError` if another process owns the
    folder.
    """
    try:
        str(folder).encode()
    except UnicodeEncodeError:  # TensorBoard, JSON and pages could not name it
        raise SpringfootError(f"cannot make the folder {folder}: its name must be UTF-8 text") from None
    path = folder / OWNER
    made: list[Path] = []
    try:
        handle, locked = _locked(path, made)
        mine = True
        over = threading.Event()
        try:
            former = _read(handle)
            if os.fstat(handle).st_size and not former.keys() >= _KEYS:
                mine = False
                raise SpringfootError(f"{path} is not a file of springfoot's: remove it")
            if former and (former.get("host") != socket.gethostname() or (not locked and _runs(former))):
                silent = time.time() - path.stat().st_mtime
                mine = silent >= DEAD
                if silent < -DEAD:
                    raise TakenError(
                        _taken(folder, former, f", by a clock {_span(-silent)} ahead; remove {path} if not")
                    )
                if not mine:
                    raise TakenError(_taken(folder, former, f", last heard of {_span(silent)} ago"))
            if former:
                print(f"{folder}: taken over from {_named(former)}, which has ended", file=sys.stderr, flush=True)
            me = {"pid": os.getpid(), "host": socket.gethostname(), "began": datetime.now(UTC).isoformat()}
            os.ftruncate(handle, 0)
            os.pwrite(handle, json.dumps(me).encode(), 0)
            threading.Thread(target=_live, args=(path, over), daemon=True).start()
            yield
        finally:
            over.set()
            if mine and _same(handle, path):  # it is another's, or nobody's, where the folder was moved
                path.unlink()
            os.close(handle)
    finally:
        with suppress(OSError):
            for each in reversed(made):
                each.rmdir()


def _locked(path: Path, made: list[Path]) -> tuple[int, bool]:
    """Return a handle of the file at `path`, and whether it is locked, as it always is where file systems have locks.

    Makes missing folders above it, and adds them to `made`. Links above the folder are followed, but neither the folder
    nor the file may be one: whoever made it would have us write elsewhere.
    """
    while True:
        if path.parent.is_symlink():
            raise SpringfootError(f"{path.parent} is a link: name the folder itself")
        made += _make(path.parent)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | _NO_LINK, 0o644)
        except FileNotFoundError:  # the one before has just removed its folder
            continue
        except OSError as error:
            if path.is_symlink() or not path.is_file():
                raise SpringfootError(f"{path} is not a file of springfoot's: remove it") from None
            raise error
        if not _may_be_ours(os.fstat(handle)):
            os.close(handle)
            raise SpringfootError(f"{path} is not a file of springfoot's: remove it")
        locked = fcntl is not None
        try:
            if fcntl is not None:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            until = time.monotonic() + _NAMED_WITHIN
            while not (owner := _read(handle)) and time.monotonic() < until:
                time.sleep(0.01)  # it has only just locked the file
            os.close(handle)
            raise TakenError(_taken(path.parent, owner)) from None
        except OSError:  # a file system without locks
            locked = False
        if _same(handle, path):
            return handle, locked
        os.close(handle)  # the one before has just removed its file


def _make(folder: Path) -> list[Path]:
    """Make a folder and those above it; return the new ones, outermost first."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()][::-1]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpringfootError(f"cannot make the folder {folder}: {error.strerror}") from None
    return missing


def _same(handle: int, path: Path) -> bool:
    """Tell whether a handle is still that of the file at `path`."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except OSError:
        return False


def _live(path: Path, over: threading.Event) -> None:
    """Touch the owner's file every `BEAT` seconds until the event `over`."""
    while not over.wait(BEAT):
        with suppress(OSError):
            os.utime(path, follow_symlinks=False)


def _read(handle: int) -> dict[str, Any]:
    """Return the record of the owner; empty if there is none."""
    try:
        found = json.loads(os.pread(handle, MOST_OWNER_BYTES, 0))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def is_marked(folder: Path) -> bool:
    """Tell whether a folder holds an owner's file as only a process of ours writes it."""
    try:
        handle = os.open(folder / OWNER, os.O_RDONLY | _NO_LINK)
    except OSError:
        return False
    try:
        return _may_be_ours(os.fstat(handle)) and _read(handle).keys() >= _KEYS
    finally:
        os.close(handle)


def _may_be_ours(file: os.stat_result) -> bool:
    """Tell whether an opened file is regular and has no second name, under which it would be another's file."""
    return stat.S_ISREG(file.st_mode) and file.st_nlink <= 1


def _runs(owner: dict[str, Any]) -> bool:
    """Tell whether this host runs a process of that id."""
    try:
        os.kill(int(owner["pid"]), 0)
    except (ProcessLookupError, KeyError, TypeError, ValueError, OverflowError):
        return False
    except OSError:  # somebody else's
        return True
    return True


def _taken(folder: Path, owner: dict[str, Any], more: str = "") -> str:
    return f"{folder} is being written by {_named(owner)}{more}; wait for it, or choose another folder"


def _named(owner: dict[str, Any]) -> str:
    """Return the owner in words: process, host and age."""
    try:
        age = (datetime.now(UTC) - datetime.fromisoformat(owner["began"])).total_seconds()
        return f"process {int(owner['pid'])} on {owner['host']}, begun {_span(age)} ago"
    except (KeyError, TypeError, ValueError):
        return "another process"


def _span(seconds: float) -> str:
    """Return a time [s] in words."""
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 0):.0f} s"
