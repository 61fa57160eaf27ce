# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A real scheduler of Dask and its workers, as processes on loopback."""
from contextlib import contextmanager, ExitStack
from importlib.util import find_spec
import os
import socket
import subprocess
import sys

import pytest
from repository import ROOT

if not find_spec('distributed'):    # the import takes a second, wherever tests are collected
    pytest.skip('distributed is not installed: no workers here', allow_module_level=True)
LOOPBACK = '127.0.0.1'
START = 'from dask.__main__ import main; main()'
SECONDS = 60     # that a process may take to be there


class DaskProcesses:
    """A scheduler and its workers."""

    # address: of the scheduler. client: a distributed.Client, to look at what happens.

    def __init__(self, folder, started, before, environment):
        """Start a scheduler."""
        from distributed import Client
        # started: ExitStack that ends it. before: code that it runs first. environment: further
        # variables.
        with socket.create_server((LOOPBACK, 0)) as free:
            port = free.getsockname()[1]
        self._folder, self._started = folder, started
        # What was there may hold the metadata of the package: colcon puts its folder there.
        places = os.pathsep.join(filter(None, [str(ROOT), os.environ.get('PYTHONPATH')]))
        self._environment = {**os.environ, 'PYTHONPATH': places, **environment}
        self.address = f'tcp://{LOOPBACK}:{port}'
        self._start(before, 'scheduler', '--port', port, '--no-show')
        self.client = started.enter_context(
            Client(self.address, timeout=SECONDS, set_as_default=False))

    def worker(self, before=''):
        """Start a worker, running code before; return its Popen and its address."""
        there = self.client.nthreads()
        process = self._start(before, 'worker', self.address, '--no-nanny', '--nthreads', 1,
                              '--local-directory', self._folder)
        self.client.wait_for_workers(len(there) + 1, timeout=SECONDS)
        (address,) = set(self.client.nthreads()) - set(there)
        return process, address

    def _start(self, before, *arguments):
        process = self._started.enter_context(subprocess.Popen(
            [sys.executable, '-c', f'{before}\n{START}', *map(str, arguments), '--host', LOOPBACK,
             '--no-dashboard'], env=self._environment, cwd=self._folder,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL))
        self._started.callback(process.kill)
        return process


@contextmanager
def dask_processes(folder, before='', **environment):
    """Give DaskProcesses that end with the context."""
    with ExitStack() as started:
        yield DaskProcesses(folder, started, before, environment)
