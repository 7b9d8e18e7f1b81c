"""Commands of the page on trust as they are pasted: a Dask cluster with certificates screens a fleet."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_fleet import write_small_fleet
from test_documents import TEXTS, fenced, typed

from fecontact.errors import InputError
from fecontact.jobs import cluster

PAGE = "fecontact/guide/trust.md"
ROOT = Path(__file__).parents[1]


def free_port() -> str:
    """Port of this machine that no process uses."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return str(listener.getsockname()[1])


def write_programs(folder: Path) -> None:
    """Write `fecontact` and `dask` as the documents call them."""
    folder.mkdir()
    for name, module in {"fecontact": "fecontact", "dask": "dask"}.items():
        (folder / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" -m {module} "$@"\n', "utf-8")
        (folder / name).chmod(0o755)


@pytest.mark.parametrize("page", [page for page in TEXTS if "dask scheduler" in TEXTS[page]])
def test_a_scheduler_of_the_documents_names_the_network_on_which_it_listens(page):
    lines = re.findall(r"^dask scheduler.*$", "".join(typed(TEXTS[page])), re.MULTILINE)
    assert lines
    assert [line for line in lines if "--host 127.0.0.1" not in line] == []


@pytest.mark.slow
def test_the_pasted_cluster_with_certificates_screens_a_fleet_and_refuses_others(tmp_path):
    pytest.importorskip("distributed")
    if shutil.which("openssl") is None:
        pytest.skip("the program openssl is not installed (Debian: apt-get install openssl)")
    *_, make_certificate, variables, start = fenced(TEXTS[PAGE], "sh")
    scheduler, worker, run = start.replace("8786", port := free_port()).splitlines()
    write_programs(tmp_path / "bin")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
    write_small_fleet(tmp_path / "trial")

    def shell(script: str, **options) -> subprocess.Popen:
        return subprocess.Popen(
            ["bash", "-ec", script], cwd=tmp_path, env=environment, start_new_session=True, **options
        )

    assert shell(make_certificate, stderr=subprocess.DEVNULL).wait() == 0
    assert (tmp_path / "key.pem").stat().st_mode & 0o077 == 0
    with (tmp_path / "dask.log").open("w") as log:
        started = [
            shell(f"{variables}exec {line} --no-dashboard", stdout=log, stderr=log)
            for line in (scheduler, worker.replace("--nworkers 2", "--nworkers 1"))
        ]
        try:
            screened = shell(variables + run)
            assert screened.wait(timeout=240) == 0, (tmp_path / "dask.log").read_text()
            text = (tmp_path / "dask.log").read_text()
            assert f"tls://127.0.0.1:{port}" in text
            assert "tcp://" not in text
            # without a certificate, or without encryption, nobody is let in
            alone = run.replace("--out screened", "--out refused")
            for line, reason in ((alone, "no certificate"), (alone.replace("tls://", "tcp://"), "not reachable")):
                ended = shell(line, stderr=subprocess.PIPE, text=True)
                _, said = ended.communicate(timeout=120)
                assert ended.returncode == 2
                assert reason in said
                assert "Traceback" not in said
        finally:
            for process in started:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    assert shell("fecontact fleet run trial/fleet.toml --out alone --workers 1 --quiet").wait(timeout=240) == 0
    for name in ("profiles.parquet", "screen/part-000000.parquet", "screen/part-000001.parquet"):
        assert (tmp_path / "screened" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()


@pytest.mark.parametrize(
    "address",
    ["", "x", "tls:", "tcp://", "udp://127.0.0.1:1", "tcp://a b:9", "tcp://host:0", "tcp://host:99999", "tcp://[::1:9",
     "tcp://a:b:9", "tcp://..:9", "tcp://" + "x" * 64 + ":9", "tcp://host:9/path", "tcp://\0:9"],
)  # fmt: skip
def test_an_address_that_is_none_is_refused_at_once(address):
    pytest.importorskip("distributed")
    start = time.monotonic()
    with pytest.raises(InputError, match=r"scheduler is .*; allowed: tcp://HOST:PORT"), cluster._connect(address):
        pass
    assert time.monotonic() - start < 5.0


@pytest.mark.parametrize("address", ["tls://127.0.0.1:9", "tls://[::1]:9"])
def test_an_encrypted_address_without_certificates_is_refused(address):
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no certificate for an encrypted connection"), cluster._connect(address):
        pass


def test_an_address_without_encryption_is_refused_where_encryption_is_required():
    pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.comm.require-encryption": True}),
        pytest.raises(InputError, match="not encrypted, but the configuration of Dask requires encryption"),
        cluster._connect("tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize("content", ["", "no certificate", None])
def test_a_certificate_that_cannot_be_read_is_refused(tmp_path, content):
    pytest.importorskip("distributed")
    import dask

    path = tmp_path / "cert.pem"
    if content is not None:
        path.write_text(content)
    files = {f"distributed.comm.tls.{name}": str(path) for name in ("ca-file", "client.cert", "client.key")}
    with (
        dask.config.set(files),
        pytest.raises(InputError, match="certificate or key of the client cannot be read"),
        cluster._connect("tls://127.0.0.1:9"),
    ):
        pass
