# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How large a JPEG or PNG says it is, read before a decoder takes memory for that."""
import struct

JPEG_START, PNG_START = b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n'
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


def _jpeg_size(content):
    place = 2
    while (place := content.find(b'\xff', place)) >= 0:
        while content[place:place + 1] == b'\xff':      # as many as you like before a marker
            place += 1
        marker = content[place] if place < len(content) else JPEG_LAST[0]
        place += 1
        if marker in JPEG_WITHOUT_LENGTH:
            continue
        if marker in JPEG_LAST or place + 7 > len(content):
            return None
        if marker in JPEG_FRAMES:
            return struct.unpack_from('>HH', content, place + 3)
        place += struct.unpack_from('>H', content, place)[0]
    return None
