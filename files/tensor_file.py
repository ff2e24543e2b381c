"""Read and write tensors with a JSON header in one .safetensors file; a digest of both finds damage.

A digest finds changes by a disk or a copy, down to one bit. It is no signature: a forger can write a fitting one.
"""

import json
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as to_safetensors

from springfoot.errors import SpringfootError, quoted

from .text_table import existing, read_bytes
from .writing import write_atomically

DIGEST = "sha256"
"""Name of the digest among the entries of the header."""
MOST_TENSOR_BYTES, MOST_HEADER = 2**27, 2**24
"""Largest file, and largest header in it, to read or write [bytes]; chosen, hundreds of times the usual sizes."""


def write_tensors(path: Path, key: str, header: dict[str, Any], tensors: Mapping[str, np.ndarray]) -> None:
    """Write tensors and, under `key`, a JSON header, whole or not at all; equal contents give equal bytes.

    Raises `SpringfootError` for a file that would be too large to read, and the errors that `json` raises for another
    header.
    """
    json.dumps(header, allow_nan=False)  # raises for values that are no JSON
    packed = {name: np.asarray(tensor, order="C") for name, tensor in tensors.items()}
    text = _text(header | {DIGEST: digest_of(header, packed)})  # one entry: safetensors has no order of several
    content = to_safetensors(packed, {key: text})
    if len(content) > MOST_TENSOR_BYTES or len(text) > MOST_HEADER:
        raise SpringfootError(f"{path} must have at most {MOST_TENSOR_BYTES:,} bytes, would have {len(content):,}")
    write_atomically(path, content)


def read_tensors(
    path: Path, key: str, kind: str, entries: AbstractSet[str], finite: bool = True, needs_digest: bool = False
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the JSON under `key` of a .safetensors header, and the tensors.

    Args:
        path: of the file.
        key: of the header's JSON text.
        kind: name of such a file, in messages.
        entries: allowed entries of the JSON.
        finite: refuse all numbers but finite float32 and float64.
        needs_digest: refuse a file without a digest; files of earlier versions have none.

    Raises `SpringfootError` for any other file.
    """
    try:
        if (size := existing(path).stat().st_size) > MOST_TENSOR_BYTES:
            raise SpringfootError(f"{path} must have at most {MOST_TENSOR_BYTES:,} bytes, has {size:,}")
        # A .safetensors file begins with the size of its header, as 8 bytes.
        with path.open("rb") as opened:
            if (header_size := int.from_bytes(opened.read(8), "little")) > MOST_HEADER:
                raise SpringfootError(
                    f"{path} is not a .safetensors file: its header would have {header_size:,} bytes, at most "
                    f"{MOST_HEADER:,} are read"
                )
        with safe_open(path, framework="numpy") as file:
            text = (file.metadata() or {}).get(key)
            if text is None:
                raise SpringfootError(f"{path} is a .safetensors file, but no springfoot {kind}")
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        header = json.loads(text)
    except SpringfootError:
        raise
    except (SafetensorError, OSError, TypeError, AttributeError) as error:  # the last two: types NumPy lacks (bfloat16)
        raise SpringfootError(f"{path} is not a .safetensors file: {error}") from None
    except (ValueError, RecursionError) as error:
        raise SpringfootError(f"{path}: the springfoot entry of its header is not JSON: {error}") from None
    if not isinstance(header, dict):
        raise SpringfootError(f"{path}: the springfoot entry of its header is not a JSON object")
    if unknown := sorted(header.keys() - entries - {DIGEST}):
        raise SpringfootError(f"{path} is damaged: its header has an entry {quoted(unknown[0])}")
    if DIGEST in header:
        same_text = text == _text(header)  # a change of blanks would not change the digest
        if header.pop(DIGEST) != digest_of(header, tensors) or not same_text:
            raise SpringfootError(f"{path} is damaged: its contents are not those that were written")
    elif needs_digest:
        raise SpringfootError(f"{path} is damaged or was changed: it has no {DIGEST}")
    for tensor_name, tensor in tensors.items() if finite else ():
        if tensor.dtype not in (np.float32, np.float64) or not np.isfinite(tensor).all():
            raise SpringfootError(f"{path}: {tensor_name} must be finite float32 or float64 numbers")
    return header, tensors


def _text(header: Mapping[str, Any]) -> str:
    """Return a header as JSON; equal headers give equal text."""
    return json.dumps(header, sort_keys=True)


def digest_of_file(path: Path) -> str:
    """Return the SHA-256 digest of a file's bytes."""
    return sha256(read_bytes(path, MOST_TENSOR_BYTES)).hexdigest()


def digest_of(header: Mapping[str, Any], tensors: Mapping[str, np.ndarray]) -> str:
    """Return the digest of a JSON header and of arrays, with their names, types and shapes, in any order."""
    digest = sha256(_text(header).encode())
    for name in sorted(tensors):
        digest.update(f"\n{name} {tensors[name].dtype.str} {tensors[name].shape}\n".encode())
        digest.update(np.ascontiguousarray(tensors[name]).data)
    return digest.hexdigest()
