# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ablation: every variant changes the one step it names; fitness is measured alike for all."""
from dataclasses import replace
from functools import partial

from fuzzy_stereo_ros.benchmarks import ablation, variants
from fuzzy_stereo_ros.benchmarks.ablation import (
    balance_table, DEFAULT, Evolution, evolution_table, evolutions, evolve, of_parts, on_scene,
    on_sequence, REALTIME, SINGLE, STILL, still_sequences)
from fuzzy_stereo_ros.benchmarks.datasets import available_sequences, window
from fuzzy_stereo_ros.benchmarks.truth import (
    correlation_table, fittest, genes_of, spearman, truth_beside_result)
from fuzzy_stereo_ros.evaluation.catalogue import Sequence
from fuzzy_stereo_ros.evaluation.ground_truth import bad_percent, KITTI, MIDDLEBURY
from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.over_frames.pictures import luminance_shift
from fuzzy_stereo_ros.matching.paper.possibility import matching_possibility
from fuzzy_stereo_ros.matching.realtime.matcher import Stages
from fuzzy_stereo_ros.matching.realtime.possibility import View
import numpy as np
import pandas as pd
import pytest
from small_scenes import (
    assert_columns_have_names_of_their_own, COLUMNS, DISPARITIES, known, request_for, ROWS,
    small_scene)

NAN = float('nan')
made_known, noisy_scene = partial(known, noise=6.0), partial(small_scene, noise=6.0)
SmallRequest = request_for([noisy_scene(seed) for seed in (1, 2)])


def matched(stages=None, frames=1, **changes):
    """Return the matcher and what came of it after frames of one scene."""
    matcher = StereoMatcher(
        MatcherConfig(disparities=DISPARITIES, threads=1, **{'population': 2, **changes}), stages)
    pair, random, noise = made_known(), np.random.default_rng(7), 4.0 * (frames > 1)
    for _ in range(frames):
        match = matcher.match(*(
            np.clip(image + random.normal(0, noise, image.shape), 0, 255).astype(np.uint8)
            for image in (pair.left, pair.right)))
    return matcher, match


def best(*arguments, **options):
    return matched(*arguments, **options)[0].algorithm.population.genes[0]


def crossed(crossover):
    """Return a child, by a crossover, of the initial population of the scene."""
    return best(Stages(crossover=crossover))


# The variants.

CROSSOVER, MUTATION, PREVIOUS_BEST = (
    next(variant for variant in REALTIME if variant.part == part)
    for part in ('crossover', 'mutation', 'previous best'))
WHOLE, LINE, CUT = CROSSOVERS = [one.stages.crossover for one in REALTIME if one.name in (
    'no crossover: the fitter chromosome as a whole', "the paper's line crossover",
    'minimum cut')]


@pytest.mark.parametrize('crossover', CROSSOVERS)
def test_a_child_is_no_less_fit_than_its_parents_and_its_gain_is_reported(crossover):
    seeds = matched(generations=0)[0].algorithm.population.genes
    matcher, match = matched(Stages(crossover=crossover, mutation=None))
    fitness_of = matcher.algorithm.fitness_of
    child = matcher.algorithm.population.genes[0]
    assert fitness_of(child) >= fitness_of(seeds[0])
    assert match.history[0].gains == {
        'crossover': pytest.approx(fitness_of(child) - fitness_of(seeds[0]), abs=1e-12)}


def test_a_minimum_cut_is_the_fittest_child_and_a_whole_member_the_least_fit():
    fitness_of = matched()[0].algorithm.fitness_of
    whole, regions, cut = (fitness_of(child) for child in (
        crossed(WHOLE), best(), crossed(CUT)))
    assert whole < regions < cut


def test_a_whole_member_is_taken_as_it_is_or_not_at_all():
    seeds = matched(generations=0)[0].algorithm.population.genes
    fitness_of, child = matched()[0].algorithm.fitness_of, crossed(WHOLE)
    fitter = max(seeds, key=fitness_of)
    np.testing.assert_array_equal(child, fitter)


