# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How large a JPEG or PNG says it is, and whether it ends, read before it is decoded."""
import struct

JPEG_START, JPEG_END = b'\xff\xd8\xff', b'\xff\xd9'
PNG_START = b'\x89PNG\r\n\x1a\n'
PNG_SIZE_AT = 16                # bytes, behind the start and the head of the first chunk
# Start of frame, with the size: the markers C0 to CF but for those of tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
JPEG_WITHOUT_LENGTH = frozenset([0x00, 0x01, *range(0xD0, 0xD8)])
JPEG_LAST = 0xD9, 0xDA          # the end, and the scan that is behind the frame's head


def size_in_header(content):
    """
    Return (rows, columns) as the header of a JPEG or PNG has them.

    content: bytes, the whole file. None where it is another file, or has no such header.
    """
    if content.startswith(PNG_START):
        if content[12:PNG_SIZE_AT] != b'IHDR' or len(content) < PNG_SIZE_AT + 8:
            return None
        columns, rows = struct.unpack_from('>II', content, PNG_SIZE_AT)
        return rows, columns
    return _jpeg_size(content) if content.startswith(JPEG_START) else None


def is_cut_off(content):
    """
    Return whether bytes are a JPEG that has no end behind its first scan.

    OpenCV 4 makes grey rows of what is missing and tells nobody.
    """
    if not content.startswith(JPEG_START):
        return False
    behind_heads = max((place for _, place in _jpeg_segments(content)), default=0)
    return content.rfind(JPEG_END, behind_heads) < 0


def _jpeg_size(content):
    for marker, place in _jpeg_segments(content):
        if marker in JPEG_FRAMES and place + 7 <= len(content):
            return struct.unpack_from('>HH', content, place + 3)
    return None


def _jpeg_segments(content):
    """Yield (marker, place behind it) of the segments with a length, up to the first scan."""
    place = 2
    while (place := content.find(b'\xff', place)) >= 0:
        while content[place:place + 1] == b'\xff':      # as many as you like before a marker
            place += 1
        marker = content[place] if place < len(content) else JPEG_LAST[0]
        place += 1
        if marker in JPEG_WITHOUT_LENGTH:
            continue
        if marker == JPEG_LAST[0] or place + 2 > len(content):
            return
        yield marker, place
        if marker in JPEG_LAST:
            return
        place += struct.unpack_from('>H', content, place)[0]
