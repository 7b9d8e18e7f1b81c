"""The command line: which commands there are, and what an exit code says; nothing heavy is imported before its use."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from cyclopts import App, CycloptsError

from fecontact import __version__
from fecontact.commands import analytic, bodies, curve, results, solving, start
from fecontact.errors import FecontactError, InputError

app = App(
    name="fecontact",
    # it is said below what an interrupted command leaves
    suppress_keyboard_interrupt=False,
    version=__version__,
    help="Where does Hertz's ellipse hold for a railway wheel on a rail?",
    help_epilogue="Exit codes: 0 solved, or the same; 1 results differ (compare); 2 bad input;"
    " 3 a case did not converge or could not be solved.",
)
for command in (
    *(start.demo, start.check, start.init, start.doctor),
    *(solving.solve, solving.run, solving.validate),
    *(results.judge, results.view, results.compare),
    *(analytic.hertz, analytic.creep, analytic.place, analytic.geometry),
    *(bodies.profiles, bodies.mesh),
    curve.curve,
):
    app.command(command)
app.command(solving.map_, name="map")
baseline_app = App(name="baseline", help="Baselines: the results that later ones are held against.")
baseline_app.command(results.baseline_update, name="update")
app.command(baseline_app)
app.register_install_completion_command(help="Install completion for this shell, and say where.")


def run_script(path: str, arguments: Sequence[str] | None = None) -> None:
    """Run a study script as a program: `python studies/NAME.py [--out DIR] [--quick]`; ends the process."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "--out" not in given and "--help" not in given:
        given += ["--out", f"out/{Path(path).stem}"]
    main(["run", path, *given])


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of the program `fecontact`."""
    sys.exit(call(arguments))


def _system_error(error: OSError) -> str:
    """What the system refused, and what to do."""
    if "cannot open shared object file" in str(error):
        return f"a system library is missing ({error}); `fecontact doctor` says which package has it"
    return f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or error}; choose another file or folder"


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        # a terminal without some sign shows a question mark for it
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code: Any = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        # here a reader that is gone is noticed, and not at the interpreter's end
        sys.stdout.flush()
        return int(code or 0)
    except CycloptsError as error:
        print(f"error: {error}", file=sys.stderr)
        return InputError.exit_code
    except FecontactError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        # whoever reads has enough, as `head` does; nothing more is written, also not at the interpreter's end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        print(f"error: {_system_error(error)}", file=sys.stderr)
        return InputError.exit_code
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        return 130
