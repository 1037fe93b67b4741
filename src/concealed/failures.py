"""Cases in which the tool falls short: in what, and what the data say of the cause."""

from concealed.summary import data_support_effects, predicts_like_truth


def failure(row: dict) -> str | None:
    """In what a case falls short, in words; None where it does not.

    A tool that ended with an error falls short in every case. An effect that is not plain may be
    missed. A plain effect outside the library must raise the alarm. Nothing may be established that
    is not there.
    """
    if row["verdict"] == "crashed":
        return "crashed"
    kind = row["kind"]
    if kind in ("none", "off"):
        return "false alarm" if row["wrong"] else None
    if kind == "outside":
        if row["wrong"]:
            return "misnamed"
        return "not noticed" if row["plain"] and not row["alarm"] else None
    if row["wrong"]:
        return "wrong name beside a right one" if row["effects_found"] else "wrong name"
    if kind == "pair":
        return None if row["effects_found"] == 2 else f"{row['effects_found']} of 2 effects named"
    if not row["right"]:
        return ("not noticed" if not row["alarm"] else "not named") if row["plain"] else None
    # an effect that cannot be told from another one may be at another element
    is_placed = kind == "indistinguishable" or all(row["places_right"])
    return None if is_placed else "wrong place"


def circumstance(row: dict) -> str:
    """What the row says of a failure's cause: evidence in the data, and the fit that was reached.

    It separates what no method can find in the data from what the search missed, and a wrong model
    that predicts as well as the true one from one that does not.
    """
    if row["verdict"] == "crashed":
        return "the tool ended with an error"
    said = []
    if row["oracle_log_evidence"] is not None:
        support = "support" if data_support_effects(row) else "do not support"
        said.append(f"data {support} the true effects")
    if row["oracle_held_out"] is not None:
        far = "like that" if predicts_like_truth(row) else "above that"
        said.append(f"held-out misfit {far} of the fit begun from the truth")
    return "; ".join(said) or "-"
