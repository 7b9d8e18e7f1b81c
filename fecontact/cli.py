"""Command line: its commands, and its exit codes; no large module is imported before its use."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from cyclopts import (
    App,
    CoercionError,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    UnknownOptionError,
    UnusedCliTokensError,
)

from fecontact import __version__, feature_registry
from fecontact.commands import looking, mapping, results, solving, start
from fecontact.console.help_pages import find_help_page
from fecontact.console.options import refuse_fractions
from fecontact.console.streams import escaping_output
from fecontact.errors import FecontactError, InputError, is_memory_shortage, shorten_words
from fecontact.inputs.texts import escape_line, explain_former_name
from fecontact.process import collect_rarely, limit_dense_threads

app = App(
    name="fecontact",
    # `call` prints the state that an interrupted command leaves
    suppress_keyboard_interrupt=False,
    version=__version__,
    # options have no second form with --no-
    default_parameter=Parameter(negative=()),
    config=(refuse_fractions,),
    group_commands=Group("Options", sort_key=9),
    help="Where does Hertz's ellipse hold for a railway wheel on a rail?",
    help_epilogue="Exit codes: 0 success; 1 results differ (compare) or a check fails (validate, doctor); 2 bad input;"
    " 3 a case did not converge or could not be solved; 4 an error of the program (run, map, fleet).",
)
_START, _LOOK, _SOLVE, _AFTER, _DEVELOPMENT = (
    Group(name, sort_key=place) for place, name in enumerate(("Start", "Look", "Solve", "After", "Development"))
)
for group, commands in {
    _START: (mapping.demo, start.guide, start.doctor, start.init, start.check),
    _LOOK: (
        *(looking.profiles, looking.place, looking.hertz, looking.geometry),
        *(looking.theories, looking.theory, looking.table),
    ),
    _SOLVE: (solving.solve, solving.run, mapping.map_),
    _AFTER: (results.judge, results.compare, results.view, looking.mesh, looking.keys),
    _DEVELOPMENT: (solving.validate,),
}.items():
    for sort_key, command in enumerate((*commands, *feature_registry.load_commands(group.name))):
        if isinstance(command, App):
            # the command has subcommands
            command.group, command.sort_key = (group,), sort_key
            app.command(command)
        else:
            app.command(command, name=command.__name__.rstrip("_"), group=group, sort_key=sort_key)
baseline_app = App(
    name="baseline", help="Manage baselines: stored results with which later results are compared.", group=_DEVELOPMENT
)
baseline_app.command(results.baseline_update, name="update")
app.command(baseline_app)
app.register_install_completion_command(help="Install tab completion for this shell, and print its file.")


def run_script(path: str) -> None:
    """Run a study script as a program: `python studies/NAME.py [--out DIR] [--quick]`; ends the process.

    Parameters
    ----------
    path
        Path of the script.
    """
    script_arguments = sys.argv[1:]
    if "--out" not in script_arguments and "--help" not in script_arguments:
        script_arguments += ["--out", f"out/{Path(path).stem}"]
    main(["run", path, *script_arguments])


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of the program `fecontact`.

    Parameters
    ----------
    arguments
        Words of the command; the arguments of the process if not given.
    """
    # a job queue ends a program with SIGTERM: its workers end with it, as with Ctrl-C
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    collect_rarely()
    limit_dense_threads()
    sys.exit(call(arguments))


_REMEDIES = {
    errno.ENOSPC: "free disk space, or choose a folder on another disk",
    errno.EDQUOT: "free disk space, or choose a folder on another disk",
    errno.EMFILE: "allow more open files, for example with ulimit -n 1024",
    errno.ENFILE: "close programs that have many files open",
    errno.ENAMETOOLONG: "choose a shorter path",
    errno.ENOMEM: "close other programs, or use fewer --workers",
}

_NO_WORKING_FOLDER_TEXT = "the working folder no longer exists; change to an existing folder"


def _print_error(message: str) -> None:
    """Print an error.

    Characters that move the cursor or turn the text, which names may have, are printed as escapes.
    """
    print(f"error: {escape_line(shorten_words(message))}", file=sys.stderr)


def _has_working_folder() -> bool:
    try:
        Path.cwd()
    except OSError:
        return False
    return True