def test_a_cut_child_is_one_parent_above_a_line_and_the_other_below():
    algorithm = matched(Stages(crossover=LINE), generations=0)[0].algorithm
    fitter, other = algorithm.population.genes
    child = algorithm.child_of(other, fitter)
    assert not any(np.array_equal(child, parent) for parent in (fitter, other))
    assert any(np.array_equal(child[:line], other[:line])
               and np.array_equal(child[line:], fitter[line:]) for line in range(1, ROWS))


def test_without_the_prior_the_views_are_still_averaged():
    states = [matched(stages, frames=2)[0].state for stages in (
        None, Stages(previous_best=variants.without_previous_best))]
    np.testing.assert_array_equal(states[0].pictures, states[1].pictures)
    assert states[1].ages.max() == 2


def test_codes_of_grey_classes_differ_by_how_little_possible_a_match_is():
    view, known = View(ROWS, COLUMNS, False, 0), made_known()
    view.read(known.left, 0, luminance_shift(known.left, known.right), 0, ROWS)
    variants.describe_by_grey_classes(view, 0, ROWS)
    code = view.census[:, :, :COLUMNS].transpose(0, 2, 1)
    one, other = code.reshape(-1, 3), code.reshape(-1, 3)[::-1]
    distance = np.unpackbits(one ^ other, axis=1).sum(axis=1)
    grey = known.left.reshape(-1).astype(float)
    by_maximum = matching_possibility(grey, grey[::-1], MatcherConfig().class_sigma)
    assert (view.slopes == 128).all()
    assert spearman(pd.DataFrame({'fitness': by_maximum, 'error': distance})) > 0.5
    assert (distance[grey == grey[::-1]] == 0).all()


# Planes need plain regions, which this scene has not: other tests hold what is without them.
WITHOUT_PLANES = [one for one in REALTIME[1:] if one.part != 'mutation'
                  and not one.name.endswith(('no evolution from frame to frame',
                                             'no vote of plain regions', variants.NOT_FOLLOWED))]


@pytest.mark.parametrize('variant', WITHOUT_PLANES,
                         ids=lambda one: one.name)
def test_every_variant_is_another_matcher_than_the_default(variant):
    population = {'population': 1 if 'population' in variant.changes else 2}
    others = (best(frames=3, **population),
              best(variant.stages, 3, **{**population, **variant.changes}))
    assert (others[0] != others[1]).any()


def test_without_mutation_no_operator_proposes_planes():
    variant, = (one for one in REALTIME if one.part == 'mutation')
    assert list(matched()[1].history[0].gains) == ['crossover', 'planes']
    assert list(matched(variant.stages)[1].history[0].gains) == ['crossover']


# Fitness and error.

def points_of(pairs):
    return pd.DataFrame(pairs, columns=['fitness', 'error'])


def test_the_correlation_is_one_where_fitter_is_better_and_minus_one_where_it_is_worse():
    better = points_of([(step**3, -step) for step in range(6)])
    assert spearman(better) == pytest.approx(1)
    assert spearman(better.assign(error=-better.error)) == pytest.approx(-1)
    assert np.isnan(spearman(better[:3]))
    assert np.isnan(spearman(better.assign(fitness=1.0)))
    assert list(fittest(better, 0.5).index) == [5, 4, 3]


def test_scenes_are_pooled_by_rank_and_as_they_are():
    points = pd.DataFrame([('low', step, 10 - step) for step in range(5)]
                          + [('high', 100 + step, 90 - step) for step in range(5)],
                          columns=['scene', 'fitness', 'error'])
    truths = pd.DataFrame({'scene': ['low', 'high'], 'truth': [4.5, NAN], 'left': [3.0, NAN]})
    rows = {row[0]: row for row in correlation_table(points, truths).rows}
    assert rows['low'][2] == rows['mean of scenes'][2] == pytest.approx(1)
    assert rows['all, ranked within their scene'][2] == pytest.approx(1)
    assert rows['all, as they are'][2] < 0
    assert rows['low'][4:] == (4, 6, 6, 4.5, 3.0)
    assert rows['mean of scenes'][5:] == (46, 46, None, 3.0)


