"""Mapping files: gesture -> command, for everybody and for single users."""

from collections.abc import Sequence
from pathlib import Path

from controller import config, files
from controller.recognition.mapping import USERS, Mapping, MappingError, parse


def read(path: Path, labels: Sequence[str]) -> tuple[Mapping, dict[str, Mapping]]:
    """Return the mapping in a TOML file, for `--mapping`, and people's own: its [users.NAME].

    Raises:
        UserError: The file cannot be read, is no TOML, or its table cannot be used.
    """
    table = config.read_toml(path)
    people = table.pop(USERS, {})
    if not isinstance(people, dict) or not all(isinstance(own, dict) for own in people.values()):
        raise MappingError(f"{path}: [{USERS}] holds anything but a table for each name")
    made = []
    sections = {"": table, **{f"{USERS}.{name}": own for name, own in people.items()}}
    for section, rules in sections.items():
        try:
            made.append(parse(rules, labels))
        except MappingError as error:
            where = _line(path, section, error)
            raise MappingError(f"{path}{where}: {error} (docs/mapping.md)") from None
    return made[0], dict(zip(people, made[1:], strict=True))


def _line(path: Path, section: str, error: MappingError) -> str:
    """Return ", line N" of what is wrong, "" if it cannot be found."""
    text = files.read_text(path, config.MAX_BYTES)
    named = f"{section}.{error.label}".strip(".")
    return config.line_of(text, named, count=error.rule or 1) or config.line_of(
        text, section, error.label
    )
