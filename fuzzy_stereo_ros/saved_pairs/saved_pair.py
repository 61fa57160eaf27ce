# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A pair in a folder, with all that its match depends on and what came of it: a bug report.

| file | holds |
|---|---|
| left.png, right.png | the images, as the matcher was given them |
| calibration.json | the rest of the StereoPair: stamp, frame_id, calibration |
| parameters.json | the MatcherConfig |
| state.npz | the FrameState before the match; missing where there was none |
| disparity.npy, confidence.npy, history.json | the Match |
| about.json | version of this format, what it ran on, and what else there was to tell |
| README.txt | how to match it again |

`fuzzy-stereo match --saved FOLDER` matches it again.
"""
from dataclasses import asdict, dataclass, field, fields, replace
import io
import json
from pathlib import Path
import tempfile

from fuzzy_stereo_ros.matching import Match, MatcherConfig
from fuzzy_stereo_ros.matching.checks import checked_pair
from fuzzy_stereo_ros.matching.evolution import Generation
from fuzzy_stereo_ros.matching.kernels.temporal.sameness import TILE
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type
from fuzzy_stereo_ros.matching.realtime.warm_start import FrameState
from fuzzy_stereo_ros.pairs.image_files import read_image, write_image
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.saved_pairs.checked_files import (
    check_array, check_names, check_record, read_arrays, read_json, read_record)
from fuzzy_stereo_ros.saved_pairs.format_versions import check_format, SAVED_PAIR
from fuzzy_stereo_ros.saved_pairs.versions import versions
import numpy as np

README = """\
A stereo pair with its parameters, the previous frame and the match, saved by fuzzy_stereo_ros {}.
Matched again and compared with what is saved here, by this command in this folder:
fuzzy-stereo match --saved .
"""
STATE_NUMBERS = 'frame', 'disparities', 'min_disparity'


@dataclass(frozen=True)
class SavedPair:
    """
    What was matched, how, and what came of it; ValueError where these do not belong together.

    pair: as it was given to the matcher, its stamp with it. config: what it was matched with.
    state: of the matcher before the match, or None.
    about: {str: str}, what else is worth telling. versions: of what it was matched on.
    """

    pair: StereoPair
    config: MatcherConfig
    state: FrameState | None
    match: Match
    about: dict = field(default_factory=dict)
    versions: dict = field(default_factory=versions)

    def __post_init__(self):
        checked_pair(self.pair.left, self.pair.right, self.config)
        shape = self.pair.left.shape[:2]
        for name in ('disparity', 'confidence'):
            check_array(name, getattr(self.match, name), np.float32, shape)
        if self.state is not None:
            _check_state(self.state, self.config)
        if self.match.warm and (self.state is None or not self.state.fits(
                shape, self.config, self.pair.stamp)):
            raise ValueError('the previous frame took part in the match, but the state is '
                             f"{'missing' if self.state is None else 'of another frame'}")

    @property
    def repeatable(self):
        """The configuration without a deadline: only then are results the same on every run."""
        return replace(self.config, deadline_ms=0.0)


def write_saved_pair(folder, saved):
    """
    Write a SavedPair into a folder, which is there as a whole or not at all.

    folder: str or Path; it is made, or is there and empty. Raises OSError, with what to do, where
    it cannot be written.
    """
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
            f'{folder} cannot be written: {error.strerror}; give a folder that is missing or '
            'empty, in one that is there, has room, and may be written to') from error


def read_saved_pair(folder):
    """
    Return the SavedPair of a folder.

    Raises ValueError where a file is missing or damaged, or was saved by a version that has other
    parameters.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ValueError(f'{folder} is no folder; give one that holds a saved pair')
    parts = {**_read_about(folder), 'pair': _read_pair(folder),
             'config': _read_config(folder / 'parameters.json')}
    parts['state'] = _read_state(folder / 'state.npz', parts['config'])
    parts['match'] = _read_match(folder)
    try:
        return SavedPair(**parts)
    except ValueError as error:
        raise ValueError(f'{folder} is damaged: {error}') from error


