"""A digest inside a text file of ours, CSV or JSON, by which the file tells whether it is still as it was written.

It is of every byte of the file, with zeros where the digest itself stands, however often. It finds what a disk, a copy
or an editor has changed. It is no signature: whoever changes a file on purpose can write a fitting one.
"""

import re
from hashlib import sha256
from pathlib import Path

from springfoot.errors import SpringfootError

SEAL = "sha256"
"""Name of the digest: of a column, of a JSON entry; it stands before its digits, too, so that no one bit hides both."""
BLANK = f"{SEAL}:{'0' * 64}"
"""What a text says in the place of its digest before it is sealed."""
_DIGITS = re.compile(rb"sha256:([0-9a-f]{64})")


def sealed(text: str) -> str:
    """`text` with its digest in every place where it says `BLANK`."""
    return text.replace(BLANK, f"{SEAL}:{sha256(text.encode()).hexdigest()}")


def require_whole(path: Path, content: bytes) -> None:
    """Raise `SpringfootError` for the content of a file that is sealed and not as it was written."""
    if SEAL.encode() not in content:
        return  # of somebody else, or of an earlier version
    found = _DIGITS.search(content)
    blank = content.replace(found[1], BLANK.removeprefix(f"{SEAL}:").encode()) if found else b""
    if found is None or sha256(blank).hexdigest().encode() != found[1]:
        raise SpringfootError(
            f"{path} is damaged or was changed: its contents are not those that were written; without its {SEAL} it "
            "is read as it is"
        )
