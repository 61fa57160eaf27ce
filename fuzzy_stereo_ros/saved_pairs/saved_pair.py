# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A pair in a folder, with all that its match depends on and the match itself: a bug report.

| file | holds |
|---|---|
| left.png, right.png | the images, as the matcher was given them |
| pair.json | stamp, frame_id, calibration, parameters, history, versions, and what else to tell |
| arrays.npz | disparity and confidence, and the FrameState before the match where there was one |
| README.txt | how to match it again |

`fuzzy-stereo match --saved FOLDER` matches it again. The version that wrote it reads it.
"""
from dataclasses import asdict, dataclass, field, fields, replace
import io
import json
from pathlib import Path
import tempfile

from fuzzy_stereo_ros.matching import Match, MatcherConfig
from fuzzy_stereo_ros.matching.checks import checked_pair
from fuzzy_stereo_ros.matching.evolution import Generation
from fuzzy_stereo_ros.matching.kernels.temporal.change_detection import TILE
from fuzzy_stereo_ros.matching.realtime.moving_camera import UNSEEN
from fuzzy_stereo_ros.matching.realtime.scanlines import gene_type
from fuzzy_stereo_ros.matching.realtime.warm_start import FrameState
from fuzzy_stereo_ros.pairs.image_files import read_bytes, read_image, read_json, write_image
from fuzzy_stereo_ros.pairs.stereo_pair import Calibration, Projection, StereoPair
from fuzzy_stereo_ros.saved_pairs.reproduction import versions
import numpy as np

README = """\
A stereo pair with its parameters, the previous frame and the match, saved by fuzzy_stereo_ros {}.
Matched again and compared with what is saved here, by this command in this folder:
fuzzy-stereo match --saved .
"""
RESULTS = 'disparity', 'confidence'
STATE_NUMBERS = 'stamp', 'frame', 'disparities', 'min_disparity', 'reference'


@dataclass(frozen=True)
class SavedPair:
    """
    A pair, how it was matched, and the match; ValueError where these do not belong together.

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
        for name in RESULTS:
            _check_array(name, getattr(self.match, name), np.float32, shape)
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

    Raises ValueError where a file is missing or damaged, or was saved by another version.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ValueError(f'{folder} is no folder; give one that holds a saved pair')
    record, arrays = read_json(folder / 'pair.json'), _arrays(folder)
    left, right = (read_image(folder / f'{side}.png') for side in ('left', 'right'))
    try:
        return _saved_pair(record, arrays, left, right)
    except (ValueError, TypeError, KeyError) as error:
        reason = f'it lacks {error}' if isinstance(error, KeyError) else error
        raise ValueError(f'{folder} is damaged or of another version: {reason}; read it by the '
                         'fuzzy_stereo_ros that wrote it') from error


def _write_files(folder, saved):
    pair, match, state = saved.pair, saved.match, saved.state
    write_image(folder / 'left.png', pair.left)
    write_image(folder / 'right.png', pair.right)
    arrays = {name: getattr(match, name) for name in RESULTS}
    record = {
        'stamp': int(pair.stamp), 'frame_id': pair.frame_id,
        'calibration': {**asdict(pair.calibration), 'left': pair.calibration.left._asdict(),
                        'remarks': list(pair.calibration.remarks)},
        'parameters': {one.name: one.type(getattr(saved.config, one.name))
                       for one in fields(MatcherConfig)},
        'state': None, 'warm': match.warm, 'motion': match.motion, 'times': _floats(match.times),
        'generations': [{**asdict(row), 'gains': _floats(row.gains)} for row in match.history],
        'versions': saved.versions, 'about': saved.about}
    if state is not None:
        record['state'] = {name: getattr(state, name) for name in STATE_NUMBERS}
        arrays.update({name: getattr(state, name) for name in _layout(state)})
    stored = io.BytesIO()
    np.savez(stored, **arrays)
    (folder / 'arrays.npz').write_bytes(stored.getvalue())
    (folder / 'pair.json').write_text(json.dumps(record, indent=2) + '\n', encoding='ascii')
    (folder / 'README.txt').write_text(
        README.format(saved.versions['fuzzy_stereo_ros']), encoding='utf-8')


def _floats(numbers):
    return {name: float(value) for name, value in numbers.items()}


def _arrays(folder):
    """Return {name: array} of the arrays of a folder; ValueError where they are damaged."""
    path = folder / 'arrays.npz'
    content = read_bytes(path)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            return dict(stored)
    except Exception as error:  # numpy raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(f'{path} is damaged: {error}') from error


