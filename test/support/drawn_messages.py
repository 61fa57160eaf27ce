# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Strategies of messages with anything in their fields, as stand-ins of ROS's own."""
from array import array
import struct
import zlib

import cv2
from fuzzed import damaged
from fuzzy_stereo_ros.pairs.messages import ENCODINGS
from hypothesis import strategies as st
from made_messages import changed, header, image, info, noise, region
import numpy as np

ROWS, COLUMNS = 8, 12
NUMBER_32 = st.one_of(st.integers(0, 40), st.sampled_from([2**31 - 1, 2**31, 2**32 - 1]),
                      st.integers(0, 2**32 - 1))
REAL = st.one_of(st.floats(-500, 500), st.floats(allow_nan=True, allow_infinity=True),
                 st.sampled_from([0.0, -0.0, 1e-320, 1e-300, 1e300, -1e300, 1e38, 1e39]))
TEXT = st.one_of(st.text(max_size=40), st.sampled_from(
    ['plumb_bob', 'rational_polynomial', 'equidistant', 'fisheye', '']))
ROTATION = cv2.Rodrigues(np.array([0.1, -0.2, 0.05]))[0].ravel().tolist()


def reals(*lengths):
    """Return a strategy of lists of any numbers, mostly of some lengths."""
    return st.one_of(*(st.lists(REAL, min_size=each, max_size=each) for each in lengths),
                     st.lists(REAL, max_size=15))


def headers():
    """Return a strategy of headers with any stamp and frame."""
    return st.builds(lambda second, nanosecond, frame: header((second, nanosecond), frame),
                     st.integers(-2**31, 2**31 - 1), st.integers(0, 2**32 - 1),
                     st.text(max_size=20))


def changes_of(**fields):
    """Return a strategy of {name: value} of one field or of some; the others stay as they are."""
    one = [st.fixed_dictionaries({name: values}) for name, values in fields.items()]
    return st.one_of(st.one_of(one), st.fixed_dictionaries({}, optional=fields))


IMAGES = st.builds(
    changed, st.builds(
        lambda encoding, padding, seed: image(
            noise(ROWS, COLUMNS, ENCODINGS[encoding][1], ENCODINGS[encoding][0], seed), encoding,
            padding, as_data=lambda content: array('B', content)),
        st.sampled_from(sorted(ENCODINGS)), st.integers(0, 3), st.integers(0, 9)),
    changes_of(header=headers(), height=NUMBER_32, width=NUMBER_32, step=NUMBER_32,
               encoding=st.one_of(st.sampled_from(sorted(ENCODINGS)), TEXT),
               is_bigendian=st.integers(0, 255), data=st.binary(max_size=400)))
INFOS = st.builds(
    changed, st.builds(lambda tx, cx: info(tx, cx), st.sampled_from([-24.0, -24.0, 0.0]),
                       st.sampled_from([50.0, 53.5])),
    changes_of(header=headers(), height=NUMBER_32, width=NUMBER_32, binning_x=NUMBER_32,
               binning_y=NUMBER_32, distortion_model=TEXT, d=reals(4, 5, 8, 12, 14), k=reals(9),
               r=st.one_of(st.just(ROTATION), reals(9)), p=reals(12),
               roi=st.builds(region, NUMBER_32, NUMBER_32, NUMBER_32, NUMBER_32)))
# One number of a matrix at a time: a matrix of nothing but strange ones is rejected early.
BENT_INFOS = st.builds(
    lambda message, name, place, value: changed(
        message, {name: [value if at == place % len(getattr(message, name)) else number
                         for at, number in enumerate(getattr(message, name))]}),
    st.builds(lambda tx: info(tx, height=ROWS, width=COLUMNS), st.sampled_from([0.0, -24.0])),
    st.sampled_from('dkrp'), st.integers(0, 11), REAL)


def png(rows, columns, depth=8, colour=0, rest=b''):
    """Return a PNG of a header, and whatever follows instead of its pixels."""
    def chunk(name, content):
        return (struct.pack('>I', len(content)) + name + content
                + struct.pack('>I', zlib.crc32(name + content)))
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack(
        '>IIBBBBB', columns, rows, depth, colour, 0, 0, 0)) + chunk(b'IDAT', rest)
        + chunk(b'IEND', b''))


def jpeg(rows, columns, *options):
    """Return the JPEG of a small image with another size in its header."""
    content = bytearray(cv2.imencode('.jpg', noise(16, 16), options)[1].tobytes())
    frame = content.index(b'\xff\xc2' if options else b'\xff\xc0')
    struct.pack_into('>HH', content, frame + 5, rows, columns)
    return bytes(content)


WHOLE = [cv2.imencode(suffix, pixels, options)[1].tobytes() for suffix, pixels, options in [
    ('.png', noise(ROWS, COLUMNS, 3), []), ('.png', noise(ROWS, COLUMNS, dtype=np.uint16), []),
    ('.png', noise(ROWS, COLUMNS, 4), []), ('.jpg', noise(ROWS, COLUMNS, 3), []),
    ('.jpg', noise(ROWS, COLUMNS), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])]]
FORMATS = st.one_of(st.text(max_size=30), st.builds(
    '{}; {} compressed {}'.format, st.sampled_from([*ENCODINGS, 'bayer_', '']),
    st.sampled_from(['jpeg', 'png', 'tiff']), st.sampled_from(['bgr8', 'rgb8', ''])))
SIZES = st.one_of(st.integers(1, 40), st.integers(1, 2**16 - 1))
FILES = st.one_of(st.sampled_from(WHOLE).flatmap(damaged), st.builds(png, SIZES, SIZES),
                  st.builds(jpeg, SIZES, SIZES), st.binary(max_size=200))
