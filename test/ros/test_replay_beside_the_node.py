# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo replay` makes of a bag is what the live node makes of it, bit for bit."""
from made_bags import DISPARITIES, open_bag, scene, stamps, TOPICS, write_bag
import pytest
from replayed import replay

FRAMES = 10
KINDS = 'Image', 'CameraInfo', 'Image', 'CameraInfo'
PAPER = {'profile': 'paper', 'population': 6, 'generations': 3}


def faint_scene():
    """Return pairs that stay but for noise, of plain surfaces, which vote."""
    return [pair._replace(left=112 + pair.left // 8, right=112 + pair.right // 8)
            for pair in scene(2 * FRAMES, 160, 240, 32, noise=4.0)]


def written(folder, pairs):
    """Return the path of a bag of pairs and their calibration, whose centres differ."""
    def change(number, messages):
        messages[TOPICS[3]].p[2] -= 2.5

    return write_bag(folder / 'bag', pairs=pairs, change=change)


def play(bench, bag):
    """Publish a bag's messages as they are stored, and return {stamp: DisparityImage}."""
    from fuzzy_stereo_ros.pairs.messages import stamp_of
    from rclpy.serialization import deserialize_message
    import sensor_msgs.msg
    kinds = dict(zip(TOPICS, (getattr(sensor_msgs.msg, kind) for kind in KINDS)))
    publishers = {topic: bench.listener.create_publisher(kind, topic, 10)
                  for topic, kind in kinds.items()}
    bench.until(lambda: all(one.get_subscription_count() for one in publishers.values()),
                'the node hears the bag')
    answers = {}
    with open_bag(bag) as reader:
        for connection, _, raw in reader.messages():
            message = deserialize_message(bytes(raw), kinds[connection.topic])
            publishers[connection.topic].publish(message)
            if connection.topic == TOPICS[-1]:
                stamp = stamp_of(message.header)
                answers[stamp] = bench.until(
                    lambda: bench.disparities.get(stamp), f'disparity of {stamp}')  # noqa: B023
    return answers


def replayed(bag):
    """Return the DisparityImages of a bag as ROS reads them."""
    from rclpy.serialization import deserialize_message
    from stereo_msgs.msg import DisparityImage
    with open_bag(bag) as reader:
        return [deserialize_message(bytes(raw), DisparityImage)
                for connection, _, raw in reader.messages() if connection.topic == '/disparity']


@pytest.mark.parametrize(('pairs', 'options', 'parameters'), [
    (faint_scene, [], []),
    (lambda: scene(FRAMES), ['--scale', '0.5', '--seed', '3', '--min-disparity', '-2', '--fill'],
     ['scale:=0.5', 'seed:=3', 'min_disparity:=-2', 'fill:=true']),
    (lambda: scene(FRAMES), [word for key, value in PAPER.items() for word in (f'--{key}', value)],
     [f'{name}:={value}' for name, value in PAPER.items()])],
    ids=['evolving', 'reduced', 'paper'])
def test_replay_and_the_live_node_give_identical_messages(
        make_bench, tmp_path, pairs, options, parameters):
    pairs = pairs()
    bag = written(tmp_path, pairs)
    arguments = [word for one in (f'disparity_range:={DISPARITIES}', *parameters)
                 for word in ('-p', one)]
    with make_bench('--ros-args', *arguments) as bench:
        bench.listen(confidence=False)
        bench.connect()
        live = play(bench, bag)
    assert replay(bag, output=tmp_path / 'out', options=options) == 0
    assert list(live) == stamps(len(pairs))
    for message, expected in zip(replayed(tmp_path / 'out'), live.values(), strict=True):
        assert message == expected
        assert message.image.data == expected.image.data