def _saved_pair(record, arrays, left, right):
    """Return the SavedPair of what files hold; ValueError, TypeError or KeyError for others."""
    def text(about):
        return _checked('about', about, dict.fromkeys(about, str))

    def floats(name, numbers):
        return _checked(name, numbers, dict.fromkeys(numbers, float))

    _checked('pair.json', record, {
        'stamp': int, 'frame_id': str, 'calibration': dict, 'parameters': dict,
        'state': object, 'warm': bool, 'motion': str, 'times': dict, 'generations': list,
        'versions': dict, 'about': dict})
    calibration = _checked('calibration', record['calibration'], {
        'focal': float, 'baseline': float, 'offset': float, 'left': dict, 'remarks': list})
    projection = _checked('left', calibration['left'], dict.fromkeys(Projection._fields, float))
    pair = StereoPair(left, right, Calibration(**{
        **calibration, 'left': Projection(**projection),
        'remarks': tuple(calibration['remarks'])}), record['stamp'], record['frame_id'])
    config = MatcherConfig(**_checked('parameters', record['parameters'], {
        one.name: one.type for one in fields(MatcherConfig)}))
    kinds = {one.name: one.type for one in fields(Generation)}
    history = [Generation(**{**_checked('generation', row, kinds),
                             'gains': floats('gains', row['gains'])})
               for row in record['generations']]
    match = Match(*(arrays.pop(name) for name in RESULTS), history,
                  floats('times', record['times']), record['warm'], record['motion'])
    state = record['state']
    if state is not None:
        _checked('state', state, {'stamp': object, 'frame': int, 'disparities': int,
                                  'min_disparity': int, 'reference': str})
        state = FrameState(**arrays, **state)
        if not isinstance(state.stamp, (int, type(None))):
            raise ValueError('the stamp of the state is no number')
    return SavedPair(pair, config, state, match, text(record['about']), text(record['versions']))


def _checked(name, record, kinds):
    """Return a record that has the names and types of kinds; a whole number does for a float."""
    if not isinstance(record, dict) or set(record) != set(kinds):
        raise ValueError(f"{name} is {record!r:.60}; needed are {', '.join(kinds)}")
    for key, kind in kinds.items():
        if not isinstance(record[key], kind) and not (
                kind is float and isinstance(record[key], int)) or (
                isinstance(record[key], bool) and kind in (int, float)):
            raise ValueError(f'{key} is {record[key]!r:.60}, no {kind.__name__}')
    return record


def _layout(state):
    """Return {name: (dtype, shape)} of the arrays of a state."""
    shape = (*np.shape(state.labels), 0, 0)[:2]     # labels must have two dimensions to fit
    tiles = tuple(-(-side // TILE) for side in shape)
    cells = tuple(side // 2 for side in shape)
    return {'labels': (gene_type(state.disparities), shape), 'validity': (np.uint8, shape),
            'pictures': (np.uint16, (2, *shape)), 'ages': (np.float32, (2, *tiles)),
            'planes': (np.float32, (*cells, 3)), 'evolved': (np.uint8, cells),
            'work': (np.uint8, cells), 'origin': (np.uint8, (2,)),
            # none where no camera was known
            **({'half_grey': (np.uint8, cells), 'census': (np.uint32, shape),
                'cells': (np.float32, cells), 'survived': (np.uint8, cells)}
               if np.size(state.half_grey) else
               {name: (array.dtype, array.shape) for name, array in UNSEEN._asdict().items()})}


def _check_state(state, config):
    """Raise ValueError for a state that kernels cannot take: they check no index."""
    for name, (kind, shape) in _layout(state).items():
        _check_array(f'{name} of the state', getattr(state, name), kind, shape)
    if (state.labels >= state.disparities).any() or not (state.ages >= 1).all():
        raise ValueError('the state holds labels or ages that no frame has')
    if not ((state.cells >= 0) & (state.cells < state.disparities)).all():
        raise ValueError('the state holds cells that no frame has')
    if not np.isfinite(state.planes).all() or (state.origin > 1).any():
        raise ValueError('the state holds planes that no frame has')
    if state.reference != config.reference:
        raise ValueError(f'the state is of the {state.reference} image, the match of the '
                         f'{config.reference} one')


def _check_array(name, array, kind, shape):
    if not isinstance(array, np.ndarray) or (array.dtype, array.shape) != (kind, shape):
        raise ValueError(f'{name} is {array.dtype} {array.shape}; needed is '
                         f'{np.dtype(kind)} {shape}')
