# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What no code of the package does, read from the source: SECURITY.md promises it."""
import ast
import re

from packaging.requirements import Requirement
from pages import text_of
from repository import ROOT

FILES = sorted(file.relative_to(ROOT).as_posix() for file in [
    ROOT / 'setup.py', *(ROOT / 'fuzzy_stereo_ros').rglob('*.py'), *(ROOT / 'launch').glob('*')]
    if file.suffix == '.py')
# They turn bytes into code, or speak with the network.
MODULES = {'asyncio', 'cloudpickle', 'code', 'dill', 'ftplib', 'http', 'imp', 'joblib', 'marshal',
           'pickle', 'pickletools', 'requests', 'runpy', 'shelve', 'smtplib', 'socket',
           'socketserver', 'ssl', 'telnetlib', 'urllib', 'xmlrpc'}
CALLS = {'eval', 'exec', 'compile', '__import__', 'os.system', 'os.popen', 'os.startfile',
         'tempfile.mktemp', 'subprocess.getoutput', 'subprocess.getstatusoutput',
         'yaml.load', 'yaml.load_all', 'yaml.unsafe_load', 'yaml.full_load', 'yaml.Loader',
         'yaml.UnsafeLoader', 'np.fromfile', 'np.memmap', 'cv2.FileStorage'}
BEGINNINGS = ('os.exec', 'os.spawn', 'os.posix_spawn', 'np.lib.')
# These start processes, that compile.
STARTING = {'fuzzy_stereo_ros/matching/compiling.py', 'setup.py'}


def why_rejected(path, node):
    """Return what is wrong with a call, or None."""
    name, given = ast.unparse(node.func), {word.arg: word.value for word in node.keywords}
    if name in CALLS or name.startswith(BEGINNINGS):
        return name
    pickles = given.get('allow_pickle')
    if (name in ('np.load', 'np.save') or pickles is not None) and not (
            isinstance(pickles, ast.Constant) and pickles.value is False):
        return f'{name} without allow_pickle=False'
    if name.startswith('subprocess.'):
        first = node.args[0] if node.args else None
        if path not in STARTING:
            return f'{name} in a module that starts no processes'
        if 'shell' in given or isinstance(first, (ast.Constant, ast.JoinedStr)):
            return f'{name} through a shell, or not of a list'
    if name.endswith(('.execute', '.executescript')) and not isinstance(
            node.args[0], ast.Constant):
        return f'{name} of a text that is put together'
    return None


def breaches(path, source):
    """Return what a source file does that SECURITY.md says it does not."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [node.module or ''] if isinstance(node, ast.ImportFrom) else [
                alias.name for alias in node.names]
            found += [f'imports {name}' for name in names if name.split('.')[0] in MODULES]
        if isinstance(node, ast.Call):
            found += filter(None, [why_rejected(path, node)])
    return found


def test_no_source_file_makes_code_of_data_or_uses_a_shell_or_the_network():
    assert {path: found for path in FILES if (found := breaches(
        path, (ROOT / path).read_text(encoding='utf-8')))} == {}


def test_every_dependency_has_bounds_and_a_reason():
    required = {}       # of setup.py, with its extras, as it stands there
    for node in ast.walk(ast.parse(text_of('setup.py'))):
        if isinstance(node, ast.keyword) and node.arg in ('install_requires', 'extras_require'):
            listed = ast.literal_eval(node.value)
            for line in sum(listed.values(), []) if isinstance(listed, dict) else listed:
                required.setdefault(Requirement(line).name, set()).add(line)
    rows = [[cell.strip() for cell in line.strip('|').split('|')]
            for line in text_of('SECURITY.md').split('## Dependencies')[1].splitlines()
            if line.startswith('|')][2:]
    table = {name: (versions, why) for name, versions, why in rows}
    assert table.keys() == required.keys()
    for name, lines in required.items():
        assert lines == {f'{name}{table[name][0]}'}
        assert re.fullmatch(r'>=[\d.]+,<[\d.]+', table[name][0])
        assert table[name][1]
