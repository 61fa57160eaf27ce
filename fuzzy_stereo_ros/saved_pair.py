# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Save a pair, its match, and all that the match depends on, in a folder: a bug report.

| file | holds |
|---|---|
| left.png, right.png | the images that were matched |
| pair.json | stamp, frame_id, calibration, parameters, history, versions, and further texts |
| arrays.npz | disparity, confidence, points of the Rows; the FrameState before if there was one |
| README.txt | how to match it again |

`fuzzy-stereo match --saved FOLDER` matches it again and says whether the result is the same, bit
for bit. A folder is read by the version that wrote it.
"""
from dataclasses import asdict, dataclass, field, fields, replace
import io
import json
from pathlib import Path
import platform
import tempfile
import zipfile

import cv2
import fuzzy_stereo_ros
from fuzzy_stereo_ros.matching import Match, MatcherConfig
from fuzzy_stereo_ros.matching.evolution import Generation
from fuzzy_stereo_ros.matching.matcher import ALGORITHMS, checked_pair, MOST_SIDE
from fuzzy_stereo_ros.matching.out_of_range import searched
from fuzzy_stereo_ros.matching.over_frames.state import check_array, FrameState, restored
from fuzzy_stereo_ros.matching.row_alignment import Rows
from fuzzy_stereo_ros.matching.row_offsets import LARGEST_OFFSET
from fuzzy_stereo_ros.pairs.calibration import check_range
from fuzzy_stereo_ros.pairs.image_files import read_bytes, read_image, read_json, write_image
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
import numba
from numba.core.registry import cpu_target
import numpy as np

README = """\
A stereo pair with its parameters, the previous frame and the match, saved by fuzzy_stereo_ros {}.
To match it again and compare the result with the saved one, run in this folder:
fuzzy-stereo match --saved .
"""
RESULTS = 'disparity', 'confidence'
ROWS = {**{name: type(value) for name, value in Rows()._asdict().items()},
        'points': int, 'undone': list, 'rig': list}     # as they are recorded


def versions():
    """Return {name: text} of versions, the platform, and the processor that numba compiles for."""
    _, processor, features = cpu_target.target_context.codegen().magic_tuple()
    return {
        'fuzzy_stereo_ros': fuzzy_stereo_ros.__version__,
        'python': platform.python_version(),
        'numpy': np.__version__,
        'numba': numba.__version__,
        'opencv': cv2.__version__,
        'platform': '-'.join((platform.system(), platform.release(), platform.machine(),
                              *platform.libc_ver())),
        'processor': processor,
        'processor_features': ' '.join(
            name[1:] for name in features.split(',') if name.startswith('+')),
    }


@dataclass(frozen=True)
class SavedPair:
    """A pair, its parameters and its match; ValueError if these do not fit each other."""

    pair: StereoPair
    config: MatcherConfig
    state: FrameState | None  # before the match, as rows
    match: Match
    about: dict = field(default_factory=dict)  # {name: text}, further information
    versions: dict = field(default_factory=versions)
    rows: Rows = Rows()

    def __post_init__(self):
        checked_pair(self.pair.left, self.pair.right, self.config)
        check_range(self.pair.calibration)
        shape, rows = self.pair.left.shape[:2], self.rows
        for name in RESULTS:
            check_array(name, getattr(self.match, name), np.float32, shape)
        check_array('points of the rows', rows.points, np.float32, (len(rows.points), 4))
        check_array('undone of the rows', rows.undone, np.float64, (4,))
        if not (np.isfinite(rows.points).all() and (np.abs(rows.undone) <= LARGEST_OFFSET).all()
                and (np.abs(rows.points[:, :3]) <= MOST_SIDE).all()):
            raise ValueError('the rows have points or offsets out of range')
        if self.state is not None:
            self.state.check(searched(self.state.config, self.state.shape[-1]).disparities)
            if self.state.config.reference != self.config.reference:
                raise ValueError(f'the state is of the {self.state.config.reference} image, the '
                                 f'match of the {self.config.reference} one')
        if self.match.warm and (self.state is None or not self.state.fits(
                shape, self.config, self.pair.stamp)):
            raise ValueError('the previous frame took part in the match, but the state is '
                             f"{'missing' if self.state is None else 'of another frame'}")

    @property
    def repeatable(self):
        """The configuration without a deadline: only then are results the same on every run."""
        return replace(self.config, deadline_ms=0.0)


def write_saved_pair(folder, saved):
    """Write a SavedPair into a missing or empty folder, as a whole or not at all; OSError."""
    target = Path(folder).resolve()
    try:
        with tempfile.TemporaryDirectory(
                prefix=f'.{target.name}.', suffix='.part', dir=target.parent) as part:
            whole = Path(part) / target.name    # a folder with the usual permissions
            whole.mkdir()
            _write_files(whole, saved)
            whole.replace(target)
    except OSError as error:
        raise OSError(
            f'{folder} cannot be written: {error.strerror}; give a missing or empty folder in a '
            'folder that exists, has space, and can be written to') from error


def read_saved_pair(folder):
    """Return the SavedPair of a folder; ValueError if it is damaged or of another version."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ValueError(f'{folder} is no folder; give one that holds a saved pair')
    record, content = read_json(folder / 'pair.json'), read_bytes(folder / 'arrays.npz')
    left, right = (read_image(folder / f'{side}.png') for side in ('left', 'right'))
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(one.file_size for one in archive.infolist()) > len(content):
                raise ValueError('its arrays are larger than the file; give uncompressed ones')
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            arrays = dict(stored)
    except Exception as error:  # numpy raises any kind for damaged bytes  # noqa: B902
        raise ValueError(f"{folder / 'arrays.npz'} is damaged: {error}") from error
    try:
        return _saved_pair(record, arrays, left, right)
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        reason = f'it lacks {error}' if isinstance(error, KeyError) else error
        raise ValueError(f'{folder} is damaged or of another version: {reason}; use the version '
                         'of fuzzy_stereo_ros that wrote it') from error


