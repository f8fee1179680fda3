"""Commands of a bundle's gestures, for all users or a single one."""

import tomli_w

from controller.adapt.few_shot import AdaptedBundle, AdaptError, Progress
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.recognition.mapping import NONE
from controller.shared.notices import notice


def set_command(
    data: bytes, label: str, command: str, user: str = "", progress: Progress = lambda share: None
) -> AdaptedBundle:
    """Return a bundle with another command of a gesture, "" nothing.

    With a user, only that user's mapping changes; with "" as the label it is removed.

    Raises:
        AdaptError, BundleError: It is not possible.
    """
    loaded, parts = bundles.parse(data), container.unpack(data)
    if user and user not in loaded.users.names:
        raise AdaptError(notice("unknown_user", user))
    if label not in loaded.labels[1:] and (label or not user):
        raise AdaptError(notice("no_gesture", label))
    table = container.manifest(parts[container.MANIFEST])
    mappings = table["users"].setdefault("mapping", {}) if user else {"": table["mapping"]}
    if label:
        mappings.setdefault(user, {})[label] = command or NONE
    else:
        mappings.pop(user, None)
    progress(1.0)
    return AdaptedBundle(tomli_w.dumps(table).encode(), container.content(parts))
