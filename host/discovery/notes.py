"""Notes of what a search found, in the device store."""

from datetime import UTC, datetime

from host.connection.device_store import DeviceStore
from host.discovery.probe import Answer


def note(memory: DeviceStore, answers: list[Answer]) -> None:
    """Remember where devices are; one that two ports claim to be stays where it was."""
    seen = now()
    for answer in answers:
        if answer.outcome == "orb" and len(claiming(answers, answer.device_id)) == 1:
            memory.remember(
                answer.device_id,
                name=answer.name,
                virtual=answer.virtual,
                port=answer.url,
                seen=seen,
            )


def now() -> str:
    """Return the time, as settings note it."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def claiming(answers: list[Answer], device_id: str) -> list[str]:
    """Return the ports that claim to be a device's."""
    return [a.url for a in answers if a.outcome == "orb" and a.device_id == device_id]
