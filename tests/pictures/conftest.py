# SPDX-License-Identifier: GPL-3.0-or-later
"""The --refresh option: render the Cycles references again."""


def pytest_addoption(parser):
    parser.addoption('--refresh', action='store_true',
                     help='render the Cycles references of the selected cases again')
