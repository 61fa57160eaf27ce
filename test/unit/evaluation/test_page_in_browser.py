# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an evaluation in a browser, wide and narrow."""
from browser import CHROMIUM, opened_tab
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import pytest

pytest.importorskip('jinja2', reason='the extra evaluate is not installed')
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason='Chromium is not installed')

WIDER = """[...document.querySelectorAll('body, body *')].filter(
    each => each.getBoundingClientRect().right > innerWidth + 0.5
            || each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 0
               && getComputedStyle(each).overflowX != 'visible').map(each => each.outerHTML)"""
BROKEN = """Promise.all([...document.images].map(each => each.decode().then(
    () => each.naturalWidth > 0, () => false))).then(all => all.filter(one => !one).length)"""
SHOWN = """[...document.querySelectorAll('.pair')].filter(
    each => each.offsetHeight > 0).map(each => each.id)"""


@pytest.fixture(scope='module')
def pages(tmp_path_factory):
    """Return {what was evaluated: the path of its page}, each of three pairs."""
    place = tmp_path_factory.mktemp('pages')
    made = str(place / 'made')
    assert main(['synthesise', '--output', made, '--rows', '90', '--columns', '200',
                 '--disparities', '24', '--frames', '3']) == 0
    for number, name in enumerate(('one', 'two', 'a_name_of_a_scene_that_is_very_long_' * 3)):
        pair = make_pair(60 + number, 420, 24)
        (place / 'scenes' / name).mkdir(parents=True)
        for side in ('left', 'right'):
            write_image(place / 'scenes' / name / f'{side}.png', getattr(pair, side))
    pages = {}
    for what, words in {'with truth': [made],
                        'scenes without truth': [str(place / 'scenes')]}.items():
        pages[what] = place / f'{what}.html'
        assert main(['evaluate', *words, '--repeats', '1', '--html', str(pages[what])]) == 0
    return pages


@pytest.fixture(scope='module')
def tab(tmp_path_factory):
    with opened_tab(tmp_path_factory.mktemp('chromium')) as tab:
        yield tab


@pytest.mark.parametrize('what', ['with truth', 'scenes without truth'])
@pytest.mark.parametrize('width', [1600, 1280, 1000, 999, 600, 390, 320])
def test_every_pair_fits_the_page_and_is_chosen_by_keyboard(pages, tab, what, width):
    tab.show(pages[what], width)
    assert tab.value(BROKEN) == 0 and tab.value('document.images.length') >= 3 * 6
    tab.press('Tab')
    for place in (1, 2, 3):
        assert tab.value(SHOWN) == [f'pair-{place}']
        assert tab.value(WIDER) == []
        tab.press('ArrowRight')
    tab.press('ArrowLeft')
    assert tab.value(SHOWN) == ['pair-3']
    for word, place in (('previous', 2), ('next', 3)):
        tab.value(f"[...document.querySelectorAll('.step label')].find(each => each.offsetHeight "
                  f"&& each.textContent.includes('{word}')).click()")
        assert tab.value(SHOWN) == [f'pair-{place}']
