"""An interactive learner over OSC: name what the orb feels, then see which name is nearest.

Start it, then `host --tap osc://127.0.0.1:9000`. Type a name and Enter while you touch the dome:
the next second of images are its examples. From then on the nearest name is printed when it
changes, and sent on as /wek/outputs to port 12000, as interactive machine-learning programs do.
"""

import sys
import threading

import numpy as np
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import ThreadingOSCUDPServer
from pythonosc.udp_client import SimpleUDPClient

PER_NAME = 40  # images: one second


class Learner:
    """Images with names; the nearest in Euclidean distance wins."""

    def __init__(self) -> None:
        """Begin without examples."""
        self.names: list[str] = []
        self.images: list[np.ndarray] = []
        self._wanted, self._name = 0, ""

    def teach(self, name: str) -> None:
        """Take the next `PER_NAME` images as examples of a name."""
        self._wanted, self._name = PER_NAME, name

    def hear(self, image: np.ndarray) -> str:
        """Take an image; return the name nearest to it, "" while there is none."""
        if self._wanted:
            self._wanted -= 1
            self.names.append(self._name)
            self.images.append(image)
        if not self.images:
            return ""
        return self.names[int(((np.stack(self.images) - image) ** 2).sum(axis=1).argmin())]


def main(port: int = 9000, out: int = 12000) -> None:
    """Listen on a port of this machine until standard input ends."""
    learner, client, shown = Learner(), SimpleUDPClient("127.0.0.1", out), [""]

    def frame(address: str, number: int, t_s: float, *z: float) -> None:
        name = learner.hear(np.array(z))
        if name != shown[0]:
            shown[0] = name
            client.send_message("/wek/outputs", float(learner.names.index(name)))
            print(name, flush=True)

    dispatcher = Dispatcher()
    dispatcher.map("/orbtouch/frame", frame)
    with ThreadingOSCUDPServer(("127.0.0.1", port), dispatcher) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        for line in sys.stdin:
            learner.teach(line.strip())
        server.shutdown()


if __name__ == "__main__":
    main()
