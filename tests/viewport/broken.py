# SPDX-License-Identifier: GPL-3.0-or-later
"""A scenario: a library that is not there. That is said in the view; nothing else happens."""

from drive import scenario, shade, views


@scenario()
def no_library():
    shade('RENDERED')
    yield lambda: views() and views()[0].failed
    yield 0.5
    assert views()[0].picture is None