def _write_files(folder, saved):
    pair, match, state = saved.pair, saved.match, saved.state
    write_image(folder / 'left.png', pair.left)
    write_image(folder / 'right.png', pair.right)
    arrays = {name: getattr(match, name) for name in RESULTS}
    record = {
        'stamp': int(pair.stamp), 'frame_id': pair.frame_id,
        'calibration': {**asdict(pair.calibration), 'left': pair.calibration.left._asdict(),
                        'remarks': list(pair.calibration.remarks)},
        'parameters': _parameters(saved.config), 'state': None, 'warm': match.warm,
        'reused': match.reused, 'beyond': match.beyond,
        'needed_disparities': match.needed_disparities, 'motion': match.motion,
        'times': _floats(match.times),
        'generations': [{**asdict(row), 'gains': _floats(row.gains)} for row in match.history],
        'versions': saved.versions, 'about': saved.about,
        'rows': {**saved.rows._asdict(), 'undone': saved.rows.undone.tolist(),
                 'rig': list(saved.rows.rig), 'points': len(saved.rows.points)}}
    arrays['points'] = saved.rows.points
    if state is not None:
        record['state'] = {'config': _parameters(state.config), 'stamp': state.stamp,
                           'frame': state.frame, 'left_shift': state.left_shift,
                           'own': state.numbers()}
        arrays.update(state.arrays())
    stored = io.BytesIO()
    np.savez(stored, **arrays)
    (folder / 'arrays.npz').write_bytes(stored.getvalue())
    (folder / 'pair.json').write_text(json.dumps(record, indent=2) + '\n', encoding='ascii')
    (folder / 'README.txt').write_text(
        README.format(saved.versions['fuzzy_stereo_ros']), encoding='utf-8')


def _parameters(config):
    return {one.name: one.type(getattr(config, one.name)) for one in fields(MatcherConfig)}


def _config(name, record):
    return MatcherConfig(**_checked(
        name, record, {one.name: one.type for one in fields(MatcherConfig)}))


def _floats(numbers):
    return {name: float(value) for name, value in numbers.items()}


