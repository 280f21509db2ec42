"""Run the Slurm scripts of the documentation on a real Slurm of one node: `python tests/trust/slurm.py` (as root, a minute or two).

It takes Debian's packages slurm-wlm and munge. Controller, node and munge are started from a folder of their own, listen on the
loopback interface only, and are ended afterwards; the scripts run word for word, but for the number of tasks. Each must give the
table that dielast gives alone, byte for byte.
"""

from __future__ import annotations

import argparse
import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
PAGES = (TOP / "README.md", *sorted((TOP / "recipes" / "guide").glob("*.md")))
NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol")
TASKS = 2
LONGEST = 120  # s until a job or a daemon is taken for lost
MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
temperature = ["20 degC", "40 degC"]
horizon = "1 h"
film = { thickness = "0.5 mm", prestretch = [1.7, 1.8, 1.9], relax = "10 min" }
voltage = { from = "1 kV", to = "5 kV", points = 400 }
breakdown = { field = "45 MV/m" }
"""
CONFIGURATION = """
ClusterName=trial
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def scripts() -> list[str]:
    """The batch scripts of the documentation."""
    blocks = [block for page in PAGES for block in re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)]
    return [block for block in blocks if "#SBATCH" in block]


def free_ports(count: int) -> list[int]:
    """Ports of the loopback interface that nobody listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


@contextmanager
def daemon(*command: str | Path, log: Path) -> Iterator[None]:
    """A program that runs in the foreground until it is terminated."""
    with log.open("ab") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output)
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def until_idle(log: Path) -> None:
    """Wait until the node takes jobs."""
    deadline = time.monotonic() + LONGEST
    while True:
        done = subprocess.run(["sinfo", "--noheader", "--format=%T"], capture_output=True, text=True, check=False)
        if done.stdout.strip() == "idle":
            return
        if time.monotonic() > deadline:
            raise SystemExit(f"no node of Slurm is idle: {done.stdout}{done.stderr}{log.read_text()}")
        time.sleep(0.2)


@contextmanager
def cluster(folder: Path) -> Iterator[None]:
    """A Slurm of this machine; `SLURM_CONF` names its configuration meanwhile."""
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.touch(mode=0o600)
    key.write_bytes(secrets.token_bytes(128))
    host = socket.gethostname().partition(".")[0]
    settings = CONFIGURATION.format(host=host, folder=folder, ports=free_ports(2), cpus=os.cpu_count())
    (folder / "slurm.conf").write_text(settings, encoding="utf-8")
    os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
    files = {"key-file": key, "socket": folder / "munge.socket", "pid-file": folder / "munge.pid", "log-file": folder / "munge.log"}
    munged = ["munged", "--foreground", "--force", *(f"--{name}={path}" for name, path in files.items())]
    with ExitStack() as stack:
        stack.enter_context(daemon(*munged, f"--seed-file={folder}/munge.seed", log=folder / "munge.out"))
        stack.enter_context(daemon("slurmctld", "-D", log=folder / "slurmctld.out"))
        stack.enter_context(daemon("slurmd", "-D", "-N", host, log=folder / "slurmd.out"))
        until_idle(folder / "slurmd.log")
        yield


def submit(folder: Path, *arguments: str) -> None:
    """Submit a job and wait for its end; an error, with all that it printed, if it fails."""
    folder.mkdir()
    (folder / "map.toml").write_text(MAP, encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    command = ["sbatch", "--wait", *arguments]
    done = subprocess.run(command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, timeout=LONGEST)
    if done.returncode:
        printed = "".join(path.read_text(errors="replace") for path in folder.glob("slurm-*.out"))
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}{done.stderr}{printed}")


def joined(tables: list[Path]) -> str:
    """Tables below each other, with the header of the first."""
    lines = [table.read_text(encoding="utf-8").splitlines(keepends=True) for table in tables]
    return "".join([*lines[0], *(line for more in lines[1:] for line in more[1:])])


def main() -> None:
    """Run them all, compare, report."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        raise SystemExit(f"{', '.join(missing)}: not installed; apt-get install slurm-wlm munge")
    batch = scripts()
    if len(batch) != 2:
        raise SystemExit(f"{len(batch)} batch scripts in the documentation; this knows one with Dask and one that is an array")
    with tempfile.TemporaryDirectory() as scratch, cluster(Path(scratch)):
        folder = Path(scratch)
        submit(folder / "jobs", f"--cpus-per-task={TASKS}", '--wrap=dielast failure-map map.toml --jobs "$SLURM_CPUS_PER_TASK"')
        command = [sys.executable, "-m", "dielast", "failure-map", "map.toml", "-o", "alone", "-q", "--plot", "none"]
        subprocess.run(command, cwd=folder / "jobs", check=True)
        alone = (folder / "jobs/alone/failure-map.csv").read_text(encoding="utf-8")
        results = {"--jobs": joined([folder / "jobs/map/failure-map.csv"])}
        for name, script in zip(("Dask", "array"), sorted(batch, key=lambda text: "--array" in text), strict=True):
            (folder / f"{name}.sh").write_text(script, encoding="utf-8")
            submit(folder / name, *([f"--ntasks={TASKS}"] if name == "Dask" else []), str(folder / f"{name}.sh"))
            results[name] = joined(sorted((folder / name).glob("map*/failure-map.csv")))
        for name, table in results.items():
            print(f"{name}: {'the same table as alone' if table == alone else 'ANOTHER TABLE than alone'}")
        sys.exit(any(table != alone for table in results.values()))


if __name__ == "__main__":
    main()
