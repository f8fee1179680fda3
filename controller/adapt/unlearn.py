"""Forget taught gestures, or learn them anew, from the examples that a bundle carries.

The bundle before its first lesson is restored from its rehearsal part, and learns the remaining
examples again. So the result does not depend on what was forgotten.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
import tomli_w

from controller.adapt import head, rehearsal
from controller.adapt.examples import EVERYBODY, Example
from controller.adapt.few_shot import (
    GESTURE,
    AdaptedBundle,
    AdaptError,
    Progress,
    opened,
    run_network,
    teach,
)
from controller.adapt.rehearsal import Rehearsal
from controller.bundles import bundle as bundles
from controller.bundles import users_table
from controller.bundles.bundle import Bundle
from controller.bundles.inference import onnx_writer
from controller.recognition.mapping import NONE

CORRECTED: Final = "corrected in play: "  # begins the note of a correction
CHANGES: Final = "changes"  # entry of the card: number of changes since the training


def taught_labels(loaded: Bundle, known: Rehearsal) -> tuple[str, ...]:
    """Return the gestures that a bundle has learned from examples."""
    return loaded.labels[known.base[GESTURE][1] :] if GESTURE in known.base else ()


def learn(
    data: bytes,
    examples: Sequence[Example],
    command: str = "",
    note: str = "",
    progress: Progress = lambda share: None,
) -> AdaptedBundle:
    """Return a bundle extended by examples, in place of earlier ones of their labels and users.

    `command` is that of a gesture which the bundle was not trained with; "": nothing. The errors
    are those of `teach`.
    """
    loaded, _, known = opened(data)
    trained = set(loaded.labels).difference(taught_labels(loaded, known))
    # A gesture that the bundle was not trained with is for all users.
    fresh = {(one.label, one.user if one.label in trained else EVERYBODY) for one in examples}
    if not any((one.label, one.user) in fresh for one in known.taught):
        return teach(data, examples, command=command or None, note=note, progress=progress)
    return _again(
        data,
        lambda one: (one.label, one.user) not in fresh,
        examples,
        commands={label: command for label, _ in fresh if label not in trained},
        progress=progress,
    )


def forget(data: bytes, label: str, progress: Progress = lambda share: None) -> AdaptedBundle:
    """Return a bundle without a taught gesture, as if it had never been taught.

    Raises:
        AdaptError: The gesture was not taught, or by an older version of the program.
        BundleError: The bundle is damaged.
    """
    loaded, _, known = opened(data)
    if label not in taught_labels(loaded, known):
        raise AdaptError(f"{label!r} is no gesture that was taught, so it cannot be forgotten")
    return _again(data, lambda one: one.label != label, progress=progress)


def set_command(data: bytes, label: str, command: str, user: str = "") -> AdaptedBundle:
    """Return a bundle with another command of a gesture, "" nothing.

    With a user, only that user's mapping changes; with "" as the label it is removed.

    Raises:
        AdaptError, BundleError: It is not possible.
    """
    loaded, parts, _ = opened(data)
    if user and user not in loaded.users.names:
        raise AdaptError(f"there is no user {user!r}")
    if label not in loaded.labels[1:] and (label or not user):
        raise AdaptError(f"there is no gesture {label!r}")
    table = bundles.manifest(parts[bundles.MANIFEST])
    mappings = table["users"].setdefault("mapping", {}) if user else {"": table["mapping"]}
    if label:
        mappings.setdefault(user, {})[label] = command or NONE
    else:
        mappings.pop(user, None)
    return AdaptedBundle(_text(table), bundles.content(parts), 1.0, loaded.debounce)


def counted(adapted: AdaptedBundle) -> AdaptedBundle:
    """Return a bundle whose card counts one more change, so that no two in a row are equal."""
    table = bundles.manifest(adapted.manifest)
    before = table["card"].get(CHANGES, 0)
    table["card"][CHANGES] = before + 1 if isinstance(before, int) else 1
    return replace(adapted, manifest=_text(table))


def _again(
    data: bytes,
    remains: Callable[[Example], bool],
    fresh: Sequence[Example] = (),
    *,
    commands: Mapping[str, str] | None = None,
    progress: Progress,
) -> AdaptedBundle:
    """Return the bundle that the examples that remain and fresh ones make of its origin."""
    _, parts, known = opened(data)
    before = bundles.manifest(parts[bundles.MANIFEST])
    origin = _origin(parts, known)
    rest = [one for one in known.taught if remains(one)]
    examples = [*rest, *fresh]
    if examples:
        made = teach(origin, examples, progress=progress)
    else:
        _, own, _ = opened(origin)
        made = AdaptedBundle(own[bundles.MANIFEST], bundles.content(own), 1.0)
    table = bundles.manifest(made.manifest)
    commands = commands or {}
    rules = {k: rule for k, rule in before["mapping"].items() if k not in commands}
    rules |= {label: command for label, command in commands.items() if command}
    table["mapping"] |= {k: rule for k, rule in rules.items() if k in table["labels"]}
    if "users" in table:
        table["users"]["mapping"] = _own_rules(before, table)
    if CHANGES in before["card"]:
        table["card"][CHANGES] = before["card"][CHANGES]
    kept = {one.label for one in rest}
    notes = [n for n in before["card"].get("added", []) if _of_kept(str(n), kept)]
    table["card"].pop("added", None)
    if notes or fresh:
        again = sorted({f"{one.label} again" for one in fresh})
        table["card"]["added"] = [*notes, *again]
    return replace(made, manifest=_text(table))


def _own_rules(before: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Return the rules of single users before, as far as user and gesture are still there."""
    return {
        user: {label: rule for label, rule in own.items() if label in table["labels"]}
        for user, own in before.get("users", {}).get("mapping", {}).items()
        if user in table["users"]["names"]
    }


def _of_kept(note: str, kept: set[str]) -> bool:
    """Return whether a note of the card is of a label whose examples remain, or of the training."""
    label = note.removeprefix(CORRECTED) if note.startswith(CORRECTED) else note.partition(" ")[0]
    return label in kept or (label == "nothing" and "null" in kept)


def _origin(parts: Mapping[str, bytes], known: Rehearsal) -> bytes:
    """Return the bundle before its first lesson; AdaptError if it does not carry that."""
    if known.origin is None:
        raise AdaptError(
            "an older version taught this bundle, without a way back; use `controller install "
            "BUNDLE`"
        )
    table = bundles.manifest(known.origin.manifest)
    heads = tuple(table.get("users", {}).get("heads", ()))
    own = {"": GESTURE, **{name: users_table.head_part(name) for name in heads}}
    golden = bundles.parse(bundles.pack(parts)).golden
    windows = golden.windows[: known.origin.golden]
    content = {
        part: data
        for part, data in bundles.content(parts).items()
        if part in own.values() or not part.startswith("gesture-")
    }
    outputs = {}
    for name, part in own.items():
        if part in known.base:
            split = head.split(content[part], known.base[part])
            content[part] = onnx_writer.write(split.graph, width=split.classes)
        outputs[name] = run_network(content[part], windows)
    people = golden.people[: known.origin.golden]
    if "users" not in table:
        content.pop(users_table.NETWORK, None)
        people = np.zeros((0, 0), dtype=np.float32)
    golden = replace(
        golden, windows=windows, probabilities=outputs.pop(""), heads=outputs, people=people
    )
    content[bundles.GOLDEN] = golden.pack()
    content[rehearsal.PART] = replace(known, taught=(), base={}, origin=None).pack()
    return bundles.assembled(_text(table), content)


def _text(table: dict[str, Any]) -> bytes:
    return tomli_w.dumps(table).encode()
