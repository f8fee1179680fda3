"""A GRU of PyTorch, judged on people it has not seen, beside the network that ships."""

import numpy as np
from torch import Tensor, as_tensor, nn, optim

import orbtouch


class Gru(nn.Module):
    """Gated recurrent units over the images of a window, (n, window, rows, columns)."""

    def __init__(self) -> None:
        super().__init__()
        self.gru, self.last = nn.GRU(25, 48, batch_first=True), nn.Linear(48, 5)

    def fit(self, windows: np.ndarray, y: np.ndarray) -> None:
        """Learn windows and their classes, (n,)."""
        adam = optim.Adam(self.parameters(), 3e-3)
        for some in np.random.default_rng(0).integers(len(y), size=(400, 128)):
            adam.zero_grad()
            nn.CrossEntropyLoss()(self(windows[some]), as_tensor(y[some])).backward()
            adam.step()

    def forward(self, windows: np.ndarray) -> Tensor:
        """Return logits, (n, classes)."""
        return as_tensor(self.last(self.gru(20 * (1 - as_tensor(windows).flatten(2)))[0][:, -1]))

    def predict_proba(self, windows: np.ndarray) -> np.ndarray:
        """Return probabilities, (n, classes)."""
        return np.asarray(self(windows).softmax(1).detach())


people = [orbtouch.simulate(minutes=1, user=user) for user in range(3)]
mine, shipped = (orbtouch.evaluate(one, people) for one in (Gru(), orbtouch.load_network()))
print(mine, shipped, orbtouch.compare(mine, shipped), sep="\n\n")
