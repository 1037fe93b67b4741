"""Sealing the truth of a case until the verdicts are in.

A seal is a file that may be shown to anyone: the truth encrypted, and a commitment to it. Its key
lies in another file, for the scoring alone. The cipher is a keystream from keyed BLAKE2b in counter
mode, authenticated by keyed BLAKE2b over the ciphertext (encrypt, then authenticate). The
commitment is SHA-256 of a random nonce and the truth; the nonce is part of what is encrypted, so
that nobody can guess truths and compare.
"""

import hashlib
import hmac
import json
import secrets

_NONCE = 32


def new_key() -> bytes:
    """A key for one seal, from the operating system's randomness."""
    return secrets.token_bytes(32)


def seal(truth: dict, key: bytes) -> dict:
    """Encrypt `truth` (plain data) with a key that is used once: `sealed`, `tag`, `commitment`."""
    plain = secrets.token_bytes(_NONCE) + json.dumps(truth, sort_keys=True).encode()
    sealed = _stream(plain, key)
    return {
        "sealed": sealed.hex(),
        "tag": _tag(sealed, key),
        "commitment": hashlib.sha256(plain).hexdigest(),
    }


def open_seal(sealed: dict, key: bytes) -> dict:
    """The truth in a seal; raises ValueError for a wrong key or a seal that was changed."""
    hidden = bytes.fromhex(sealed["sealed"])
    if not hmac.compare_digest(_tag(hidden, key), sealed["tag"]):
        raise ValueError("the key does not fit, or the seal was changed")
    plain = _stream(hidden, key)
    if hashlib.sha256(plain).hexdigest() != sealed["commitment"]:
        raise ValueError("the truth is not the one committed to")
    return json.loads(plain[_NONCE:])


def _stream(text: bytes, key: bytes) -> bytes:
    """`text` xor the keystream; its own inverse."""
    count = -(-len(text) // 64)
    stream = b"".join(
        hashlib.blake2b(k.to_bytes(8, "big"), key=key, person=b"stream").digest()
        for k in range(count)
    )
    return bytes(a ^ b for a, b in zip(text, stream, strict=False))


def _tag(hidden: bytes, key: bytes) -> str:
    return hashlib.blake2b(hidden, key=key, person=b"tag").hexdigest()