def _system_error(error: OSError) -> str:
    """Describe the refusal of the system, with the remedy."""
    if "cannot open shared object file" in str(error):
        return f"a system library is missing ({error}); `fecontact doctor` names the package to install"
    description = f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or error}"
    if not _has_working_folder():
        return f"{description}; {_NO_WORKING_FOLDER_TEXT}"
    if remedy := _REMEDIES.get(error.errno or 0, ""):
        return f"{description}; {remedy}"
    if error.filename:
        return f"{description}; choose another file or folder"
    # locks between processes have no file name in the error
    return f"{description}; workers need write access to /dev/shm and to the temporary folder (TMPDIR)"


def _describe_wrong_command(error: CycloptsError) -> str:
    """Describe the error in the words of a command."""
    command = " ".join(("fecontact", *(error.command_chain or ())))
    # a message that suggests another option is right as it is
    if isinstance(error, MissingArgumentError) and error.argument and "Did you mean" not in str(error):
        # positional arguments are written as in the help
        is_positional = error.argument.field_info.is_positional
        name = error.argument.name.removeprefix("--").upper() if is_positional else error.argument.name
        description = f"{error.keyword} has no value" if error.keyword else f"{name} is missing"
        return f"{description}; see {command} --help"
    if isinstance(error, UnknownOptionError):
        name = (error.token.keyword or error.token.value or "").removeprefix("--")
        known_names = {known_name for argument in error.argument_collection for known_name in argument.names}
        body_options = [f"--{body}-{name}" for body in ("rail", "wheel") if f"--{body}-{name}" in known_names]
        if body_options:
            return f"--{name} is not an option; use the option of a body: {' or '.join(body_options)}"
        return explain_former_name(name.replace("-", "_")) or str(error)
    if isinstance(error, CoercionError) and error.target_type is bool and error.token:
        return f"{error.token.keyword} is a flag without a value; leave out {error.token.value}"
    if isinstance(error, UnusedCliTokensError):
        unused = " ".join(error.unused_tokens or ())
        if unused.endswith(".json"):
            return f"{unused}: --json is a flag without a value; to write a file: --json > {unused}"
        return f"{unused}: {command} takes no such argument; write each value after its option; see {command} --help"
    return str(error)


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Parameters
    ----------
    arguments
        Words of the command; the arguments of the process if not given.

    Returns
    -------
    int
        Exit code.

    """
    if sys.stdout is None:
        # standard output was closed before the program began: the output is discarded
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        # a terminal without a character shows a question mark in its place
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    with escaping_output():
        return _run(sys.argv[1:] if arguments is None else arguments)


def _run(words: Sequence[str]) -> int:
    """Run a command; returns its exit code."""
    try:
        if "\0" in "".join(words):
            # no shell can give a NUL character, and no file name can have it
            raise InputError("a word of the command has a NUL character; allowed: all other characters; leave it out")
        if not _has_working_folder():
            # NumPy 2.5 cannot be imported there: its import ends in a SystemError that names no folder
            raise InputError(_NO_WORKING_FOLDER_TEXT)
        page = find_help_page(app, words)
        app.help_formatter = page
        code: Any = app(
            words if page is None else page.tokens,
            exit_on_error=False,
            print_error=False,
            result_action="return_value",
        )
        if page and page.pointer:
            print(page.pointer)
        # a closed reader is noticed here, and not at the end of the interpreter
        sys.stdout.flush()
        return int(code or 0)
    except CycloptsError as error:
        _print_error(_describe_wrong_command(error))
        return InputError.exit_code
    except FecontactError as error:
        _print_error(str(error))
        return error.exit_code
    except (BrokenPipeError, SystemExit):
        # rich ends the program if its reader has closed. A reader such as `head` has enough, so nothing more is
        # written, also not at the end of the interpreter.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        _print_error(_system_error(error))
        return InputError.exit_code
    except (MemoryError, ImportError) as error:
        if not is_memory_shortage(error):
            raise
        _print_error("not enough memory; close other programs, use fewer --workers, or raise the limit with ulimit -v")
        return InputError.exit_code
    except KeyboardInterrupt as error:
        # notes of the exception name the jobs that are kept
        print("; ".join(("interrupted", *getattr(error, "__notes__", ()))), file=sys.stderr)
        return 130
