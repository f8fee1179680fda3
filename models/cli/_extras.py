"""Check for the optional packages of training: the [train] extra."""

from importlib.util import find_spec
from typing import Final

from controller.errors import how_to_install

# Module -> the name that pip knows it by.
PACKAGES: Final = {
    "torch": "torch",
    "tomli_w": "tomli-w",
    "jinja2": "jinja2",
    "matplotlib": "matplotlib",
    "sklearn": "scikit-learn",
    "joblib": "joblib",
    "distributed": "dask[distributed]",
}


def require(what: str, *modules: str, extra: str = "train") -> None:
    """Refuse to begin what cannot be finished on this machine.

    Args:
        what: What is going to be done: "training".
        modules: What it needs, of `PACKAGES`.
        extra: Which of pyproject.toml's extras holds them.

    Raises:
        ValueError: One is not installed; the message says how to get it.
    """
    missing = [PACKAGES[module] for module in modules if find_spec(module) is None]
    if missing:
        raise ValueError(
            f"{what} needs {' and '.join(missing)}; install it with: {how_to_install(extra)}"
        )
