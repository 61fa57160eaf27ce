# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options that say on which workers a replay is matched, and the workers they ask for."""
from contextlib import contextmanager, ExitStack
import logging
from multiprocessing import resource_tracker
import signal
import tempfile

from fuzzy_stereo_ros.bags.reading import text_of
from fuzzy_stereo_ros.replay.cluster import check_version, Cluster, ClusterFault, PACKAGE, unfit
from fuzzy_stereo_ros.replay.interruption import Interruption, undisturbed
from fuzzy_stereo_ros.replay.request import WARM_PAIRS
from fuzzy_stereo_ros.replay.segments import SEGMENT_PAIRS
from fuzzy_stereo_ros.saved_pairs.versions import versions

HERE = 'this machine'
LOOPBACK = '127.0.0.1'
ANSWER_SECONDS = 5      # that a scheduler has to answer, and its first worker to be there
DECISIVE = 'python', 'numpy', 'numba', 'opencv', 'processor'    # for the bits of a result


def add_cluster_options(parser):
    """Add --workers and --scheduler."""
    group = parser.add_argument_group(
        'many at a time',
        f'either cuts the bag into segments of {SEGMENT_PAIRS} pairs, each warmed over the '
        f'{WARM_PAIRS} pairs before it: the result is the same for every number of workers, and '
        'may differ a little from that without workers, which is one chain as in the node')
    group.add_argument('--workers', metavar='N', type=int,
                       help='match in so many processes of this machine, of one thread each '
                            'unless --threads says otherwise')
    group.add_argument('--scheduler', metavar='ADDRESS',
                       help='match on the workers of a Dask cluster, as tcp://host:8786; they '
                            f'need {PACKAGE} of the same version, but not the bag')


def asks_for_cluster(arguments):
    """Return whether workers are asked for; ValueError where they cannot be."""
    if arguments.workers is not None and arguments.scheduler is not None:
        raise ValueError('--workers starts workers and --scheduler takes others: give one of '
                         'them')
    if arguments.workers is not None and arguments.workers < 1:
        raise ValueError(f'--workers is {arguments.workers}; allowed are whole numbers from 1')
    return arguments.workers is not None or arguments.scheduler is not None


@contextmanager
def opened_cluster(arguments, config, told):
    """
    Give the Cluster that parsed options ask for, None where they ask for none.

    config: MatcherConfig of the images as they are. told(sentence): called where workers run on
    other versions of what decides about bits.
    Raises ValueError without Dask, ClusterFault where no worker is there or one cannot match.
    """
    if not asks_for_cluster(arguments):
        yield None
        return
    opened = ExitStack()
    try:
        # Started or closed by halves, Dask would leave processes or tell of it at length.
        with Interruption() as interruption:
            cluster = _cluster(arguments, config, told, opened)
        if interruption.came():
            raise KeyboardInterrupt
        yield cluster
    finally:
        with undisturbed():
            opened.close()


def _cluster(arguments, config, told, opened):
    """Return the Cluster that is asked for, what it needs opened in an ExitStack."""
    try:
        import dask
        from distributed import Client
        from distributed.comm import get_address_host_port
        from distributed.utils import silence_logging_cmgr
    except ImportError:
        raise ValueError('there is no distributed, which shares work among processes: '
                         f"pip install '{PACKAGE}[cluster]'") from None
    opened.enter_context(silence_logging_cmgr(logging.CRITICAL))
    # Segments are large, and the scheduler is to keep them in case a worker dies.
    opened.enter_context(
        dask.config.set({'distributed.admin.large-graph-warning-threshold': '1 PiB'}))
    if arguments.scheduler is None:
        name, local = HERE, _local_cluster(arguments.workers, opened)
        client = Client(local, set_as_default=False, direct_to_workers=True)
    else:
        name = arguments.scheduler
        try:
            get_address_host_port(name)     # or else half a Client is left, which ends at length
            client = Client(name, timeout=ANSWER_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterFault(f'--scheduler is {name}, where no scheduler of Dask answers: '
                               f'{text_of(error)}') from error
    cluster = opened.enter_context(Cluster(client, name, config))
    _check(client, name, told)
    return cluster


def _local_cluster(workers, opened):
    """Return a LocalCluster of so many processes, opened in an ExitStack."""
    from distributed import LocalCluster
    return opened.enter_context(LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, memory_limit=0,
        host=LOOPBACK, dashboard_address=None,
        scheduler_kwargs={'dashboard_address': f'{LOOPBACK}:0'},
        local_directory=opened.enter_context(tempfile.TemporaryDirectory()),
        loop=opened.enter_context(_loop_without_interrupts()), silence_logs=logging.CRITICAL))


@contextmanager
def _loop_without_interrupts():
    """
    Give an event loop whose processes Ctrl-C does not reach; they end with this one.

    What a thread blocks, the threads and processes that it starts block too.
    """
    from distributed.utils import LoopRunner
    resource_tracker.ensure_running()   # or else it lets the interrupts through again
    runner = LoopRunner()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        runner.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        yield runner.loop
    finally:
        runner.stop()


def _check(client, name, told):
    """Raise ClusterFault where the scheduler or a worker cannot do what it will be asked for."""
    import distributed

    try:
        client.wait_for_workers(1, timeout=ANSWER_SECONDS)
    except distributed.TimeoutError:    # before Python 3.11 not the one of Python
        raise ClusterFault(f'{name} has no workers: start some with `dask worker {name}`, where '
                           f'{PACKAGE} is installed') from None
    found = client.run(versions, on_error='return')
    try:
        found[name] = client.run_on_scheduler(versions)
    except Exception as error:      # whatever it is, it cannot be used  # noqa: B902
        found[name] = error
    here = versions()
    for address, there in found.items():
        where = f'the scheduler {name}' if address == name else f'the worker {address}'
        if isinstance(there, Exception):
            raise unfit(where, there)
        check_version(there[PACKAGE], where)
        different = [f'{what} {there[what]} (here {here[what]})' for what in DECISIVE
                     if there[what] != here[what]]
        if different and address != name:
            told(f"{where} has {', '.join(different)}: the last bits of its results may differ")
