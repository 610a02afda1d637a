# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of the comparison: --refresh renders the Cycles references again, --write-table puts
the differences of a run into the page of the method, --preset takes another of Brume's presets."""
import os

import blenders
from cases import CASES

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PAGE = os.path.join(ROOT, 'docs', 'methods', 'opv.md')
BLENDER = [os.path.join(ROOT, 'scripts', 'blender'), '--factory-startup']
BEGIN, END = '<!-- pictures -->', '<!-- /pictures -->'

differences = []    # (case, difference, tolerance), as the tests find them


def pytest_addoption(parser):
    parser.addoption('--refresh', action='store_true',
                     help='render the Cycles references of the selected cases again')
    parser.addoption('--write-table', action='store_true',
                     help='write the differences into docs/methods/opv.md')
    parser.addoption('--preset', default='PREVIEW', choices=('DRAFT', 'PREVIEW', 'FINAL'),
                     help="Brume's; the cases' tolerances are those of PREVIEW, and FINAL takes "
                          "minutes a case on a software GL")


def pytest_collection_modifyitems(config, items):
    blenders.deselect(config, items, BLENDER)


def table():
    yield '| case | difference | limit |'
    yield '| --- | ---: | ---: |'
    for name, difference, tolerance in differences:
        if CASES[name].method != 'OPV':  # whose page this is
            continue
        yield f'| {name} | {100 * difference:.2f} % | {100 * tolerance:.0f} % |'


def pytest_sessionfinish(session):
    if not session.config.getoption('--write-table') or not differences:
        return
    with open(PAGE, encoding='utf-8') as file:
        before, rest = file.read().split(BEGIN)
    after = rest.split(END)[1]
    with open(PAGE, 'w', encoding='utf-8') as file:
        file.write('\n'.join([before + BEGIN, '', *table(), '', END + after]))
