# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the Markdown tables of the docs from the JSON lines of bench/peers.py, viewport.py,
export.py, opv.py, lpv.py, lpv_parts.py, dom.py or dom_time.py.

    python3 bench/table.py FILE.jsonl [--into docs/PAGE.md]

Takes the newest line of each scene, resolution, engine and device. With --into, the tables replace
what stands between <!-- bench:peers --> and <!-- /bench:peers -->, or bench:viewport and so on, in
the page.
"""
import argparse
import json
import sys

NAMES = {'BRUME': 'Brume', 'BLENDER_EEVEE': 'EEVEE', 'CYCLES': 'Cycles'}


def read(path):
    with open(path, encoding='utf-8') as file:
        return [json.loads(text) for text in filter(str.strip, file)]


def newest(lines):
    """{(scene, resolution, device, processor): {engine: line}}; later lines replace earlier."""
    groups = {}
    for line in lines:
        key = line['scene'], tuple(line['resolution']), line['device'], line['processor']
        groups.setdefault(key, {})[line.get('engine')] = line
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


def version(line):
    return line['commit'] + (' with changes' if line['modified'] else '')


def caption(line, versions):
    width, height = line['resolution']
    return (f'`{line["scene"]}.blend` at {width}x{height}, Blender {line["blender"]}; '
            f'{line["device"]} ({line["driver"]}); {line["processor"]}, {line["threads"]} threads; '
            f'commit {versions}.')


def milliseconds(values, *keys):
    return ' / '.join(f'{values[key]:.1f}' for key in keys) + ' ms'


def viewport_page(groups):
    for lines in groups.values():
        line = lines[None]
        brume, eevee, lamp = line['brume'], line['eevee'], line['lamp']
        yield caption(line, version(line))
        yield ''
        yield row('', 'Brume', 'EEVEE')
        yield row('---', '---:', '---:')
        yield row('pictures a second while orbiting',
                  *(f'{engine["pictures_per_s"]:.1f}' for engine in (brume, eevee)))
        yield row('their pixels, in pixels of the screen', f'{brume["pixel_size"]:g}', '')
        yield row('view_update and view_draw while orbiting: median / 99 % / longest',
                  milliseconds(brume['hold'], 'p50_ms', 'p99_ms', 'max_ms'), '')
        yield row("from a lamp's move to a picture that shows it: median / longest",
                  milliseconds(lamp['shown'], 'p50_ms', 'max_ms'), '')
        yield row("from a lamp's move to the finished picture: median",
                  milliseconds(lamp, 'settled_ms'), '')
        yield row('first picture after switching to Rendered: first time / again',
                  milliseconds(line['picture'], 'first_ms', 'again_ms'), '')
        yield row('of a core, from 5 s after the last change (Blender in solid view)',
                  f'{100 * line["idle"]:.1f} % ({100 * line["idle_without"]:.1f} %)', '')
        yield ''


def page(groups):
    for lines in groups.values():
        some = next(iter(lines.values()))
        versions = ', '.join(sorted({version(line) for line in lines.values()}))
        yield caption(some, versions)
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


def export_page(lines):
    line = lines[-1]
    times = line['export_ms']
    yield (f'Blender {line["blender"]}; {line["processor"]}, {line["threads"]} threads; commit '
           f'{version(line)}. Milliseconds, the best of {line["repeats"]}.')
    yield ''
    yield row('', *times)
    yield row('---', *['---:'] * len(times))
    for edit in next(iter(times.values())):
        yield row(edit, *(f'{case[edit]:.1f}' for case in times.values()))
    yield ''


WAYS = {'PROPAGATED': 'Brume: from brick to brick', 'MARCHED': 'each node marched',
        'CORRECTED': 'six neighbours, corrected',
        'PAPER': 'six neighbours, as published, by wavefronts',
        'ITERATED': 'as published: all nodes in all iterations'}


def lights_of(count):
    return f'{count} light' + ('s' if count != '1' else '')


def opv_page(lines):
    line = lines[-1]
    width, height = line['resolution']
    yield (f'{line["device"]}; {line["processor"]}, {line["threads"]} threads; commit '
           f'{version(line)}. Pictures of {width}x{height} pixels, one sample each.')
    yield ''
    yield 'Frames a second; in brackets the propagation in them, ms (the paper\'s Table 2):'
    yield ''
    columns = next(iter(line['table_2'].values()))
    yield row('cells', *(lights_of(name) if name.isdigit() else '1 light, static'
                         for name in columns))
    yield row('---', *['---:'] * len(columns))
    for size, cells in line['table_2'].items():
        yield row(f'{size}³', *(
            f'{1000 / cell["frame_ms"]:.0f}' + (f' ({cell["propagation_ms"]:.1f})'
                                                if name.isdigit() else '')
            for name, cell in cells.items()))
    yield ''
    yield 'Frames a second with 20³ cells and two lights (the paper\'s Table 3):'
    yield ''
    yield row('Gaussians', 'all of them changing', 'static')
    yield row('---:', '---:', '---:')
    for count, cells in line['table_3'].items():
        yield row(count, *(f'{1000 / cells[key]["frame_ms"]:.0f}' for key in ('dynamic', 'static')))
    yield ''
    yield 'Propagation at 40³, ms:'
    yield ''
    yield row('', *map(lights_of, next(iter(line['ways'].values()))))
    yield row('---', *['---:'] * len(next(iter(line['ways'].values()))))
    for way, cells in line['ways'].items():
        yield row(WAYS[way], *(f'{cell["propagation_ms"]:.1f}' for cell in cells.values()))
    yield ''
    many = line['many']
    yield (f'{many["lights"]} lights at {many["cells"]}³: {many["frame_ms"] / 1000:.1f} s for the '
           f'frame that propagates all of them, {mebibytes(many["transport_bytes"])} MiB for their '
           f'depths.')
    yield ''


PATHS = {'DIRECT': 'direct: surfaces, straight from the lights',
         'REFLECTED': 'direct, and what surfaces reflect to one another',
         'SINGLE': 'direct, and what media scatter once',
         'REFLECTED_MARCHED': 'reflected, and what media scatter of it to the camera',
         'SUM': 'the last two added up', 'ALL': 'everything'}


def lpv_page(lines):
    """The newest measurement of each scene."""
    line = lines[-1]
    width, height = line['resolution']
    scenes, versions = {}, {}
    for some in lines:
        for name, found in some['scenes'].items():
            scenes[name], versions[name] = found, version(some)
    yield (f'{line["device"]}; commit {", ".join(dict.fromkeys(versions.values()))}. Pictures of '
           f'{width}x{height} pixels, preset Preview, iterations until converged.')
    yield ''
    yield row('light', 'cells', *(f'`{name}.blend`' for name in scenes))
    yield row('---', '---:', *['---:'] * len(scenes))
    for paths, name in PATHS.items():
        for key, cells in ((paths, line['cells']), (f'{paths}_{line["finer"]}', line['finer']),
                           (f'{paths}_CASCADES', f'{line["cells"]}, 2 cascades')):
            if all(key in scene['errors'] for scene in scenes.values()):
                yield row(name, cells,
                          *(f'{100 * scene["errors"][key]:.1f} %' for scene in scenes.values()))
    yield row('Cycles\' own noise', '', *(f'{100 * scene["noise"]:.1f} %'
                                          for scene in scenes.values()))
    yield ''


PART_NAMES = {'surfaces': 'links that surfaces cut', 'media': 'media of cells',
              'reflected': 'injection of reflected light',
              'scattered': 'injection of light scattered once', 'blockers': 'injection of blockers',
              'aggregate': 'aggregation of input', 'prepare': 'blocking factors',
              'iterations': 'iterations', 'copy': 'copy'}


def lpv_parts_page(lines):
    line = lines[-1]
    kinds, sizes = list(line['parts']), list(line['parts']['LINKS'])
    yield (f'{line["device"]}; commit {version(line)}. Milliseconds, medians of '
           f'{line["repeats"]} frames.')
    yield ''
    yield row('', *(f'{"exact" if kind == "LINKS" else "fuzzy"} blockers, {size}³'
                    for kind in kinds for size in sizes))
    yield row('---', *['---:'] * (len(kinds) * len(sizes)))
    for part, name in PART_NAMES.items():
        label = f'{line["iterations"]} {name}' if part == 'iterations' else name
        yield row(label, *(f'{found:.1f}' if (found := line['parts'][kind][size][part]) else ''
                           for kind in kinds for size in sizes))
    yield ''
    yield (f'The march of the view: {line["march"]["full"]:.1f} ms, at half the resolution '
           f'{line["march"]["half"]:.1f} ms.')
    yield ''


BESIDE = {'shaders_ms': 'shaders: iteration', 'plain_ms': 'plain C: iteration',
          'source_ms': 'its source', 'sweep_ms': 'sweep', 'gather_ms': 'gather'}
SERIES = {'cells': ('cells', lambda value: f'{value}³'),
          'ordinates': ('directions', str), 'iterations': ('iterations', str)}


def beside_table(beside):
    yield row('cells', 'directions', *(f'{name}, ms' for name in BESIDE.values()),
              'shaders, million cells and directions a second', 'plain C', 'fields apart')
    yield row('---:', '---:', *['---:'] * (len(BESIDE) + 3))
    for found in beside:
        amount = found['cells'] ** 3 * found['ordinates'] / 1e3
        yield row(f'{found["cells"]}³', found['ordinates'],
                  *(f'{found[key]:.1f}' for key in BESIDE),
                  *(f'{amount / found[key]:.1f}' for key in ('shaders_ms', 'plain_ms')),
                  f'{100 * found["apart"]:.2f} %')


def costs_table(costs):
    yield row('', 'all iterations, ms', 'ns a cell, direction and iteration', 'off the line')
    yield row('---', *['---:'] * 3)
    for key, entries in costs.items():
        name, told = SERIES[key]
        for entry in entries:
            yield row(f'{told(entry["value"])} {name}', f'{entry["ms"]:.1f}', f'{entry["ns"]:.0f}',
                      f'{100 * entry["off"]:+.0f} %')


def memory_table_of_dom(memory, sizes):
    yield row('cells', 'directions', 'kept: bytes a cell', 'at most', 'as reckoned')
    yield row(*['---:'] * 5)
    for entry in memory:
        reckoned = (sizes['cell_bytes'] + sizes['working_bytes']
                    + sizes['ordinate_bytes'] * entry['ordinates'])
        yield row(f'{entry["cells"]}³', entry['ordinates'], f'{entry["kept"]:.0f}',
                  f'{entry["most"]:.0f}', reckoned)


def dom_page(lines):
    line = lines[-1]
    usual = line['usual']
    yield (f'{line["device"]}; {line["processor"]}, {line["threads"]} threads; commit '
           f'{version(line)}. Medians of {line["repeats"]}. Shaders also compare and mix '
           'iterations, which plain C does not.')
    yield ''
    yield from beside_table(line['beside'])
    yield ''
    yield (f'Shaders, with {usual["cells"]}³ cells, {usual["ordinates"]} directions and '
           f'{usual["iterations"]} iterations where nothing else is said; *off the line*: from the '
           'straight line through the series:')
    yield ''
    yield from costs_table(line['costs'])
    yield ''
    yield 'Memory, optical depths included; what is reckoned is without these:'
    yield ''
    yield from memory_table_of_dom(line['memory'], line['beside'][0])
    yield ''


KINDS = {'OPV': 'OPV', 'LPV': 'LPV', 'DOM_DRAFT': 'DOM, Draft', 'DOM_PREVIEW': 'DOM, Preview',
         'DOM_FINAL': 'DOM, Final', 'EEVEE': 'EEVEE'}


def dom_time_rows(name, found):
    for kind, frame in found['frames'].items():
        other = frame['cycles']['pixels']
        yield row(f'`{name}.blend`', KINDS[kind], f'{frame["wall_s"]:.2f}',
                  f'{100 * frame["pixels"]:.1f} %', f'{100 * frame["blocks"]:.1f} %',
                  f'{other["samples"]:.0f}', f'{other["wall_s"]:.1f}',
                  f'{other["wall_s"] / frame["wall_s"]:.1f}',
                  f'{other["cpu_s"] / frame["cpu_s"]:.1f}')


def spent_table(scenes, kind):
    """Where the time of a method's frames goes."""
    some = next(iter(scenes.values()))['frames'][kind]
    parts = [part for part in some['field_ms']
             if any(found['frames'][kind]['field_ms'][part] for found in scenes.values())]
    yield row('', 'export', *some['stages_ms'], *parts, 'iterations done')
    yield row('---', *['---:'] * (2 + len(some['stages_ms']) + len(parts)))
    for name, found in scenes.items():
        frame = found['frames'][kind]
        yield row(f'`{name}.blend`', *(f'{value:.0f}' for value in (
            frame['export_ms'], *frame['stages_ms'].values(),
            *(frame['field_ms'][part] for part in parts), frame['iterations'])))


