# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Compares matches on this processor with those on an emulated aarch64: a row of `make matrix`."""
# Its argument is an empty folder for an arm64 Python of this Linux distribution and the libraries
# that are installed here. Without the programs it needs it says so, and ends with exit code 0. The
# code is 1 where matches of `realtime` differ; equal ones of `quality` are not promised.
from importlib.metadata import version
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys

from repository import ROOT

PROGRAM = ROOT / 'test' / 'support' / 'match_digests.py'
LIBRARIES = 'llvmlite', 'numba', 'numpy', 'opencv-python-headless', 'PyYAML', 'tqdm'
PLATFORMS = [f'--platform={name}_aarch64'
             for name in ('manylinux2014', 'manylinux_2_27', 'manylinux_2_28')]


def make_python(emulator, folder):
    """Return the words that start an emulated Python, and the folder of its libraries."""
    root, libraries = folder / 'root', folder / 'libraries'
    distribution = platform.freedesktop_os_release()
    subprocess.run(['mmdebstrap', '--quiet', '--mode=chrootless', '--variant=extract',
                    '--architectures=arm64', '--include=python3,libstdc++6',
                    distribution.get('UBUNTU_CODENAME') or distribution['VERSION_CODENAME'],
                    root], check=True)
    python = (root / 'usr' / 'bin' / 'python3').resolve()
    subprocess.run([sys.executable, '-m', 'pip', 'install', '--quiet', '--no-deps',
                    '--only-binary=:all:', *PLATFORMS, '--target', libraries,
                    '--python-version', python.name.removeprefix('python'),
                    *(f'{name}=={version(name)}' for name in LIBRARIES)], check=True)
    return [emulator, '-L', str(root), str(python)], libraries


def digests(folder, python, *libraries):
    """Yield (profile, kind and frame; digest) of the program, started by the words in python."""
    path = os.pathsep.join(map(str, [ROOT, *libraries]))
    with subprocess.Popen([*python, PROGRAM, 'realtime', 'quality', '--threads', '2',
                           '--images', folder / 'images.npz'], text=True,
                          stdout=subprocess.PIPE,
                          env={**os.environ, 'PYTHONPATH': path}) as process:
        for line in process.stdout:
            yield line.rstrip().rsplit(', ', 1)
    if process.returncode:
        sys.exit(f'{python[0]} ended with exit code {process.returncode}')


def compare(here, emulated):
    """Print a line for each of the emulated digests; return whether what is promised is equal."""
    missing, kept = {*here}, True
    for what, digest in emulated:
        missing.discard(what)
        same = digest == here.get(what)
        kept &= same or what.startswith('quality')
        print(f'aarch64, {what}:', 'the same bits as here' if same else 'differs', digest[:12],
              flush=True)
    return kept and not missing


def main(folder):
    emulator = shutil.which('qemu-aarch64') or shutil.which('qemu-aarch64-static')
    if not emulator or not shutil.which('mmdebstrap'):
        print('aarch64 is skipped: it needs qemu-aarch64 and mmdebstrap, which Debian and Ubuntu '
              'have in the packages qemu-user and mmdebstrap')
        return 0
    here = dict(digests(folder, [sys.executable]))
    return int(not compare(here, digests(folder, *make_python(emulator, folder))))


if __name__ == '__main__':
    sys.exit(main(Path(sys.argv[1])))
