"""Give each folder one owner, the only process that writes into it, and take over folders of dead owners.

The owner holds a lock on the file `.owner` in the folder, which holds its process id, host and start. The system
releases the lock when the process ends, however it ends; so a free lock on an existing file belonged to a dead owner.
Locks do not reach from host to host everywhere: the owner touches its file every minute, and an owner on another host
counts as dead after ten minutes without a touch. Without locks the same holds for one on this host that still runs.
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
    folder or its owner's file is a link, or that file is not a regular one. Raises `TakenError` if another process owns
    the folder.
    """
    try:
        str(folder).encode()
    except UnicodeEncodeError:  # TensorBoard, JSON and pages could not name it
        raise SpringfootError(f"cannot make the folder {folder}: its name must be UTF-8 text") from None
    path = folder / OWNER
    new_folders: list[Path] = []
    try:
        handle, locked = _open_and_lock(path, new_folders)
        removes_file = True  # at the end, unless the file is not ours
        ended = threading.Event()
        try:
            try:
                former_owner = _require_dead_owner(folder, handle, locked)
            except SpringfootError:
                removes_file = False
                raise
            if former_owner:
                print(
                    f"{folder}: taken over from {_owner_in_words(former_owner)}, which has ended",
                    file=sys.stderr,
                    flush=True,
                )
            owner = {"pid": os.getpid(), "host": socket.gethostname(), "began": datetime.now(UTC).isoformat()}
            os.ftruncate(handle, 0)
            os.pwrite(handle, json.dumps(owner).encode(), 0)
            threading.Thread(target=_keep_touching, args=(path, ended), daemon=True).start()
            yield
        finally:
            ended.set()
            if removes_file and _is_file_at(handle, path):  # it is not where the folder was moved or replaced
                path.unlink()
            os.close(handle)
    finally:
        with suppress(OSError):
            for new_folder in reversed(new_folders):
                new_folder.rmdir()


def _require_dead_owner(folder: Path, handle: int, locked: bool) -> dict[str, Any]:
    """Return the record of a folder's former owner, empty if there was none.

    `handle` is that of the owner's file, and `locked` tells whether this process holds its lock. Raises `TakenError` if
    the owner may still live, and `SpringfootError` for a file with another content.
    """
    path = folder / OWNER
    owner = _owner_in(handle)
    if os.fstat(handle).st_size and not owner.keys() >= _KEYS:
        raise SpringfootError(f"{path} is not a file of springfoot's: remove it")
    # With the lock, an owner of this host is dead; without it, if its process has ended. All others: by the last touch.
    is_here = owner.get("host") == socket.gethostname()
    may_live = not is_here or (not locked and _is_running(owner))
    if owner and may_live:
        silence = time.time() - path.stat().st_mtime
        if silence < -DEAD:  # touched in the future: the clocks of the two hosts differ
            ahead = _time_in_words(-silence)
            raise TakenError(_taken_message(folder, owner, f", by a clock {ahead} ahead; remove {path} if not"))
        if silence < DEAD:
            raise TakenError(_taken_message(folder, owner, f", last heard of {_time_in_words(silence)} ago"))
    return owner


def _open_and_lock(path: Path, new_folders: list[Path]) -> tuple[int, bool]:
    """Open the owner's file at `path`, made if missing, and lock it: return its handle, and whether it is locked.

    It is not locked where the file system has no locks. Missing folders above it are made and added to `new_folders`.
    Links above the folder are followed, but neither the folder nor the file may be one: whoever made it would have us
    write elsewhere. Raises `TakenError` if another process holds the lock.
    """
    while True:
        if path.parent.is_symlink():
            raise SpringfootError(f"{path.parent} is a link: name the folder itself")
        new_folders += _make_folders(path.parent)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | _NO_LINK, 0o644)
        except FileNotFoundError:  # the former owner has just removed its folder
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
            deadline = time.monotonic() + _NAMED_WITHIN
            while not (owner := _owner_in(handle)) and time.monotonic() < deadline:
                time.sleep(0.01)  # the owner has only just locked the file, and not yet written its name
            os.close(handle)
            raise TakenError(_taken_message(path.parent, owner)) from None
        except OSError:  # a file system without locks
            locked = False
        if _is_file_at(handle, path):
            return handle, locked
        # Otherwise try again with a new file.
        os.close(handle)  # the former owner has just removed its file


def _make_folders(folder: Path) -> list[Path]:
    """Make a folder and those above it; return the new ones, outermost first."""
    missing = [ancestor for ancestor in (folder, *folder.parents) if not ancestor.exists()][::-1]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SpringfootError(f"cannot make the folder {folder}: {error.strerror}") from None
    return missing


def _is_file_at(handle: int, path: Path) -> bool:
    """Tell whether a handle is still that of the file at `path`."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except OSError:
        return False


def _keep_touching(path: Path, ended: threading.Event) -> None:
    """Touch the owner's file every `BEAT` seconds until the event `ended` is set."""
    while not ended.wait(BEAT):
        with suppress(OSError):
            os.utime(path, follow_symlinks=False)


def _owner_in(handle: int) -> dict[str, Any]:
    """Return the record of the owner in an open file; empty if there is none, or another content."""
    try:
        record = json.loads(os.pread(handle, MOST_OWNER_BYTES, 0))
    except (OSError, ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def is_marked(folder: Path) -> bool:
    """Return whether the folder holds a valid owner file (regular, not linked, all keys)."""
    try:
        handle = os.open(folder / OWNER, os.O_RDONLY | _NO_LINK)
    except OSError:
        return False
    try:
        return _may_be_ours(os.fstat(handle)) and _owner_in(handle).keys() >= _KEYS
    finally:
        os.close(handle)


def _may_be_ours(file: os.stat_result) -> bool:
    """Tell whether an opened file is regular and has no second name, under which it would be another's file."""
    return stat.S_ISREG(file.st_mode) and file.st_nlink <= 1


def _is_running(owner: dict[str, Any]) -> bool:
    """Tell whether this host runs a process with the owner's id; False for a record without a proper id."""
    try:
        os.kill(int(owner["pid"]), 0)  # signal 0 only asks
    except (ProcessLookupError, KeyError, TypeError, ValueError, OverflowError):
        return False
    except OSError:  # it runs, but belongs to another user, and must not be asked
        return True
    return True


def _taken_message(folder: Path, owner: dict[str, Any], detail: str = "") -> str:
    """Return the message of `TakenError`: another process, the record `owner`, writes the folder; `detail` follows."""
    return f"{folder} is being written by {_owner_in_words(owner)}{detail}; wait for it, or choose another folder"


def _owner_in_words(owner: dict[str, Any]) -> str:
    """Return words on the record `owner` of a folder: process, host, and time since it began."""
    try:
        age = (datetime.now(UTC) - datetime.fromisoformat(owner["began"])).total_seconds()
        return f"process {int(owner['pid'])} on {owner['host']}, begun {_time_in_words(age)} ago"
    except (KeyError, TypeError, ValueError):
        return "another process"


def _time_in_words(seconds: float) -> str:
    """Return a time [s] in words."""
    for unit, size in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:  # 1.5 h are better told as 90 min
            return f"{seconds / size:.0f} {unit}"
    return f"{max(seconds, 0):.0f} s"  # below 0 if a clock was put back meanwhile
