"""`controller rollback`: take the bundle of before into use."""

import argparse
from collections.abc import Sequence

from controller.bundles.bundle import BundleError
from controller.bundles.deploy.store import BundleStore, shown_name
from controller.console import TROUBLE, complain
from controller.errors import reason


def main(argv: Sequence[str]) -> int:
    """Run `controller rollback` and return its exit status."""
    argparse.ArgumentParser(
        prog="controller rollback",
        description="Take the bundle of before into use; run again, it brings the newer one back.",
    ).parse_args(argv)
    shelf = BundleStore()
    try:
        record = shelf.rollback()
    except BundleError as error:
        return complain("controller", error, TROUBLE)
    except OSError as error:
        return complain("controller", f"{shelf.folder} cannot be written: {reason(error)}", TROUBLE)
    print(f"{shown_name(record.current)} is in use; {shown_name(record.previous)} is kept")
    return 0
