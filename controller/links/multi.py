"""Several links at a time, such as rfcomm:+hid: for a laptop and a television.

Every message is sent on all of them. The combined session begins when the first host connects, and
ends when the last one disconnects.
"""

from __future__ import annotations

from collections.abc import Sequence

from controller.links import module_of, split
from controller.links.base import Access, Link, LinkError
from controller.shared.protocol.messages import Bye, Contacts, Hello, Message, Welcome

POLL_S = 0.05  # greatest delay of a request on any link but the first


def create(url: str, welcome: Welcome, access: Access) -> MultiLink:
    """Open all links, or none; LinkError if one cannot be opened."""
    urls = split(url)
    if repeated := next((each for each in urls if urls.count(each) > 1), ""):
        raise LinkError(f"{repeated} stands twice in {url}; name each link once")
    links: list[Link] = []
    try:
        for each in urls:
            links.append(module_of(each).create(each, welcome, access))  # noqa: PERF401
    except BaseException:
        for link in links:
            link.close()
        raise
    return MultiLink(links)


class MultiLink(Link):
    """Several open links as one."""

    def __init__(self, links: Sequence[Link]) -> None:
        self.links = tuple(links)
        self.url = next((link.url for link in links if link.url), "")
        touchable = [link for link in links if link.touchable]
        self.touchable = bool(touchable)
        self.authenticated = self.touchable and all(link.authenticated for link in touchable)

    @property
    def dropped(self) -> int:
        """Number of messages not sent, on links with a host; on all if none has one."""
        hosts = [link for link in self.links if link.connected] or self.links
        return sum(link.dropped for link in hosts)

    @property
    def connected(self) -> bool:
        """Whether any of the links has a host."""
        return any(link.connected for link in self.links)

    def send(self, message: Message, t_ms: int) -> None:
        """Send on all links."""
        for link in self.links:
            link.send(message, t_ms)

    def poll(self) -> list[Message]:
        """Return requests: Hello when the first host connects, Bye when the last disconnects.

        The Hello of a later host is dropped unless it grants time; the Bye of an earlier one
        becomes empty Contacts.
        """
        requests: list[Message] = []
        for link in self.links:
            others = any(other.connected for other in self.links if other is not link)
            for request in link.poll():
                if isinstance(request, Bye) and others:
                    requests.append(Contacts(()))
                elif not isinstance(request, Hello) or request.granted or not others:
                    requests.append(request)
        return requests

    def wait(self, timeout_s: float) -> None:
        """Return when `poll` may have requests, or after the timeout."""
        self.links[0].wait(min(timeout_s, POLL_S))

    def pair(self, seconds: int) -> None:
        """Allow new hosts to pair for a while, on every link with pairing."""
        for link in self.links:
            link.pair(seconds)

    def renew(self, welcome: Welcome, reason: str) -> None:
        """Replace the description of the device on all links."""
        for link in self.links:
            link.renew(welcome, reason)

    def close(self) -> None:
        """Close all links, the last one first."""
        for link in reversed(self.links):
            link.close()
