"""A Slurm of one node on this machine: munge, controller and node daemon, all in one folder.

It needs root and the programs of Debian's packages slurm-wlm and munge. Ports, state and logs are
its own, so that a Slurm that is already there is left alone.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")
CLIENTS = ("sbatch", "srun", "squeue", "scancel", "scontrol", "sinfo")
CLIENT = """\
#!/bin/sh
SLURM_CONF={folder}/slurm.conf exec {path} "$@"
"""
NODE = "here"
START_TIMEOUT = 30.0  # s
STOP_TIMEOUT = 10.0  # s

CONFIGURATION = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=2
SchedulerParameters=sched_interval=2
NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=8000
PartitionName=main Nodes={node} Default=YES MaxTime=INFINITE State=UP
"""


class Unavailable(Exception):
    """Why there can be no Slurm here."""


class OneNodeSlurm:
    """Started by the constructor; raises Unavailable. `environment` is that of its clients."""

    def __init__(self, folder: Path):
        missing = [
            name for name in DAEMONS + CLIENTS if shutil.which(name, path=_search_path()) is None
        ]
        if missing:
            raise Unavailable(f"without {', '.join(missing)} (Debian: slurm-wlm, munge)")
        if os.geteuid() != 0:
            raise Unavailable("the daemons need root")
        self.folder, self.processes = folder, []
        self.environment = {**os.environ, "PATH": f"{folder}/bin{os.pathsep}{_search_path()}"}
        host = socket.gethostname().split(".")[0]
        controller_port, node_port = _free_ports(2)
        for name in ("state", "spool", "bin"):
            (folder / name).mkdir()
        for name in CLIENTS:  # Snakemake's plugin takes SLURM_CONF out of the environment of a job
            client = folder / "bin" / name
            path = shutil.which(name, path=_search_path())
            client.write_text(CLIENT.format(folder=folder, path=path))
            client.chmod(0o755)
        (folder / "slurm.conf").write_text(
            CONFIGURATION.format(
                folder=folder,
                host=host,
                node=NODE,
                controller_port=controller_port,
                node_port=node_port,
            )
        )
        key = folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        try:
            self._start_daemons(key)
        except BaseException:
            self.stop()
            raise

    def _start_daemons(self, key: Path) -> None:
        folder = self.folder
        files = [f"--{name}-file={folder}/munge.{name}" for name in ("pid", "log", "seed")]
        files += [f"--key-file={key}", f"--socket={folder}/munge.socket"]
        self._daemon("munged", "--foreground", "--force", *files)
        self._wait_until((folder / "munge.socket").exists, "munge")
        self._daemon("slurmctld", "-D", "-f", str(folder / "slurm.conf"))
        self._daemon("slurmd", "-D", "-f", str(folder / "slurm.conf"), "-N", NODE)
        self._wait_until(lambda: self.node_state() == "idle", "the node")

    def _daemon(self, *command: str) -> None:
        with (self.folder / f"{command[0]}.printed").open("w") as printed:
            process = subprocess.Popen(
                command, env=self.environment, stdout=printed, stderr=subprocess.STDOUT,
                start_new_session=True,
            )  # fmt: skip
        self.processes.append(process)

    def _wait_until(self, ready, what: str) -> None:
        end = time.monotonic() + START_TIMEOUT
        while not ready():
            gone = any(process.poll() is not None for process in self.processes)
            if gone or time.monotonic() > end:
                told = [path.read_text()[-300:] for path in self.folder.glob("*.printed")]
                raise Unavailable(f"{what} did not start: {' '.join(told).strip()}")
            time.sleep(0.2)

    def ask(self, *command: str) -> str:
        """What a client prints, stripped; empty where it fails."""
        answer = subprocess.run(
            command, env=self.environment, capture_output=True, text=True, check=False
        )
        return answer.stdout.strip()

    def node_state(self) -> str:
        return self.ask("sinfo", "--noheader", "--format=%T", f"--nodes={NODE}")

    def jobs(self, state: str) -> list[str]:
        """Numbers of the jobs in a state: running, pending."""
        return self.ask("squeue", "--noheader", "--format=%i", f"--states={state}").split()

    def stop(self) -> None:
        """End jobs and daemons, the last started first."""
        if len(self.processes) == 3:
            self.ask("scancel", "--partition=main")
            end = time.monotonic() + STOP_TIMEOUT
            while self.jobs("running") and time.monotonic() < end:
                time.sleep(0.2)
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()


def _search_path() -> str:
    return os.pathsep.join([os.environ["PATH"], "/usr/sbin", "/usr/local/sbin"])


def _free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports
