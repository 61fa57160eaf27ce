# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the repository is, for tests in folders of different depth."""
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
