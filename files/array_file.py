"""Read and write arrays with a JSON header in one .npz file; a digest of both finds damage. No objects, no pickles.

The members of the archive are stored, not compressed, so that a small file cannot fill the memory.
"""

import io
import json
import os
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile

import numpy as np
from numpy.lib import format as npy

from springfoot.arrays import NDArray
from springfoot.errors import SpringfootError

from .tensor_file import DIGEST, digest_of
from .text_table import open_file

HEADER = "header"
"""Name of the array with the JSON text."""
_FAULTS = (
    ArithmeticError,  # more entries than a number can count
    AttributeError,  # a header that is a number or a text
    EOFError,
    LookupError,  # no header
    MemoryError,
    OSError,
    RuntimeError,  # a member under a password
    TypeError,  # a header that is a list
    ValueError,
)
"""Errors of `zipfile`, `numpy` and `json` on files of other contents."""


def write_arrays(path: Path, header: dict[str, Any], arrays: dict[str, NDArray]) -> None:
    """Write arrays and a JSON header as an .npz file, with a digest of both in the header."""
    packed = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    text = json.dumps(header | {DIGEST: digest_of(header, packed)}, allow_nan=False)
    np.savez(path, **{HEADER: np.array(text)}, **dict[str, Any](packed))


def read_arrays(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return header and arrays of a file that `write_arrays` wrote.

    Raises `SpringfootError` for any other file; the message calls it no `kind` ("FILE is no walk's recording").
    """
    try:
        with open_file(path) as file, ZipFile(file) as archive:
            members = archive.infolist()
            # Members that are stored cannot claim more bytes than the file has: reading them cannot fill the memory.
            if (
                any(member.compress_type != ZIP_STORED for member in members)
                or sum(member.file_size for member in members) > os.fstat(file.fileno()).st_size
            ):
                raise SpringfootError(f"{path} is no {kind}: it is compressed")
            arrays = {member.filename.removesuffix(".npy"): _array(archive.read(member)) for member in members}
        header = json.loads(str(arrays.pop(HEADER)))
        # The digest does not cover itself.
        digest = header.pop(DIGEST, None)
        unchanged = digest == digest_of(header, arrays)
    except SpringfootError:
        raise
    except BadZipFile as error:
        raise SpringfootError(f"{path} is no {kind}, or it is damaged: {error}") from None
    except _FAULTS as error:
        reason = f": {error.strerror}" if isinstance(error, OSError) and error.strerror else ""
        raise SpringfootError(f"{path} is no {kind}{reason}") from None
    if digest is None:
        raise SpringfootError(f"{path} has no digest: another version of springfoot wrote it; evaluate again")
    if not unchanged:
        raise SpringfootError(f"{path} is damaged: its contents are not those that were written")
    return header, arrays


def _array(content: bytes) -> NDArray:
    """Return the array in an .npy file's content.

    Raises `ValueError` for objects, another version of the format, a header that cannot be read, and one that claims
    more or less data than there is.
    """
    file = io.BytesIO(content)
    # NumPy's two versions of the format, each with its reader.
    read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}.get(npy.read_magic(file))
    if read_header is None:
        raise ValueError("another version of the format")
    try:
        shape, _, dtype = read_header(file)
    except (TokenError, SyntaxError, RecursionError) as error:
        raise ValueError(f"its header is not Python's: {error}") from None
    if dtype.hasobject or prod(shape) * dtype.itemsize != len(content) - file.tell():
        raise ValueError("not the bytes that its shape says")
    return np.load(io.BytesIO(content))