def _saved_pair(record, arrays, left, right):
    """Return the SavedPair of the files' content; ValueError, TypeError or KeyError if wrong."""
    def all_of(kind, name, values):
        return _checked(name, values, dict.fromkeys(values, kind))

    _checked('pair.json', record, {
        'stamp': int, 'frame_id': str, 'calibration': dict, 'parameters': dict,
        'state': object, 'warm': bool, 'reused': bool, 'beyond': float, 'needed_disparities': int,
        'motion': str, 'times': dict, 'generations': list, 'versions': dict,
        'about': dict, 'rows': dict})
    calibration = _checked('calibration', record['calibration'], {
        'focal': float, 'baseline': float, 'offset': float, 'left': dict, 'remarks': list})
    projection = _checked('left', calibration['left'], dict.fromkeys(Projection._fields, float))
    pair = StereoPair(left, right, Calibration(**{
        **calibration, 'left': Projection(**projection),
        'remarks': tuple(calibration['remarks'])}), record['stamp'], record['frame_id'])
    config = _config('parameters', record['parameters'])
    kinds = {one.name: one.type for one in fields(Generation)}
    history = [Generation(**{**_checked('generation', row, kinds),
                             'gains': all_of(float, 'gains', row['gains'])})
               for row in record['generations']]
    match = Match(*(arrays.pop(name) for name in RESULTS), history,
                  all_of(float, 'times', record['times']), record['warm'], record['motion'],
                  record['reused'], record['beyond'], record['needed_disparities'])
    rows = _checked('rows', record['rows'], ROWS)
    rows = Rows(**{**rows, 'points': arrays.pop('points'), 'rig': tuple(rows['rig']),
                   'undone': np.array(rows['undone'], np.float64)})
    state = record['state']
    if state is not None:
        state = _state(state, arrays)
    return SavedPair(pair, config, state, match, *(
        all_of(str, name, record[name]) for name in ('about', 'versions')), rows)


def _checked(name, record, kinds):
    """Return a record; ValueError unless it has the names and types of kinds (int for float)."""
    if not isinstance(record, dict) or set(record) != set(kinds):
        raise ValueError(f"{name} is {record!r:.60}; needed are {', '.join(kinds)}")
    for key, kind in kinds.items():
        if not isinstance(record[key], kind) and not (
                kind is float and isinstance(record[key], int)) or (
                isinstance(record[key], bool) and kind in (int, float)):
            raise ValueError(f'{key} is {record[key]!r:.60}, no {kind.__name__}')
        if type(record[key]) is int and not -2**63 <= record[key] < 2**63:
            raise ValueError(f'{key} is {record[key]!r:.60}, which is out of range')
    return record


def _state(record, arrays):
    _checked('state', record, {
        'stamp': object, 'config': dict, 'frame': int, 'left_shift': int, 'own': dict})
    if not isinstance(record['stamp'], (int, type(None))):
        raise ValueError('the stamp of the state is not a number')
    config = _config('parameters of the state', record['config'])
    kind = ALGORITHMS[config.algorithm].state_type
    numbers = _checked('own', record['own'], {
        name: int for name, of_kind in kind.__annotations__.items() if of_kind is int})
    return restored(kind, arrays, numbers, config=config, **{
        name: record[name] for name in ('stamp', 'frame', 'left_shift')})


def comparison(saved, config, match):
    """Return for JSON how a new match, with a config, differs from a SavedPair, bit for bit."""
    differences = {name: _difference(getattr(match, name), getattr(saved.match, name))
                   for name in RESULTS}
    here = versions()
    return {
        'same': not any(found['pixels'] for found in differences.values()),
        'differences': differences,
        'changed': {parameter.name: getattr(config, parameter.name)
                    for parameter in fields(config)
                    if getattr(config, parameter.name) != getattr(
                        saved.repeatable, parameter.name)},
        'deadline_ms': saved.config.deadline_ms,
        'versions': [name for name in here if saved.versions.get(name) != here[name]],
    }


def sentence(found):
    """Return a comparison as text, one to three lines."""
    if found['same']:
        lines = ['the same as saved, bit for bit']
    else:
        lines = ['not the same as saved: ' + ', '.join(
            f"{name} differs in {difference['pixels']} pixels (by {difference['largest']:.6g} at "
            f"most, {difference['valid_in_one']} valid in only one of the two)"
            for name, difference in found['differences'].items() if difference['pixels'])]
    if found['changed']:
        lines.append('results may differ, as these parameters are not those saved: '
                     + ', '.join(found['changed']))
    elif not found['same'] and found['deadline_ms'] > 0:
        lines.append(f"it was saved with a deadline of {found['deadline_ms']:g} ms and matched "
                     'without one now; only without one are results the same on every run')
    if not found['same'] and found['versions']:
        lines.append(f"these differ from the saved ones: {', '.join(found['versions'])}")
    return '\n'.join(lines)


def _difference(now, then):
    different = now.view(np.uint32) != then.view(np.uint32)
    valid_now, valid_then = np.isfinite(now), np.isfinite(then)
    both = different & valid_now & valid_then
    return {'pixels': int(np.count_nonzero(different)),
            'largest': float(abs(now[both] - then[both]).max(initial=0)),
            'valid_in_one': int(np.count_nonzero(valid_now != valid_then))}
