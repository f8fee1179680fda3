"""Read mapping files: gesture -> command, for all users and for single ones."""

from collections.abc import Sequence
from pathlib import Path

from controller import config, files
from controller.recognition.mapping import USERS, Mapping, MappingError, parse


def read(path: Path, labels: Sequence[str]) -> tuple[Mapping, dict[str, Mapping]]:
    """Return the mapping in a TOML file, for `--mapping`, and those of its [users.NAME].

    Raises:
        UserError: The file cannot be read, is no TOML, or its table cannot be used.
    """
    table = config.read_toml(path)
    users = table.pop(USERS, {})
    if not isinstance(users, dict) or not all(isinstance(own, dict) for own in users.values()):
        raise MappingError(f"{path}: [{USERS}] holds anything but a table for each name")
    mappings = []
    sections = {"": table, **{f"{USERS}.{name}": own for name, own in users.items()}}
    for section, rules in sections.items():
        try:
            mappings.append(parse(rules, labels))
        except MappingError as error:
            line = _line(path, section, error)
            raise MappingError(f"{path}{line}: {error} (docs/mapping.md)") from None
    return mappings[0], dict(zip(users, mappings[1:], strict=True))


def _line(path: Path, section: str, error: MappingError) -> str:
    """Return ", line N" of an error, "" if it cannot be found."""
    text = files.read_text(path, config.MAX_BYTES)
    named = f"{section}.{error.label}".strip(".")
    return config.line_of(text, named, count=error.rule or 1) or config.line_of(
        text, section, error.label
    )
