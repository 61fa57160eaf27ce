# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the real node writes and what sockets it has: SECURITY.md promises it."""
from pathlib import Path
import re
from xml.etree import ElementTree

from audits import all_files, environment, noted
from fuzzy_stereo_ros.parameters.table import ROS_PARAMETERS
from made_scenes import shifted_pair
from node_process import DISPARITY_NODE
from pages import text_of
import pytest

PAIR = shifted_pair(7)
HOSTILE = '../../../../evil'


@pytest.fixture(scope='module')
def place(tmp_path_factory):
    """Return a folder with the home of the node's user."""
    folder = tmp_path_factory.mktemp('place')
    (folder / 'home').mkdir()
    return folder


@pytest.fixture(scope='module')
def bench(make_bench, place):
    """Return the audited node, in an enclave, before cameras with a hostile name."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment(place, DISPARITY_NODE).items():
            patch.setenv(name, value)
        patch.delenv('ROS_LOG_DIR')
        with make_bench('--ros-args', '-p', 'disparity_range:=16', '--enclave', '/stereo',
                        module='audited') as bench:
            patch.undo()
            bench.rig.frame_id = HOSTILE
            bench.begin(*PAIR)
            yield bench


def sockets_of(process):
    """Yield (kind, port) of the sockets that a process has, as Linux lists them."""
    links = Path(f'/proc/{process}/fd').iterdir()
    mine = {str(link.readlink()) for link in links}
    for kind in ('tcp', 'tcp6', 'udp', 'udp6', 'unix'):
        for line in Path(f'/proc/{process}/net/{kind}').read_text().splitlines()[1:]:
            words = line.split()
            inode = words[6] if kind == 'unix' else words[9]
            if f'socket:[{inode}]' in mine:
                yield kind, None if kind == 'unix' else int(words[1].split(':')[1], 16)


def test_the_node_has_no_sockets_but_those_of_the_middleware(bench):
    assert {kind for kind, _ in sockets_of(bench.node.identity)} == {'udp'}


def test_no_parameter_that_holds_a_path_can_be_changed_from_outside(bench, place):
    paths = [row.name for row in ROS_PARAMETERS if isinstance(row.default, str)
             and ('/' in row.default or 'directory' in row.name) and not row.choices]
    assert paths == ['save_directory']
    done, reason = bench.set_parameters(save_directory=str(place / 'evil'))
    assert not done
    assert 'read-only parameter: save_directory' in reason


def test_the_policy_for_sros_2_allows_what_the_node_has_and_nothing_else(bench):
    text = re.search('```xml\n(.*?)```', text_of('SECURITY.md'), re.DOTALL)[1]
    profile, = ElementTree.fromstring(text).iter('profile')
    assert profile.attrib == {'ns': '/', 'node': 'disparity_node'}

    def named(group, wish, item):
        return {entry.text.replace('~', '/disparity_node') if entry.text[0] in '~/'
                else f'/{entry.text}' for several in profile.iter(group)
                if several.get(wish) == 'ALLOW' for entry in several.iter(item)}

    def found(of_node):
        return {name for name, _ in of_node('disparity_node', '/')}

    listener = bench.listener
    # a node of this name that an earlier test killed is in the graph until its lease ends
    bench.until(lambda: len(found(listener.get_service_names_and_types_by_node)) > 2
                and '/disparity' in found(listener.get_publisher_names_and_types_by_node),
                'the node in the graph')
    assert named('topics', 'publish', 'topic') == found(
        listener.get_publisher_names_and_types_by_node)
    assert named('topics', 'subscribe', 'topic') - {'/clock', '/parameter_events'} == found(
        listener.get_subscriber_names_and_types_by_node)
    assert named('services', 'reply', 'service') == found(
        listener.get_service_names_and_types_by_node)


def test_the_node_writes_below_its_folders_whatever_messages_say(bench, place):
    assert bench.match(*PAIR).header.frame_id == HOSTILE
    done, sentence = bench.trigger('save')
    assert done, sentence
    assert bench.node.finish() == 0
    saved = place / 'home' / '.ros' / 'fuzzy_stereo_ros'
    logs = place / 'home' / '.ros' / 'log'
    assert noted(place, [saved, logs]) == []
    assert list(saved.iterdir())
    assert all(log.suffix == '.log' for log in logs.iterdir())
    elsewhere = {path for path in all_files(place)
                 if saved not in path.parents and logs not in path.parents}
    assert elsewhere == {place / 'notes'}
