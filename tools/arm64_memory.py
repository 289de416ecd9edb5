"""How much memory each node holds on arm64 and here, while the simulated chair stands at its first goal.

A program that QEMU runs shares its process with QEMU. QEMU 7.2 lays the program and all that it maps below the place
where the kernel lays QEMU itself (EMULATOR), so addresses tell them apart.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

from arm64_root import ROOT, Machine, say

EMULATOR = (
    0x5555_5555_4000  # where x86-64 Linux lays position-independent programs: QEMU, its heap, and above libraries
)
MAPPING = re.compile(r'^([0-9a-f]+)-[0-9a-f]+ ')
MASTER = 'rosmaster'
# Slower than the emulated nodes, so that they keep up with the simulated chair.
DRIVE = """source devel/setup.bash
export ROS_HOME={home} XDG_RUNTIME_DIR={home} ROS_HOSTNAME=127.0.0.1 ROS_MASTER_URI=http://127.0.0.1:11311
roslaunch sara_bringup sara.launch speed:={speed} >{home}/launch.log 2>&1 &
until (: </dev/tcp/127.0.0.1/11311) 2>/dev/null; do kill -0 $! || {{ cat {home}/launch.log; exit 1; }}; sleep 1; done
rosrun sara_bringup go 2.0 1.0 0 --timeout 36000 --wait 36000 || {{ cat {home}/launch.log; exit 1; }}
touch {home}/there
while [ -e {home}/there ]; do sleep 1; done
kill $!
wait"""
NETWORK = ('unshare', '--net', 'bash', '-c', 'ip link set lo up && exec "$@"', 'bash')


def resident(smaps: str, below: int) -> dict[str, int]:
    """{'resident', 'anonymous': kB} of a process's mappings below an address. `smaps`: text of /proc/PID/smaps.
    Anonymous memory is what no file backs: what the process has written.
    """
    found, counted = {'resident': 0, 'anonymous': 0}, False
    for line in smaps.splitlines():
        if start := MAPPING.match(line):
            counted = int(start[1], 16) < below
        elif counted and line.startswith(('Rss:', 'Anonymous:')):
            name, kilobytes, _ = line.split()
            found['resident' if name == 'Rss:' else 'anonymous'] += int(kilobytes)
    return found


def node_of(command: list[str]) -> str | None:
    """The node that a command line starts, as roslaunch gives it its name; None for other processes."""
    names = [word.removeprefix('__name:=') for word in command if word.startswith('__name:=')]
    if names:
        return names[0]
    return MASTER if any(os.path.basename(word) == MASTER for word in command) else None


def nodes_below(pid: int, below: int) -> dict[str, dict[str, int]]:
    """{node: memory (kB)} of a process and all that it started."""
    found, waiting = {}, [pid]
    while waiting:
        process = Path('/proc') / str(waiting.pop())
        try:
            command = process.joinpath('cmdline').read_text(errors='replace').split('\0')
            for task in process.glob('task/*/children'):
                waiting += map(int, task.read_text().split())
            if name := node_of(command):
                found[name] = resident(process.joinpath('smaps').read_text(), below)
        except (FileNotFoundError, ProcessLookupError):  # it has ended meanwhile
            continue
    return found


def drive(command: list[str], home: Path, below: int, log: Path) -> dict[str, dict[str, int]]:
    """Run DRIVE's command line until the chair is at its goal; the nodes' memory then. Raises SystemExit."""
    with open(log, 'ab') as output:
        process = subprocess.Popen(
            [*NETWORK, *command], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
        )
    while not (home / 'there').exists():
        if process.poll() is not None:
            raise SystemExit(f'the chair did not reach its goal: {log} says why')
        time.sleep(1.0)
    found = nodes_below(process.pid, below)
    (home / 'there').unlink()  # ends the launch
    process.wait()
    return found


def measure(arm: Machine, speed: float = 0.05) -> None:
    """Drive on arm64 and here, and keep the nodes' memory in the cache."""
    found = {}
    with tempfile.TemporaryDirectory(dir=arm.root / 'tmp') as folder:
        home = Path(folder)
        script = DRIVE.format(home=f'/{home.relative_to(arm.root)}', speed=speed)
        found['arm64'] = drive(arm.command(script), home, EMULATOR if arm.emulated else 1 << 64, arm.log)
    with tempfile.TemporaryDirectory() as folder:
        script = DRIVE.format(home=folder, speed=1.0)
        found['here'] = drive(['bash', '-ec', script], Path(folder), 1 << 64, arm.log)
    (arm.cache / 'memory.json').write_text(json.dumps(found, indent=1), encoding='utf-8')
    say(f'{len(found["arm64"])} nodes measured')


def table(found: dict[str, dict[str, dict[str, int]]]) -> list[str]:
    """Lines of Markdown: memory of each node in MB, the largest first."""
    arm, here = found['arm64'], found['here']
    lines = [
        '| node | arm64: resident | of it anonymous | amd64: resident | of it anonymous |',
        '|---|---|---|---|---|',
    ]
    rows = {name: [arm[name], here.get(name, {})] for name in sorted(arm, key=lambda name: -arm[name]['resident'])}
    both = [
        {kind: sum(row[i].get(kind, 0) for row in rows.values()) for kind in ('resident', 'anonymous')} for i in (0, 1)
    ]
    for name, row in {**rows, 'all': both}.items():
        figures = [f'{side[kind] / 1024:.0f}' if side else '-' for side in row for kind in ('resident', 'anonymous')]
        lines.append(f'| {name} | {" | ".join(figures)} |')
    return lines
