"""Seals of concealed cases: what opens them and what they refuse."""

import json

import pytest

from virtualrig.seal import SealError, new_key, open_seal, open_seal_file, seal

TRUTH = {"kind": "none", "effects": [], "length": 7.3}


@pytest.fixture
def key():
    return new_key()


def altered(text):
    """Hexadecimal text with one bit of its first byte flipped."""
    return f"{int(text[:2], 16) ^ 1:02x}{text[2:]}"


def test_the_key_opens_the_seal_and_the_seal_shows_nothing(key):
    """The truth comes back as it was, and no word of it can be read in the seal."""
    sealed = seal(TRUTH, key)
    assert open_seal(sealed, key) == TRUTH
    assert "none" not in json.dumps(sealed)


def test_the_length_of_a_seal_tells_nothing(key):
    """A truth with effects is no longer than one without."""
    effects = [{"name": "leak", "element": "position", "position": 3.21}] * 2
    longer = TRUTH | {"kind": "pair", "effects": effects}
    sizes = {len(seal(truth, key)["sealed"]) for truth in (TRUTH, longer)}
    assert len(sizes) == 1 and open_seal(seal(longer, key), key) == longer


def test_equal_truths_give_different_seals(key):
    """Neither ciphertext nor commitment allows a guessed truth to be compared."""
    first, second = seal(TRUTH, key), seal(TRUTH, key)
    assert all(first[name] != second[name] for name in first)


def test_another_key_is_refused(key):
    """A fresh key does not open the seal; the message names the two possible causes."""
    with pytest.raises(SealError, match="key does not fit, or the seal was altered"):
        open_seal(seal(TRUTH, key), new_key())


@pytest.mark.parametrize("part", ["nonce", "sealed", "commitment"])
def test_one_flipped_bit_is_refused(key, part):
    """Every part of a seal is authenticated."""
    sealed = seal(TRUTH, key)
    with pytest.raises(SealError, match="altered"):
        open_seal(sealed | {part: altered(sealed[part])}, key)


def test_a_commitment_to_another_truth_is_refused(key):
    """A sealer who commits to one truth and encrypts another is found out, though the seal is
    authentic: made here by encrypting with the other truth's commitment."""
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM

    nonce, other = bytes(12), bytes(32)
    hidden = AESGCM(key).encrypt(nonce, bytes(32) + json.dumps(TRUTH).encode(), other)
    forged = {"nonce": nonce.hex(), "sealed": hidden.hex(), "commitment": other.hex()}
    with pytest.raises(SealError, match="not the one committed to"):
        open_seal(forged, key)


@pytest.mark.parametrize(
    "sealed, key_bytes",
    [({}, bytes(32)), ({"nonce": 1, "sealed": "", "commitment": ""}, bytes(32)),
     ({"nonce": "zz", "sealed": "", "commitment": ""}, bytes(32)),
     ({"nonce": "00" * 12, "sealed": "00" * 40, "commitment": "00" * 32}, b"short")],
)  # fmt: skip
def test_what_is_no_seal_or_no_key_is_refused(sealed, key_bytes):
    """Missing fields, fields of a wrong type, text that is not hexadecimal, a short key."""
    with pytest.raises(SealError, match="not a seal"):
        open_seal(sealed, key_bytes)


def test_a_file_that_cannot_be_opened_is_named(tmp_path, key):
    """The error names the seal and the key; the right key opens the same file."""
    sealed, wrong = tmp_path / "003.json", tmp_path / "wrong"
    sealed.write_text(json.dumps(seal(TRUTH, key)))
    wrong.write_bytes(new_key())
    with pytest.raises(SealError, match=r"003\.json with key .*wrong: the key does not fit"):
        open_seal_file(sealed, wrong)
    wrong.write_bytes(key)
    assert open_seal_file(sealed, wrong) == TRUTH
    sealed.write_text("{")
    with pytest.raises(SealError, match=r"003\.json"):
        open_seal_file(sealed, wrong)
