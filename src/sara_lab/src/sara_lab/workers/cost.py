"""What a process has cost so far, and which processes it began (Linux: /proc)."""

from __future__ import annotations

import os
from pathlib import Path


def cpu_seconds(pid: int) -> float:
    """User and system time a process has used so far."""
    fields = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def peak_memory_mb(pid: int) -> float:
    """The most memory that a process has held, MB."""
    line = next(line for line in Path(f'/proc/{pid}/status').read_text().splitlines() if line.startswith('VmHWM'))
    return int(line.split()[1]) / 1024.0


def share_of_memory_mb(pid: int) -> float:
    """What a process takes of the machine's memory now, MB: of a page that n processes share, an n-th (PSS)."""
    rollup = Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()
    return int(next(line for line in rollup if line.startswith('Pss:')).split()[1]) / 1024.0


def descendants(pid: int) -> list[int]:
    """Process ids of a process and of all it started, itself first."""
    found = [pid]
    for task in Path(f'/proc/{pid}/task').glob('*/children'):
        for child in task.read_text().split():
            found += descendants(int(child))
    return found