def test_a_truth_is_taken_where_it_is_fitter_and_left_where_it_is_not():
    scene, known, matcher = noisy_scene(), made_known(), matched()[0]
    algorithm, fittest = matcher.algorithm, matcher.algorithm.population.genes[0]
    before = bad_percent(fittest.astype(np.float32), known, 1.0)
    fitness, left = truth_beside_result(scene, known, matcher).values()
    assert fitness == algorithm.fitness_of(genes_of(known.truth, matcher))
    assert 0 < left < before
    unknown = replace(known, truth=np.full_like(known.truth, np.nan))
    assert truth_beside_result(scene, unknown, matcher)['truth'] == algorithm.fitness_of(fittest)
    of_kitti = truth_beside_result(replace(scene, family=KITTI), known, matcher)
    assert np.isnan(list(of_kitti.values())).all()


def test_a_map_becomes_genes_that_the_matcher_can_have():
    matcher = matched()[0]
    found = genes_of(np.array([[-3, 2.4, 2.6, 99]]), matcher)
    np.testing.assert_array_equal(found, [[0, 2, 3, DISPARITIES - 1]])
    assert found.dtype == matcher.algorithm.population.genes.dtype


# The benchmark.

@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(ablation, 'TURNS', 1)


def test_the_trial_of_the_default_is_what_the_matcher_finds(few):
    trials, points, _ = map(pd.DataFrame, on_scene(noisy_scene(), SmallRequest()))
    trials = trials.set_index('name')
    matcher, match = matched(fill=True, population=1)
    trial = trials.loc[DEFAULT.name]
    fittest = matcher.algorithm.population.genes[0]
    assert trial.fitness == matcher.algorithm.fitness_of(fittest)
    assert trial.error == bad_percent(match.disparity, made_known(), 1.0)
    assert trial.fitness < trials.fitness['population of 2, filled in two ways']
    assert trial.milliseconds > 0
    assert len(points.drop_duplicates()) > 0.9 * len(points)     # few are alike by chance
    assert trial.fitness in set(points.fitness)


def test_on_a_drive_the_matcher_that_follows_no_camera_errs_more():
    sequence, = (one for one in available_sequences(None, [noisy_scene()])[0]
                 if (one.group, one.name) == ('made, drive, noise 6', 'seed 1'))
    found = pd.DataFrame(on_sequence(sequence, SmallRequest())).set_index('name').error
    assert found[DEFAULT.name] < 0.9 * found[variants.NOT_FOLLOWED]


def test_a_sequence_is_scored_with_and_without_the_previous_best():
    frames = window(noisy_scene(), 6, 0, frames=4)
    sequence = Sequence('window, noise 6, pan 0', 'one', MIDDLEBURY, DISPARITIES, lambda: frames,
                        scored=range(2, 4))
    errors = {one['name']: one['error'] for one in on_sequence(sequence, SmallRequest())}
    assert errors['no previous frames'] != errors[DEFAULT.name]
    assert set(errors) == {one.name for one in REALTIME if one.moving}


# What each part earns.

def measured(profile, *scenes):
    """Return a DataFrame of trials: of each scene, errors {name of a variant: percent}."""
    return pd.DataFrame([
        {'profile': profile, 'on': SINGLE, 'scene': f'made/{number}', 'name': name,
         'error': error, 'fitness': 0.5, 'milliseconds': 1000.0}
        for number, errors in enumerate(scenes) for name, error in errors.items()])


@pytest.mark.parametrize(('variant', 'errors', 'row'), [
    (CROSSOVER, ([1.0, 1.0], [5.0, 5.0]), (2, 3.0, 3.0, '+0.00')),
    (MUTATION, ([1.0, 2.0], [5.0, 6.0]), (2, 3.0, 4.0, '+25.00')),
    (MUTATION, ([5.0, 4.0],), (1, 5.0, 4.0, '-25.00')),
    (PREVIOUS_BEST, ([4.0, 5.0],), (1, 4.0, 5.0, '+20.00'))])
def test_a_part_earns_what_the_mean_error_without_it_is_larger_in_percent_of_it(
        variant, errors, row):
    found = measured('realtime', {DEFAULT.name: 9.0}, *(
        dict(zip((DEFAULT.name, variant.name), both)) for both in errors))
    rows = [one for one in balance_table(found).rows if one[0] == 'realtime']
    assert [one[2:] for one in rows if one[2] != 'has none'] == [
        (variant.name, SINGLE, *row)]