def dom_time_page(lines):
    """The newest measurement of each scene in the newest one's resolution."""
    line = lines[-1]
    width, height = line['resolution']
    scenes = {some['scene']: some for some in lines if some['resolution'] == line['resolution']}
    versions = dict.fromkeys(version(found) for found in scenes.values())
    yield (f'{width}x{height} pixels; {line["device"]}; {line["processor"]}, {line["threads"]} '
           f'threads; commit {", ".join(versions)}.')
    yield ''
    yield row('scene', 'engine', 'frame, s', 'pixels off', 'blocks off', 'Cycles\' samples',
              'its time, s', 'times as long', 'of the processor')
    yield row('---', '---', *['---:'] * 7)
    for name, found in scenes.items():
        yield from dom_time_rows(name, found)
    yield ''
    yield 'Cycles as it was measured, and how its squared errors fell with its samples N:'
    yield ''
    yield row('scene', 'samples', 'time, s', 'pixels off', 'N to the', 'farthest from the fit',
              'reference')
    yield row('---', *['---:'] * 6)
    for name, found in scenes.items():
        points, fitted = found['cycles'], found['fit']
        yield row(f'`{name}.blend`', ' / '.join(str(point['samples']) for point in points),
                  ' / '.join(f'{point["wall_s"]:.1f}' for point in points),
                  ' / '.join(f'{100 * point["pixels"]:.1f} %' for point in points),
                  f'{fitted["pixels_power"]:.2f}', f'{100 * fitted["pixels_misfit"]:.0f} %',
                  f'{found["reference"]["samples"]} samples')
    yield ''
    for kind in ('DOM_DRAFT', 'DOM_PREVIEW', 'DOM_FINAL'):
        if not all(kind in found['frames'] for found in scenes.values()):
            continue
        yield f'{KINDS[kind]}: stages, wall time in ms; from the ninth on parts of transport:'
        yield ''
        yield from spent_table(scenes, kind)
        yield ''
    for name in scenes:
        yield f'![{name}: error against time](../images/dom_time_{name}.svg)'
        yield ''


PAGES = {'peers': page, 'viewport': viewport_page}
WHOLE_PAGES = {'export': export_page, 'opv': opv_page, 'lpv': lpv_page,
               'lpv_parts': lpv_parts_page, 'dom': dom_page,
               'dom_time': dom_time_page}


def main():
    parser = argparse.ArgumentParser(prog='table.py')
    parser.add_argument('lines')
    parser.add_argument('--into')
    options = parser.parse_args()
    lines = read(options.lines)
    bench = lines[-1].get('bench', 'peers')
    text = '\n'.join(WHOLE_PAGES[bench](lines) if bench in WHOLE_PAGES
                     else PAGES[bench](newest(lines)))
    if not options.into:
        print(text)
        return
    begin, end = f'<!-- bench:{bench} -->', f'<!-- /bench:{bench} -->'
    with open(options.into, encoding='utf-8') as file:
        old = file.read()
    if begin not in old or end not in old:
        sys.exit(f'{options.into} has no {begin} … {end}')
    before, rest = old.split(begin, 1)
    after = rest.split(end, 1)[1]
    with open(options.into, 'w', encoding='utf-8') as file:
        file.write(f'{before}{begin}\n{text}\n{end}{after}')


main()
