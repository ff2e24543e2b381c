"""Put a digest into text files, CSV or JSON, and check it, so that changes of a file are found.

The digest covers every byte of the file, with zeros in place of the digest itself. It finds changes by a disk, a copy
or an editor. It is no signature: a forger can write a fitting one.
"""

import re
from hashlib import sha256
from pathlib import Path

from springfoot.errors import SpringfootError

DIGEST = "sha256"
"""Name of the digest's CSV column or JSON entry. It also stands before the digits, so that a file in which one of the
two is damaged still shows that it had a digest."""
BLANK_DIGEST = f"{DIGEST}:{'0' * 64}"
"""Placeholder for the digest in a text without one."""
_DIGITS = re.compile(rb"sha256:([0-9a-f]{64})")


def with_digest(text: str) -> str:
    """Return `text` with its digest in place of every `BLANK_DIGEST`."""
    return text.replace(BLANK_DIGEST, f"{DIGEST}:{sha256(text.encode()).hexdigest()}")


def require_unchanged(path: Path, content: bytes) -> None:
    """Raise `SpringfootError` if a file's content has a digest that does not fit; content without a digest passes."""
    if DIGEST.encode() not in content:
        return  # the file is not springfoot's, or an earlier version wrote it
    written = _DIGITS.search(content)
    # The content as it was when its digest was computed.
    blank = content.replace(written[1], BLANK_DIGEST.removeprefix(f"{DIGEST}:").encode()) if written else b""
    if written is None or sha256(blank).hexdigest().encode() != written[1]:
        raise SpringfootError(
            f"{path} is damaged or was changed: its contents are not those that were written; without its {DIGEST} it "
            "is read as it is"
        )
