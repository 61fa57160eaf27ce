# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The topics of the cameras are found by type and name; where in doubt, they are listed."""
from fuzzy_stereo_ros.bags.topics import COMPRESSED, find_stereo_topics, INFO, RAW
import pytest


def kinds(**changes):
    """Return {topic: (type, number)} of topics written as path__name='kind'."""
    return {f"/{name.replace('__', '/')}": (kind, 5) for name, kind in changes.items()}


def rig(left='left', right='right', name='image_rect', kind=RAW, space=''):
    """Return the topics of a rig with a CameraInfo beside each image."""
    return {f'{space}/{side}/{one}': (which, 5) for side in (left, right)
            for one, which in ((name, kind), ('camera_info', INFO))}


def found(topics, **chosen):
    return find_stereo_topics('the bag', topics, **chosen)


def rejection_of(topics, **chosen):
    with pytest.raises(ValueError) as rejection:
        found(topics, **chosen)
    return str(rejection.value)


@pytest.mark.parametrize(('rectify', 'name'), [(False, 'image_rect'), (True, 'image_raw')])
@pytest.mark.parametrize('suffix', ['', '/compressed'])
def test_rectified_images_are_taken_unless_raw_ones_are_wanted(rectify, name, suffix):
    kind = COMPRESSED if suffix else RAW
    topics = {**rig(name=f'image_raw{suffix}', kind=kind),
              **rig(name=f'image_rect{suffix}', kind=kind),
              **rig(name=f'{name}/compressed', kind=COMPRESSED)}
    assert found(topics, rectify=rectify).left == f'/left/{name}{suffix}'


@pytest.mark.parametrize(('name', 'raw'), [
    ('image_rect', False), ('image_rect_raw', False), ('image', False), ('image_raw', True),
    ('image_raw/compressed', True), ('image_raw_color', True), ('image_rect/compressed', False)])
def test_a_name_says_that_images_are_raw_where_it_does_not_say_that_they_are_rectified(name, raw):
    kind = COMPRESSED if name.endswith('compressed') else RAW
    assert found(rig(name=name, kind=kind, space='/raw')).raw_by_name is raw


def test_words_that_only_contain_left_are_no_sides():
    topics = kinds(cleft__image=RAW, cright__image=RAW, left2__image=RAW, right2__image=RAW)
    assert 'no two image topics of the bag differ only in left/right' in rejection_of(topics)


def test_a_camera_info_that_is_alone_in_the_namespace_is_taken_whatever_its_name_or_is_missing():
    assert found(kinds(left__image=RAW, left__info=INFO, right__image=RAW)) == (
        '/left/image', '/left/info', '/right/image', None)


def test_several_pairs_are_listed_and_the_left_topic_chooses():
    topics = {**rig(space='/a'), **rig(space='/b')}
    assert rejection_of(topics) == (
        'the bag has several pairs of image topics: /a/left/image_rect and /a/right/image_rect; '
        '/b/left/image_rect and /b/right/image_rect; choose one with --left')
    assert found(topics, left='/b/left/image_rect').right == '/b/right/image_rect'
    assert found(topics, right='/a/right/image_rect').left == '/a/left/image_rect'


@pytest.mark.parametrize('spaces', [
    ('/left_arm', '/right_arm'), ('/left', '/right'), ('/cam0', '/cam1'), ('/left_arm',),
    ('/right_arm',), ('/left/left', '/left/right', '/right/left')])
@pytest.mark.parametrize(('left', 'right'), [
    ('left', 'right'), ('infra1', 'infra2'), ('cam0', 'cam1'), ('left_raw', 'right_raw'),
    ('camera_gray_left', 'camera_gray_right'), ('eyes/left/left_eye', 'eyes/right/right_eye')])
def test_words_for_sides_in_the_name_of_a_rig_are_none_of_its_cameras(spaces, left, right):
    topics = {}
    for space in spaces:
        topics.update(rig(left, right, space=space))
    pairs = [tuple(f'{space}/{side}/image_rect' for side in (left, right)) for space in spaces]
    for pair in pairs:
        assert found(topics, left=pair[0])[::2] == found(topics, right=pair[1])[::2] == pair
    if len(pairs) == 1:
        assert found(topics) == find_stereo_topics('', topics, *pairs[0])
        assert found(topics).right_info == f'{spaces[0]}/{right}/camera_info'
    else:
        assert f"topics: {'; '.join(map(' and '.join, pairs))}; choose" in rejection_of(topics)


def test_both_topics_may_be_chosen_whatever_they_are_called():
    topics = kinds(one__image=RAW, one__camera_info=INFO, two__image=RAW, two__camera_info=INFO)
    assert found(topics, left='/two/image', right='/one/image') == (
        '/two/image', '/two/camera_info', '/one/image', '/one/camera_info')


def test_what_is_there_instead_is_listed():
    assert rejection_of(kinds(imu='sensor_msgs/msg/Imu')) == (
        'the bag has no images; it holds /imu (sensor_msgs/msg/Imu, 5)')
    assert rejection_of(kinds(left__image=RAW)) == (
        'the bag has images of one camera only, /left/image; a pair needs two')
    assert rejection_of(kinds(a=RAW, b=RAW)).endswith(
        'choose with --left and --right among /a, /b')
    assert rejection_of(rig(), left='/left/camera_info') == (
        '--left is /left/camera_info, which is no topic of images in the bag; there are '
        '/left/image_rect, /right/image_rect')
    assert 'are both /left/image_rect' in rejection_of(
        rig(), left='/left/image_rect', right='/left/image_rect')
