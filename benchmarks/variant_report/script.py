"""Common code of scripts that turn JSON into files."""

import argparse
import os
import sys
import tempfile

from .json_file import InputError


class Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(2, f"{self.prog}: {message} (see --help)\n")


def run_script(name, work):
    """@return the exit status. If work() raises InputError: 1, and the message on standard error."""
    try:
        work()
    except InputError as error:
        print(f"{name}.py: {error}", file=sys.stderr)
        return 1
    return 0


def write_together(name, folder, write):
    """Calls write(FOLDER) with a temporary folder and moves its files when all are written. name: the script's."""
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=folder) as work:
            write(work)
            names = sorted(os.listdir(work))
            for name in names:
                if os.path.isdir(os.path.join(folder, name)):
                    raise InputError(f"{os.path.join(folder, name)}: cannot be written: a folder has that name")
            for name in names:
                os.replace(os.path.join(work, name), os.path.join(folder, name))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from error
