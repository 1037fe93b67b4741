"""Seals: the truth of a case, encrypted until the verdicts are committed.

A seal can be shown to anyone. It holds the truth encrypted and a commitment to it; the key lies in
another file, for the scoring alone. The cipher is AES-256-GCM (NIST SP 800-38D): it also detects
every change of the seal, the commitment included. The commitment is SHA-256 of the plaintext, which
begins with random bytes: without them a guessed truth could be compared with the commitment. Truths
are filled up with blanks, so that their length tells nothing.
"""

import hashlib
import json
import secrets
from pathlib import Path

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

_KEY_BITS = 256
_NONCE_BYTES = 12  # the length for which GCM uses the nonce as it is
_BLINDING_BYTES = 32
_PADDED_BYTES = 2**15  # to a multiple: a ciphertext is as long as what it hides


class SealError(ValueError):
    """A seal that cannot be opened: wrong key, altered, malformed or not the truth committed to."""


def new_key() -> bytes:
    """A key for one seal, from the operating system's random numbers."""
    return AESGCM.generate_key(_KEY_BITS)


def seal(truth: dict, key: bytes) -> dict:
    """Encrypt `truth` (plain data): hexadecimal `nonce`, `sealed` and `commitment`.

    Use a key for one seal only.
    """
    text = json.dumps(truth, sort_keys=True).encode()
    text += b" " * (-len(text) % _PADDED_BYTES)
    plain = secrets.token_bytes(_BLINDING_BYTES) + text
    commitment, nonce = hashlib.sha256(plain).digest(), secrets.token_bytes(_NONCE_BYTES)
    return {
        "nonce": nonce.hex(),
        "sealed": AESGCM(key).encrypt(nonce, plain, commitment).hex(),
        "commitment": commitment.hex(),
    }


def open_seal(sealed: dict, key: bytes) -> dict:
    """The truth in a seal; raises SealError where it cannot be opened."""
    try:
        nonce, hidden, commitment = (
            bytes.fromhex(sealed[name]) for name in ("nonce", "sealed", "commitment")
        )
        plain = AESGCM(key).decrypt(nonce, hidden, commitment)
    except InvalidTag:
        raise SealError("the key does not fit, or the seal was altered") from None
    except (KeyError, TypeError, ValueError) as error:
        raise SealError(f"not a seal with its key: {error!r}") from None
    if hashlib.sha256(plain).digest() != commitment:
        raise SealError("the truth is not the one committed to")
    return json.loads(plain[_BLINDING_BYTES:])


def open_seal_file(seal_file: str | Path, key_file: str | Path) -> dict:
    """The truth in a seal's file; raises SealError naming both files where it cannot
    be opened, and OSError for a file that cannot be read."""
    try:
        return open_seal(json.loads(Path(seal_file).read_text()), Path(key_file).read_bytes())
    except ValueError as error:
        raise SealError(f"{seal_file} with key {key_file}: {error}") from None
