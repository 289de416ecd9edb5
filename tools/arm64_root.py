"""The arm64 Debian 12 of tools/arm64.py: a folder, and what starts its programs (the kernel with QEMU, or proot)."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
QEMU = '/usr/bin/qemu-aarch64-static'
BINFMT = Path('/proc/sys/fs/binfmt_misc')
BINFMT_LINE = Path('/usr/lib/binfmt.d/qemu-aarch64.conf')
# What this machine's pip and apt are told of mirrors and certificates holds in the root, too.
CERTIFICATES, KEPT_CERTIFICATES = 'etc/ssl/certs/ca-certificates.crt', 'usr/local/share/arm64-certificates.crt'
"""Kept in the root a second time, for pip: installing ca-certificates there replaces the first."""
CONFIGURATION = ('etc/resolv.conf', 'etc/hosts', 'etc/pip.conf', CERTIFICATES)
PASSED_ON = ('PIP_', 'http_proxy', 'https_proxy', 'no_proxy')
PATH = '/usr/sbin:/usr/bin:/sbin:/bin'
ENVIRONMENT = {
    'PATH': PATH,
    'HOME': '/root',
    'LC_ALL': 'C.UTF-8',
    'DEBIAN_FRONTEND': 'noninteractive',
    'OMP_NUM_THREADS': '1',
    'OPENBLAS_NUM_THREADS': '1',
}
# Emulated, installation is slow. Left out: documentation, waiting for the disk, bytecode of what is never imported.
FILES = {
    'etc/dpkg/dpkg.cfg.d/arm64': 'force-unsafe-io\n'
    + ''.join(f'path-exclude=/usr/share/{name}/*\n' for name in ('doc', 'man', 'locale')),
    'etc/apt/apt.conf.d/arm64': f'DPkg::Path "/usr/local/bin:{PATH}";\nAcquire::Languages "none";\n',
    'usr/local/bin/py3compile': '#!/bin/sh\n',
    'usr/sbin/policy-rc.d': '#!/bin/sh\nexit 101\n',  # no services
}


@dataclass(frozen=True)
class Machine:
    """`cache`: the folder with the root, its log and results. `proot`: the kernel cannot start its programs itself."""

    cache: Path
    proot: bool = False
    apt_options = '-q -y -o Dpkg::Use-Pty=0 --no-install-recommends'

    @property
    def emulated(self) -> bool:
        """Whether this machine is of another architecture."""
        return os.uname().machine != 'aarch64'

    @property
    def root(self) -> Path:
        """The root's folder."""
        return self.cache / 'root'

    @property
    def tree(self) -> Path:
        """The working tree inside it."""
        return self.root / 'sara'

    @property
    def log(self) -> Path:
        """Output of all that has no file of its own."""
        return self.cache / 'arm64.log'

    @property
    def enter(self) -> list[str]:
        """Command line that, with a root's folder and a program's command line, starts the program in that root."""
        if not self.proot:
            return ['chroot']
        return ['proot', '-q', QEMU, '-0', '-b', '/dev', '-b', '/proc', '-w', '/', '-r']

    def command(self, script: str) -> list[str]:
        """Command line of a shell script (bash -e) in the working tree inside the root."""
        told = {name: value for name, value in os.environ.items() if name.startswith(PASSED_ON)}
        if (self.root / KEPT_CERTIFICATES).exists():
            told['PIP_CERT'] = f'/{KEPT_CERTIFICATES}'
        words = [f'{name}={value}' for name, value in {**told, **ENVIRONMENT}.items()]
        script = f'cd /{self.tree.name}; {script}'
        return [*self.enter, str(self.root), '/usr/bin/env', '-i', *words, '/bin/bash', '-ec', script]

    def run(self, script: str) -> None:
        """Run a shell script in the root, its output appended to the log. Raises SystemExit where it fails."""
        with open(self.log, 'ab') as log:
            done = subprocess.run(self.command(script), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
        if done.returncode:
            self.fail(script)

    def fail(self, what: str) -> None:
        """Raise SystemExit with the log's end."""
        last = '\n'.join(self.log.read_text(errors='replace').splitlines()[-40:])
        raise SystemExit(f'{last}\nfailed on arm64: {what}\n{self.log} has the whole of it')

    def make(self) -> None:
        """Make the root, unless it is there."""
        command = [str(ROOT / 'tools' / 'bare_debian.sh'), str(self.root), str(self.log), 'arm64', *self.enter]
        if subprocess.run(command).returncode:
            self.fail('debootstrap')
        self.mount()
        for name, text in FILES.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding='utf-8')
            path.chmod(0o755 if text.startswith('#!') else 0o644)
        if self.emulated and not self.proot:
            self.unpack_natively()
        self.configure()

    def unpack_natively(self) -> None:
        """Give the root this machine's dpkg-deb and its libraries: decompressing is most of an installation's work."""
        program = '/usr/bin/dpkg-deb'
        libraries = subprocess.run(['ldd', program], capture_output=True, text=True, check=True).stdout
        if not (self.root / 'lib64').exists():  # as Debian's own: no /lib but links into /usr
            (self.root / 'usr/lib64').mkdir(exist_ok=True)
            (self.root / 'lib64').symlink_to('usr/lib64')
        for name in re.findall(r'/lib\S+', libraries):
            (self.root / name.lstrip('/')).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(name, self.root / name.lstrip('/'))
        shutil.copy(program, self.root / 'usr/local/bin')

    def configure(self) -> None:
        """Copy this machine's configuration of mirrors and certificates into the root."""
        for name, place in [*zip(CONFIGURATION, CONFIGURATION), (CERTIFICATES, KEPT_CERTIFICATES)]:
            if (Path('/') / name).exists():
                (self.root / place).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(Path('/') / name, self.root / place)

    def mount(self) -> None:
        """Mount /proc and /dev in the root, for as long as this namespace lives."""
        if self.root.is_dir() and not self.proot and not (self.root / 'proc/self').exists():
            subprocess.run(['mount', '-t', 'proc', 'proc', str(self.root / 'proc')], check=True)
            subprocess.run(['mount', '--rbind', '/dev', str(self.root / 'dev')], check=True)


