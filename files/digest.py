"""Put a digest into text files, CSV or JSON, and check it, so that changes of a file are found.

The digest covers every byte of the file, with zeros in place of the digest itself. It finds changes by a disk, a copy
or an editor. It is no signature: a forger can write a fitting one.
"""

import re
from hashlib import sha256
from pathlib import Path

from springfoot.errors import SpringfootError

SEAL = "sha256"
"""Name of the digest's CSV column or JSON entry; it also stands before the digits, so that no single bit hides both."""
BLANK = f"{SEAL}:{'0' * 64}"
"""Placeholder for the digest in a text without one."""
_DIGITS = re.compile(rb"sha256:([0-9a-f]{64})")


def sealed(text: str) -> str:
    """Return `text` with its digest in place of every `BLANK`."""
    return text.replace(BLANK, f"{SEAL}:{sha256(text.encode()).hexdigest()}")


def require_whole(path: Path, content: bytes) -> None:
    """Raise `SpringfootError` if a file's content has a digest that does not fit."""
    if SEAL.encode() not in content:
        return  # of somebody else, or of an earlier version
    found = _DIGITS.search(content)
    blank = content.replace(found[1], BLANK.removeprefix(f"{SEAL}:").encode()) if found else b""
    if found is None or sha256(blank).hexdigest().encode() != found[1]:
        raise SpringfootError(
            f"{path} is damaged or was changed: its contents are not those that were written; without its {SEAL} it "
            "is read as it is"
        )
