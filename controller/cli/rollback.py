"""`controller rollback`: take the previous bundle into use."""

import argparse
from collections.abc import Sequence

from controller.bundles.bundle import BundleError
from controller.bundles.deploy.store import BundleStore, shown_name
from controller.errors import TROUBLE, complain, reason


def main(argv: Sequence[str]) -> int:
    """Run `controller rollback` and return its exit status."""
    argparse.ArgumentParser(
        prog="controller rollback",
        description="Take the previous bundle into use; a second rollback restores the newer one.",
    ).parse_args(argv)
    store = BundleStore()
    try:
        record = store.rollback()
    except BundleError as error:
        return complain("controller", error, TROUBLE)
    except OSError as error:
        return complain("controller", f"{store.folder} cannot be written: {reason(error)}", TROUBLE)
    print(f"{shown_name(record.current)} is in use; {shown_name(record.previous)} is kept")
    return 0