def machine(cache: Path) -> Machine:
    """The machine whose root is kept in a folder. Raises SystemExit with what is missing."""
    for name, path in {'debootstrap': '/usr/sbin/debootstrap', 'qemu-user-static': QEMU}.items():
        if not Path(path).exists():
            raise SystemExit(f'{name} is missing: apt-get install {name}')
    cache.mkdir(parents=True, exist_ok=True)
    arm = Machine(cache)
    if arm.emulated and not registered():
        say('the kernel does not start arm64 programs itself (binfmt_misc): by proot')
        if not Path('/usr/bin/proot').exists():
            raise SystemExit('proot is missing: apt-get install proot')
        arm = Machine(cache, proot=True)
    arm.mount()
    return arm


def isolate() -> None:
    """Start this program again in namespaces of its own: nothing that it mounts or starts outlives it. Needs root."""
    if os.getuid() != 0:
        raise SystemExit('root is needed: chroot')
    if 'SARA_ARM64' not in os.environ:
        os.environ['SARA_ARM64'] = '1'
        command = ['unshare', '--mount', '--pid', '--fork', '--kill-child', '--mount-proc', sys.executable, *sys.argv]
        os.execvp(command[0], command)
    for number in (signal.SIGINT, signal.SIGTERM):  # the first process of a namespace ignores them; all end with it
        signal.signal(number, lambda *_: os._exit(130))


def registered() -> bool:
    """Whether the kernel starts arm64 programs by QEMU, also inside a root; registers QEMU if need be."""
    entry, register = BINFMT / 'qemu-aarch64', BINFMT / 'register'
    if not register.exists():
        subprocess.run(['mount', '-t', 'binfmt_misc', 'binfmt_misc', str(BINFMT)], stderr=subprocess.DEVNULL)
    try:
        if not entry.exists():
            register.write_text(BINFMT_LINE.read_text(encoding='utf-8'), encoding='utf-8')
        flags = next(line for line in entry.read_text(encoding='utf-8').splitlines() if line.startswith('flags: '))
    except (OSError, StopIteration):
        return False
    return 'F' in flags.split(' ')[1]  # the kernel keeps QEMU open: it need not be inside the root


def tracked() -> list[str]:
    """The working tree's files, from its folder: what git knows or would take in."""
    command = ['git', '-C', str(ROOT), 'ls-files', '-z', '--cached', '--others', '--exclude-standard']
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return sorted({name for name in text.split('\0') if name and os.path.lexists(ROOT / name)})


def copy_tree(target: Path) -> None:
    """Bring a copy of the working tree up to date: what was built in it stays."""
    names, listed = tracked(), target / '.arm64_files'
    target.mkdir(parents=True, exist_ok=True)
    before = set(listed.read_text(encoding='utf-8').split('\0')) if listed.exists() else set()
    for name in before - set(names):
        (target / name).unlink(missing_ok=True)
    for name in names:
        source, copy = ROOT / name, target / name
        there = os.path.lexists(copy) and copy.lstat()
        if not there or (there.st_mtime_ns, there.st_size) != (source.lstat().st_mtime_ns, source.lstat().st_size):
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.unlink(missing_ok=True)
            shutil.copy2(source, copy, follow_symlinks=False)
    listed.write_text('\0'.join(names), encoding='utf-8')


def say(words: str) -> None:
    """Print a line with the time of day."""
    print(f'{time.strftime("%H:%M:%S")} arm64: {words}', flush=True)
