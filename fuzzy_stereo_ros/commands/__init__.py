# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The commands of `fuzzy-stereo`, one module each.

A module has HELP, one line; DESCRIPTION; EXAMPLE; add_arguments(parser); and run(arguments,
stream), which prints to the stream and returns the exit code, None = 0. A ValueError or OSError of
run means bad input, before anything is written; its text is the sentence that the user reads.
progress_stream: for bars and lines, None = standard error.
"""
