"""The README as it is pasted into a fresh clone, in its order."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from test_documents import ROOT, TEXTS, fenced, not_printed

README = TEXTS["README.md"]
TYPED = {"console": "{}", "python": "python - <<'END'\n{}END\n"}


def clone(folder: Path) -> Path:
    """The files of this repository as they would be committed, with an environment of its packages.

    The environment uses the packages of the running Python. `make setup` accepts it as its result, so that nothing is
    downloaded.
    """
    try:
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no clone of the repository")
    for name in filter(None, listed.split("\0")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    subprocess.run([sys.executable, "-m", "venv", folder / ".venv"], check=True)
    site = next((folder / ".venv" / "lib").glob("python*/site-packages"))
    (site / "clone.pth").write_text(f"{folder}\n{sysconfig.get_path('purelib')}\n", "utf-8")
    program = folder / ".venv" / "bin" / "fecontact"
    # as pip writes it where a path has blanks
    program.write_text(f'#!/bin/sh\nexec "{folder}/.venv/bin/python" -m fecontact "$@"\n', "utf-8")
    program.chmod(0o755)
    for name in (".created", ".installed"):
        (folder / ".venv" / name).touch()
    return folder


@pytest.mark.slow
def test_all_that_the_readme_shows_can_be_pasted_into_a_fresh_clone(tmp_path):
    """Paste the commands of the README in their order.

    `make demo` prints the lines of the README; numbers may differ by the effect of another mesh.
    """
    folder = clone(tmp_path / "a clone")
    blocks = re.findall(r"^```(console|python)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert {language for language, _ in blocks} == {*TYPED}
    code = "set -e\n" + "".join(f"echo '== block'\n{TYPED[language].format(block)}" for language, block in blocks)
    variables = ("PATH", "HOME", "LANG", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {name: os.environ[name] for name in variables if name in os.environ}
    # MKL is looked for in the environment that pip put it into
    for mkl in (Path(sys.prefix) / "lib").glob("libmkl_rt.so*"):
        environment["PYPARDISO_MKL_RT"] = str(mkl)
    process = subprocess.run(
        ["bash", "-c", code], cwd=folder, env=environment, capture_output=True, text=True, timeout=3000
    )
    assert process.returncode == 0, process.stdout[-3000:] + process.stderr[-3000:]
    demo = process.stdout.split("== block\n")[1]
    (example,) = fenced(README, "text")
    assert not_printed(example, demo) == []
    files = [
        line for line in demo.splitlines() if line.startswith(("Map:     ", "Report:  ", "ParaView:", "Table:   "))
    ]
    assert len(files) == 4
    for line in files:
        assert (folder / line.partition(": ")[2].strip()).is_file()