def _write_files(folder, saved):
    pair, config, state, match = saved.pair, saved.config, saved.state, saved.match
    write_image(folder / 'left.png', pair.left)
    write_image(folder / 'right.png', pair.right)
    _write_record(folder / 'calibration.json', {
        'stamp': int(pair.stamp), 'frame_id': pair.frame_id, **asdict(pair.calibration),
        'left': pair.calibration.left._asdict()})
    _write_record(folder / 'parameters.json', {
        parameter.name: parameter.type(getattr(config, parameter.name))
        for parameter in fields(config)})
    if state is not None:
        stored = io.BytesIO()
        stamp = [] if state.stamp is None else [state.stamp]
        np.savez(stored, stamp=np.array(stamp, np.int64),
                 **{name: getattr(state, name) for name in _layout(state)},
                 **{name: np.int64(getattr(state, name)) for name in STATE_NUMBERS})
        (folder / 'state.npz').write_bytes(stored.getvalue())
    for name in ('disparity', 'confidence'):
        stored = io.BytesIO()
        np.save(stored, getattr(match, name), allow_pickle=False)
        (folder / f'{name}.npy').write_bytes(stored.getvalue())
    _write_record(folder / 'history.json', {
        'warm': match.warm, 'times': _as_floats(match.times),
        'generations': [{**asdict(row), 'gains': _as_floats(row.gains)}
                        for row in match.history]})
    _write_record(folder / 'about.json', {
        'format': SAVED_PAIR, 'versions': saved.versions, 'about': saved.about})
    (folder / 'README.txt').write_text(
        README.format(saved.versions['fuzzy_stereo_ros']), encoding='utf-8')


def _write_record(path, record):
    path.write_text(json.dumps(record, indent=2) + '\n', encoding='ascii')


def _as_floats(numbers):
    return {name: float(value) for name, value in numbers.items()}


def _read_about(folder):
    """Return versions and about of a folder; ValueError first where its format is another one."""
    path = folder / 'about.json'
    content = read_json(path)
    if isinstance(content, dict) and 'versions' in content:
        check_format(f'{folder}', content.get('format'), SAVED_PAIR)
    record = check_record(path, content, {'format': int, 'versions': dict, 'about': dict})
    del record['format']
    for part in record.values():
        check_record(path, part, dict.fromkeys(part, str))
    return record


def _read_pair(folder):
    path = folder / 'calibration.json'
    kinds = {'stamp': int, 'frame_id': str, 'focal': float, 'baseline': float, 'offset': float,
             'left': dict, 'remarks': list}
    record = read_record(path, kinds)
    left = check_record(path, record['left'], dict.fromkeys(Projection._fields, float))
    stamp, frame_id = record.pop('stamp'), record.pop('frame_id')
    calibration = Calibration(**{
        **record, 'left': Projection(**left), 'remarks': tuple(record['remarks'])})
    return StereoPair(read_image(folder / 'left.png'), read_image(folder / 'right.png'),
                      calibration, stamp, frame_id)


def _read_config(path):
    record = read_record(path, {
        parameter.name: parameter.type for parameter in fields(MatcherConfig)})
    try:
        return MatcherConfig(**record)
    except ValueError as error:
        raise ValueError(f'{path}: {error}') from error


def _read_state(path, config):
    """Return the FrameState of a file, whose reference is the MatcherConfig's; None without."""
    if not path.exists():
        return None
    arrays = read_arrays(path)
    if not isinstance(arrays, dict):
        raise ValueError(f'{path} is damaged: it holds a single array')
    check_names(path, arrays, [parameter.name for parameter in fields(FrameState)
                               if parameter.name != 'reference'])
    for name in STATE_NUMBERS:
        check_array(f'{path}: {name}', arrays[name], np.int64, ())
        arrays[name] = int(arrays[name])
    stamp = arrays['stamp']
    check_array(f'{path}: stamp', stamp, np.int64, (1,) if stamp.size else (0,))
    return FrameState(**{**arrays, 'stamp': int(stamp[0]) if stamp.size else None},
                      reference=config.reference)


def _read_match(folder):
    path = folder / 'history.json'
    record = read_record(path, {'warm': bool, 'times': dict, 'generations': list})
    kinds = {parameter.name: parameter.type for parameter in fields(Generation)}
    for row in record['generations']:
        gains = check_record(path, row, kinds)['gains']
        check_record(path, gains, dict.fromkeys(gains, float))
    times = check_record(path, record['times'], dict.fromkeys(record['times'], float))
    return Match(read_arrays(folder / 'disparity.npy'), read_arrays(folder / 'confidence.npy'),
                 [Generation(**row) for row in record['generations']], times, record['warm'])


def _layout(state):
    """Return {name: (dtype, shape)} of the arrays of a state."""
    shape = (*np.shape(state.labels), 0, 0)[:2]     # labels must have two dimensions to fit
    tiles = tuple(-(-side // TILE) for side in shape)
    return {'labels': (gene_type(state.disparities), shape), 'verdict': (np.uint8, shape),
            'pictures': (np.uint16, (2, *shape)), 'ages': (np.float32, (2, *tiles))}


def _check_state(state, config):
    for name, (kind, shape) in _layout(state).items():
        check_array(f'{name} of the state', getattr(state, name), kind, shape)
    if (state.labels >= state.disparities).any() or not (state.ages >= 1).all():
        raise ValueError('the state holds labels or ages that no frame has')
    if state.reference != config.reference:
        raise ValueError(f'the state is of the {state.reference} image, the match of the '
                         f'{config.reference} one')
