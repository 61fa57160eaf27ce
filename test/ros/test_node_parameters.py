# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the real node: one declaration, files that load, changes whole or not at all."""
from functools import partial

from bench.parameter_pages import parameter_file
from fuzzy_stereo_ros.parameters.table import IGNORED_PARAMETERS, ROS_PARAMETERS
from made_scenes import shifted_pair
from pages import block
import pytest
from repository import ROOT

PAIR = shifted_pair(7)
FILE = ROOT / 'config' / 'fuzzy_stereo.yaml'
ARGUMENTS = '--params-file', str(FILE), '-p', 'disparity_range:=16'


def test_the_file_of_parameters_is_the_declaration():
    assert FILE.read_text() == parameter_file(), (
        'renew it: python -m bench.parameter_pages config/fuzzy_stereo.yaml')


def test_the_node_has_the_parameters_of_the_table_and_the_peer_s(bench):
    names = [row.name for row in ROS_PARAMETERS]
    values = dict(zip(names, bench.parameters(*names)))
    assert values == {**{row.name: row.default for row in ROS_PARAMETERS}, 'disparity_range': 16,
                      'input_qos': 'reliable'}
    assert bench.parameters(*IGNORED_PARAMETERS) == [None] * len(IGNORED_PARAMETERS)


def test_a_profile_presets_what_is_not_set_along_with_it(bench):
    names = ('population', 'generations', 'algorithm', 'disparity_range')
    before = bench.parameters(*names)
    assert bench.change(profile='paper', population=4, generations=1) == (True, '')
    assert bench.parameters(*names) == [4, 1, 'paper', 16]
    message = bench.match(*PAIR)
    assert message.delta_d == 1.0
    assert message.max_disparity == 15.0
    assert bench.change(profile='realtime') == (True, '')
    assert bench.parameters(*names) == before
    assert bench.match(*PAIR).delta_d == 1 / 16


def test_the_profile_that_is_set_already_changes_no_parameter_as_a_file_that_is_loaded_has_it(
        bench):
    assert bench.change(population=5, profile='paper') == (True, '')
    assert bench.change(profile='paper', confidence_threshold=0.5) == (True, '')
    assert bench.parameters('population', 'confidence_threshold') == [5, 0.5]


def test_a_parameter_of_the_peer_s_that_is_set_later_is_said_to_be_ignored(bench):
    mark = bench.node.mark()
    assert bench.set_parameters(uniqueness_ratio=5.0, P1=300.0) == (True, '')
    bench.node.logged('matchers are ignored: P1, uniqueness_ratio', after=mark)


def test_a_request_that_rclpy_cannot_read_is_logged_and_survived(bench):
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParameters
    client = bench.listener.create_client(SetParameters, '/disparity_node/set_parameters')
    unread = Parameter(name='disparity_range', value=ParameterValue(type=200))
    assert bench.answer(client, SetParameters.Request(parameters=[unread])).results == []
    bench.node.logged('set_parameters rejected: 200 is not a valid Parameter.Type')
    assert bench.match(*PAIR).max_disparity == 15.0


# ---- a file written for the peer, and names that mean nothing ----

UNKNOWN = [f'qos_overrides./{name}' for name in (
    'disparity.publisher.lifespan', 'left/image_rec.subscription.depth',
    'tf.subscription.history')]
OF_DISPARITY = 'qos_overrides./disparity.publisher'


@pytest.fixture(scope='module')
def migrated(make_bench, tmp_path_factory):
    """Return a node with the file of the migration page, and more, after its first disparity."""
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Image
    file = tmp_path_factory.mktemp('parameters') / 'peer.yaml'
    file.write_text(block('yaml'))
    with make_bench(
            '--ros-args', '--params-file', str(file), *(word for value in (
                'fill:=true', 'output_qos:=sensor_data', f'{OF_DISPARITY}.reliability:=reliable',
                f'{OF_DISPARITY}.durability:=transient_local', *(f'{name}:=2' for name in (
                    'disparity_rang', 'disparities', 'unheard', *UNKNOWN)))
                for word in ('-p', value)), best_effort=True, reliable=True) as it:
        it.collect(Image, 'confidence', it.confidences, qos_profile_sensor_data)
        it.first = it.begin(*PAIR, confidence=False)
        yield it


def test_a_file_written_for_the_peer_loads(migrated):
    assert (migrated.first.min_disparity, migrated.first.max_disparity) == (2.0, 33.0)
    assert migrated.parameters(
        'speckle_size', 'queue_size', 'P1', 'confidence_threshold',
        'qos_overrides./left/image_rect.subscription.reliability') == [
            50, 7, 200.0, 0.0, 'reliable']


def test_an_override_of_one_topic_changes_no_other_one(migrated):
    def qualities(of_topic, topic):
        found = migrated.until(lambda: of_topic(topic), topic)[0].qos_profile
        return found.reliability.name, found.durability.name

    subscribed = partial(qualities, migrated.listener.get_subscriptions_info_by_topic)
    published = partial(qualities, migrated.listener.get_publishers_info_by_topic)
    assert subscribed('/left/image_rect') == ('RELIABLE', 'VOLATILE')
    assert published('/disparity') == ('RELIABLE', 'TRANSIENT_LOCAL')
    assert {*map(subscribed, ('/left/camera_info', '/right/image_rect', '/right/camera_info')),
            *map(published, ('/confidence', '/preview'))} == {('BEST_EFFORT', 'VOLATILE')}


def test_names_that_mean_nothing_are_told_once_with_what_may_be_meant(migrated):
    warnings = [line for line in migrated.node.log().splitlines() if 'WARN' in line]
    assert [line.split(' are ignored: ')[1] for line in warnings] == [
        'P1, P2, correlation_window_size, disp12_max_diff, prefilter_cap, prefilter_size, '
        'sgbm_mode, stereo_algorithm, texture_threshold, uniqueness_ratio',
        'disparities (did you mean disparity_range?), disparity_rang (did you mean '
        'disparity_range?), unheard',
        f'{UNKNOWN[0]}, {UNKNOWN[1]} (did you mean qos_overrides./left/image_rect.subscription.'
        f'depth?), {UNKNOWN[2]}']
    assert ['QoS overrides for unknown topics' in line for line in warnings] == [
        False, False, True]