def test_a_part_has_a_line_for_each_kind_of_pairs_that_it_was_measured_on():
    found = measured('realtime', {DEFAULT.name: 2.0, MUTATION.name: 4.0},
                     {DEFAULT.name: 3.0, MUTATION.name: 4.0})
    found['on'] = found.scene.map({'made/0': 'one kind', 'made/1': 'another'})
    assert [row[3:] for row in balance_table(found).rows if row[2] == MUTATION.name] == [
        ('another', 1, 3.0, 4.0, '+25.00'), ('one kind', 1, 2.0, 4.0, '+50.00')]


def test_all_parts_are_measured_on_single_and_still_pairs_the_previous_best_where_there_is_noise():
    names = [one.name for one in REALTIME]
    trials = pd.DataFrame({'name': names})
    moving = pd.DataFrame([{'kind': kind, 'name': name} for name in names
                           for kind in ('window, noise 6', 'hard cut', STILL)])
    found = of_parts(trials, moving)
    assert [(*key, len(rows)) for key, rows in found.groupby(
        ['on', found.kind.fillna('')], sort=False)] == [
            (SINGLE, '', len(names)), ('windows with noise', 'window, noise 6', 4),
            (STILL, STILL, len(names))]
    noisy = found[found.on == 'windows with noise']
    assert set(noisy.name) == {DEFAULT.name, *(
        one.name for one in REALTIME if one.part == 'previous best')}


def test_only_the_last_frame_of_a_still_scene_is_scored():
    request = SmallRequest()
    one, = still_sequences(request, [noisy_scene()])
    assert one.group == STILL
    assert list(one.scored) == [len(list(one.read())) - 1]


def test_what_takes_seconds_is_taken_apart_on_few_scenes():
    scenes = [small_scene(1, *names) for names in (
        ('middv2', 'teddy'), ('midd2006_third', 'Midd1'), ('midd2006_third', 'Aloe'))]
    assert evolutions(scenes, False) == [
        *(('quality', scene) for scene in scenes[:2]), ('paper', scenes[0])]
    assert [one.scene for one in evolutions(scenes, True)] == scenes[:1] * 2


def test_a_trial_of_an_evolution_is_what_the_matcher_of_a_variant_finds(monkeypatch):
    monkeypatch.setitem(ablation.PROFILES, 'realtime', (DEFAULT, CROSSOVER))
    for variant, trial in zip((DEFAULT, CROSSOVER), evolve(
            Evolution('realtime', noisy_scene())), strict=True):
        matcher, match = matched(variant.stages, population=1, fill=True)
        assert (trial['name'], trial['scene']) == (variant.name, 'small/seed1')
        assert trial['error'] == bad_percent(match.disparity, made_known(), 1.0)
        assert trial['fitness'] == matcher.algorithm.population.fitness[0]
        assert trial['milliseconds'] > 0


def test_the_table_of_a_profile_holds_each_scene_and_the_difference():
    table = evolution_table('quality', measured(
        'quality', *({DEFAULT.name: error, 'other': error + 1} for error in (1.0, 3.0))))
    assert table.columns[:4] == ('', '0', '1', 'mean')
    assert table.rows == [(DEFAULT.name, 1, 3, 2, None, 1, '0.5000'),
                          ('other', 2, 4, 3, '+1.00', 1, '0.5000')]


@pytest.mark.slow
def test_the_report_has_what_parts_earn_errors_fitness_times_and_correlations(few):
    report = ablation.run(SmallRequest(follow=lambda items, title: (
        items if title == 'scenes' else items[:2])))
    titles = [table.title.split(':')[0] for table in report.tables]
    assert titles == ['What each part of each profile earns', 'quality', 'paper'] + [
        'Scenes'] * 4 + ['Sequences'] * 2 + ['Rank correlation of fitness and error']
    assert_columns_have_names_of_their_own(report)
    assert {row[:2] for row in report.tables[0].rows} == {
        (profile, part) for profile in ablation.PROFILES for part in ablation.PARTS}
    assert [row[0] for row in report.tables[3].rows] == [
        *(one.name for one in REALTIME if one.still), '3WAY tuned']
    assert report.skipped[0] == 'a group'
