# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The commands of `fuzzy-stereo`, a module each.

Each has HELP, a line; DESCRIPTION; EXAMPLE; add_arguments(parser), those of the matcher among
them; and run(arguments, stream), which prints to the stream and returns the exit code, None for 0.
A ValueError or OSError of run is bad input: its text is the one sentence the user reads.
"""
