"""The command `orbtouch`: hand each verb over to the program that has it."""

import sys

from controller import importing


def main(argv: list[str] | None = None) -> int:
    """Run a verb; return its exit status: 0 success, 1 trouble, 2 wrong usage, 130 interrupted."""
    words = [*(sys.argv[1:] if argv is None else argv)] or ["play"]
    with importing():
        from importlib import import_module

        from controller.shared import errors
        from orbtouch import cli

        if words[0] in ("-h", "--help", "--version"):
            return errors.run("orbtouch", lambda: cli.show(words[0]))
        name, rest = ("play", words) if words[0].startswith("-") else (words[0], words[1:])
        try:
            verb = cli.find(name)
        except errors.UserError as error:
            return errors.complain("orbtouch", error, error.status)
        program = import_module(verb.program)
    status: int = program.main([*verb.words, *rest])
    return status


if __name__ == "__main__":
    sys.exit(main())
