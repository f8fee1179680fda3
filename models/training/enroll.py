"""People are enrolled: a bundle, and what tells them apart, become a bundle that knows them."""

from pathlib import Path
from typing import Any

import tomli_w

from controller import config, files, npz
from controller.bundles import bundle, users_table
from controller.recognition.mapping import USERS
from controller.recognition.user_id import Users
from models.training import export
from models.training.networks import GestureNet


def write(
    path: Path, out: Path, net: GestureNet, known: Users, said: str, mapping: Path | None = None
) -> None:
    """Write a bundle with its people; what it had for some of them already, it keeps.

    Args:
        path: The bundle to which they come.
        out: Where it is written.
        net: The user network.
        known: The people.
        said: What the card says of them.
        mapping: A mapping whose [users.NAME] are kept in the bundle, checked before.

    Raises:
        ValueError: It would be refused when it is read.
    """
    data = files.read_bytes(path, bundle.MAX_BYTES)
    base, parts = bundle.parse(data), bundle.unpack(data)
    table, content = bundle.manifest(parts[bundle.MANIFEST]), bundle.content(parts)
    part, _ = export.gesture_part(net, base.golden.windows)
    golden: dict[str, Any] = npz.unpack(content[bundle.GOLDEN], bundle.MAX_BYTES)
    heads = [name for name in base.users.heads if name in known.names]
    for name in base.users.heads:
        if name not in heads:  # who is not enrolled any more takes their network along
            golden.pop(f"head.{name}")
            content.pop(users_table.head_part(name))
    own = table.get("users", {}).get("mapping", {})
    if mapping is not None:
        for name, rules in config.read_toml(mapping).get(USERS, {}).items():
            own[name] = {**own.get(name, {}), **rules}
    table["users"] = {
        "names": list(known.names),
        "gestures": list(known.gestures),
        "temperature": known.temperature,
        "accept": known.accept,
        "stay": known.stay,
        "forget_s": known.forget_s,
        "heads": heads,
        "mapping": {name: rules for name, rules in own.items() if name in known.names},
    }
    table["card"]["users"] = said
    golden["people"] = part.answers
    content[users_table.NETWORK] = part.onnx
    content[bundle.GOLDEN] = npz.pack(golden)
    bundle.write(out, manifest=tomli_w.dumps(table).encode(), parts=content)
