# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The notebook of the pages runs from its beginning to its end."""
import ast
import base64

import cv2
from node_process import START
import numpy as np
import pytest
from repository import ROOT

nbclient = pytest.importorskip('nbclient', reason='nbclient is not installed')
nbformat = pytest.importorskip('nbformat', reason='nbformat is not installed')
pytest.importorskip('ipykernel', reason='ipykernel is not installed')
pytestmark = pytest.mark.slow       # a kernel of Jupyter starts
PLACE = ROOT / 'docs' / 'first_match.ipynb'


@pytest.fixture(scope='module')
def outputs():
    """Return the outputs of each cell of code, of the notebook run here."""
    notebook = nbformat.read(PLACE, as_version=4)
    nbclient.NotebookClient(notebook, timeout=START, kernel_name='python3',
                            resources={'metadata': {'path': str(ROOT)}}).execute()
    return [cell.outputs for cell in notebook.cells if cell.cell_type == 'code']


def test_a_match_is_shown_in_colours_and_printed_in_one_line(outputs):
    data = outputs[1][-1].data
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(data['image/png']), np.uint8),
                           cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert data['text/plain'].startswith('Match(320x240, ')
    assert outputs[2][0].data['text/plain'] == repr(data['text/plain'])


def test_the_surer_pixels_are_the_fewer_wrong_ones_and_later_frames_are_warm(outputs):
    wrong = ast.literal_eval(outputs[3][0].data['text/plain'])
    assert wrong[0] > wrong[0.8] >= wrong[0.925] >= 0
    assert outputs[5][0].data['text/plain'].count(', warm)') == 2


def test_the_notebook_is_kept_without_outputs():
    notebook = nbformat.read(PLACE, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.outputs or cell.execution_count for cell in notebook.cells
                   if cell.cell_type == 'code')
