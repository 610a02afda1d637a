# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the Markdown tables of the docs from the JSON lines of bench/peers.py.

    python3 bench/table.py FILE.jsonl [--into docs/PAGE.md]

Takes the newest line of each scene, resolution, engine and device. With --into, the tables replace
what stands between <!-- bench:peers --> and <!-- /bench:peers --> in the page.
"""
import argparse
import json
import sys

BEGIN, END = '<!-- bench:peers -->', '<!-- /bench:peers -->'
NAMES = {'BRUME': 'Brume', 'BLENDER_EEVEE': 'EEVEE', 'CYCLES': 'Cycles'}


def newest(path):
    """{(scene, resolution, device, processor): {engine: line}}; later lines replace earlier."""
    groups = {}
    with open(path, encoding='utf-8') as file:
        for text in filter(str.strip, file):
            line = json.loads(text)
            key = line['scene'], tuple(line['resolution']), line['device'], line['processor']
            groups.setdefault(key, {})[line['engine']] = line
    return groups


def row(*cells):
    return '| ' + ' | '.join(str(cell) for cell in cells) + ' |'


def mebibytes(count):
    return f'{count / 2 ** 20:.1f}'


def peers_table(lines):
    yield row('engine', 'samples', 'first frame, s', 'median, s', 'spread, s', 'processor, s',
              'frames')
    yield row('---', *['---:'] * 6)
    for engine in sorted(lines, key=lambda name: lines[name]['median_s']):
        line = lines[engine]
        yield row(NAMES.get(engine, engine), line['samples'],
                  *(f'{line[key]:.2f}' for key in ('first_s', 'median_s', 'spread_s', 'cpu_s')),
                  line['repeats'])


def stages_table(line):
    stages = line['stages_ms']
    yield row('export', *stages)
    yield row(*['---:'] * (1 + len(stages)))
    yield row(*(f'{value:.0f} ms' for value in (line['export_ms'], *stages.values())))


def memory_table(line):
    memory = {key.removesuffix('_bytes'): value for key, value in line['memory'].items()}
    yield row(*memory)
    yield row(*['---:'] * len(memory))
    yield row(*(f'{mebibytes(value)} MiB' for value in memory.values()))


def page(groups):
    for (scene, (width, height), device, processor), lines in groups.items():
        some = next(iter(lines.values()))
        versions = ', '.join(sorted({line['commit'] + (' with changes' if line['modified'] else '')
                                     for line in lines.values()}))
        yield (f'`{scene}.blend` at {width}x{height}, Blender {some["blender"]}; {device} '
               f'({some["driver"]}); {processor}, {some["threads"]} threads; commit {versions}.')
        yield ''
        yield from peers_table(lines)
        yield ''
        if 'BRUME' in lines:
            yield 'Brume\'s stages (wall time of all samples, medians):'
            yield ''
            yield from stages_table(lines['BRUME'])
            yield ''
            yield 'Brume\'s memory on the GPU:'
            yield ''
            yield from memory_table(lines['BRUME'])
            yield ''


def main():
    parser = argparse.ArgumentParser(prog='table.py')
    parser.add_argument('lines')
    parser.add_argument('--into')
    options = parser.parse_args()
    text = '\n'.join(page(newest(options.lines)))
    if not options.into:
        print(text)
        return
    with open(options.into, encoding='utf-8') as file:
        old = file.read()
    if BEGIN not in old or END not in old:
        sys.exit(f'{options.into} has no {BEGIN} … {END}')
    before, rest = old.split(BEGIN, 1)
    after = rest.split(END, 1)[1]
    with open(options.into, 'w', encoding='utf-8') as file:
        file.write(f'{before}{BEGIN}\n{text}\n{END}{after}')


main()
