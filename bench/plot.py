# SPDX-License-Identifier: GPL-3.0-or-later
"""Small plots with logarithmic axes, written as SVG: a panel each, side by side, one legend."""
import math
from dataclasses import dataclass, field
from html import escape

PANEL, HEIGHT = 360, 300
LEFT, RIGHT, TOP, BOTTOM = 56, 14, 30, 46
LEGEND = 24
STYLE = ('text{font:12px sans-serif;fill:#333}.title{font-weight:bold}.grid{stroke:#ddd}'
         '.frame{fill:none;stroke:#888}')


@dataclass
class Series:
    name: str
    color: str
    points: list                                # (x, y)
    line: list = field(default_factory=list)    # where it is not drawn from point to point
    labels: tuple = ()                          # beside the points


@dataclass
class Panel:
    title: str
    x: str
    y: str
    series: list


def number(value):
    return f'{value:.1f}'


def ticks(low, high):
    """1, 2 and 5 times powers of ten, or these alone where there are many."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1, 2, 5) if math.log10(high / low) < 2.5 else (1,)
    found = [step * 10.0 ** decade for decade in decades for step in steps]
    return [value for value in found if low <= value <= high]


def limits(values):
    low, high = min(values), max(values)
    return low / 1.4, high * 1.4


class Axes:
    def __init__(self, panel, left):
        points = [point for series in panel.series for point in (*series.points, *series.line)]
        self.x, self.y = (limits([point[i] for point in points]) for i in (0, 1))
        self.left, self.width = left + LEFT, PANEL - LEFT - RIGHT
        self.height = HEIGHT - TOP - BOTTOM

    @staticmethod
    def _part(value, low, high):
        return math.log(value / low) / math.log(high / low)

    def at(self, point):
        return (self.left + self.width * self._part(point[0], *self.x),
                TOP + self.height * (1.0 - self._part(point[1], *self.y)))


def path(axes, points, color, dashed=False):
    along = ' '.join(','.join(map(number, axes.at(point))) for point in points)
    return (f'<polyline points="{along}" fill="none" stroke="{color}" stroke-width="1.5"'
            + (' stroke-dasharray="5 4"' if dashed else '') + '/>')


def text(x, y, words, anchor='middle', extra=''):
    return f'<text x="{number(x)}" y="{number(y)}" text-anchor="{anchor}"{extra}>' \
           f'{escape(words)}</text>'


def drawn(panel, left):
    axes = Axes(panel, left)
    bottom, right = TOP + axes.height, axes.left + axes.width
    yield text(axes.left + axes.width / 2, TOP - 10, panel.title, extra=' class="title"')
    for value in ticks(*axes.x):
        x, _ = axes.at((value, axes.y[0]))
        yield f'<path d="M{number(x)} {TOP}V{bottom}" class="grid"/>'
        yield text(x, bottom + 16, f'{value:g}')
    for value in ticks(*axes.y):
        _, y = axes.at((axes.x[0], value))
        yield f'<path d="M{axes.left} {number(y)}H{right}" class="grid"/>'
        yield text(axes.left - 6, y + 4, f'{value:g}', 'end')
    yield f'<rect x="{axes.left}" y="{TOP}" width="{axes.width}" height="{axes.height}" ' \
          'class="frame"/>'
    yield text(axes.left + axes.width / 2, bottom + 34, panel.x)
    middle = TOP + axes.height / 2
    yield text(left + 14, middle, panel.y,
               extra=f' transform="rotate(-90 {number(left + 14)} {number(middle)})"')
    for series in panel.series:
        if series.line:
            yield path(axes, series.line, series.color, dashed=True)
        elif len(series.points) > 1:
            yield path(axes, series.points, series.color)
        for i, point in enumerate(series.points):
            x, y = axes.at(point)
            yield f'<circle cx="{number(x)}" cy="{number(y)}" r="3.5" fill="{series.color}"/>'
            if i < len(series.labels):
                near = x > right - 60
                yield text(x - 7 if near else x + 7, y - 6, series.labels[i],
                           'end' if near else 'start')


def write(path_, panels):
    width, height = PANEL * len(panels), HEIGHT + LEGEND
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
             f'width="{width}" height="{height}">', f'<style>{STYLE}</style>',
             f'<rect width="{width}" height="{height}" fill="#fff"/>']
    for i, panel in enumerate(panels):
        parts += drawn(panel, i * PANEL)
    names = {series.name: series.color for panel in panels for series in panel.series}
    letters = sum(len(name) + 5 for name in names)
    x = LEFT
    for name, color in names.items():
        parts.append(f'<circle cx="{number(x)}" cy="{HEIGHT + 4}" r="4" fill="{color}"/>')
        parts.append(text(x + 9, HEIGHT + 8, name, 'start'))
        x += (width - LEFT) * (len(name) + 5) / letters
    with open(path_, 'w', encoding='utf-8') as file:
        file.write('\n'.join([*parts, '</svg>']) + '\n')
