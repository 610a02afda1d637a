# SPDX-License-Identifier: GPL-3.0-or-later
"""How far off pictures are against the time they take: Brume's methods, EEVEE, and Cycles with ever
more samples. Appends a JSON line a scene to out/bench/dom_time.jsonl, which --plots draws as
docs/images/dom_time_SCENE.svg; pictures, Brume | Cycles | difference, go to out/bench/dom_time:

    python3 bench/dom_time.py [--scenes cube cloud ...] [--quick]
    python3 bench/dom_time.py --plots

Errors are of linear RGB, of pixels or of means of blocks, 32 in a row: the root of the mean square
of the difference, over the mean of the reference; nothing is clipped. References are two halves, R1
and R2, of Cycles' seeds; the mean of (picture - R1) (picture - R2) is the square without their
noise, so that a few samples are enough. They are kept in build/references; --pairs asks for more.

Times are of whole frames, the scene exported anew; those of Brume and EEVEE are medians without the
first, which compiles. All engines take turns. Cycles has 64 bounces, nothing clamped or denoised;
with N samples its time is t0 + t1 N, the square of its error c / N, both fitted to measurements.
"""
import argparse
import json
import os
import statistics
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import cycles
import plot
from cycles import Case
from opv import native
from place import ROOT, here, keep

sys.path.insert(0, os.path.join(ROOT, 'tests', 'pictures'))
import compare

PICTURES = os.path.join(ROOT, 'out', 'bench', 'dom_time')
SCENES = ('cube', 'cloud', 'plume_vdb', 'smoke_sky', 'lantern', 'room_smoke', 'room', 'arcade')
SIZE, QUICK = (640, 360), (320, 180)
COLUMNS = 32
REFERENCE_SAMPLES = 64  # a seed
PRESETS = ('DRAFT', 'PREVIEW', 'FINAL')
SAMPLES = (4, 16, 64, 256, 1024)
ALWAYS = 3              # so many of these, however long they take
FIRST_SEED = 1000000    # of pictures that are timed: none that a reference has
OUR_JOBS = {
    'OPV': {'engine': 'BRUME', 'settings': {'preset': 'PREVIEW', 'method': 'OPV'}},
    'LPV': {'engine': 'BRUME', 'settings': {'preset': 'PREVIEW', 'method': 'LPV'}},
    **{f'DOM_{preset}': {'engine': 'BRUME', 'settings': {'preset': preset, 'method': 'DOM'}}
       for preset in PRESETS},
    'EEVEE': {'engine': 'BLENDER_EEVEE', 'settings': {}}}


# --- Errors


def blocks(picture):
    height, width, channels = picture.shape
    side = width // COLUMNS
    if width % COLUMNS or height % side:
        raise ValueError(f'{width}x{height} pixels do not divide into blocks')
    return picture.reshape(height // side, side, COLUMNS, side, channels).mean(axis=(1, 3))


def square(picture, halves):
    """(the mean square of the difference, its standard error that the halves' noise is to blame
    for), in squares of the reference's mean."""
    one, other = halves
    mean = (one + other) / 2
    noise, apart = ((one - other) / 2) ** 2, (picture - mean) ** 2
    scale = mean.mean() ** 2
    error = np.sqrt((4.0 * apart * noise + 4.0 / 3.0 * noise ** 2).sum()) / apart.size
    return (apart - noise).mean() / scale, error / scale


def errors(picture, halves):
    if not np.isfinite(picture).all():
        raise ValueError('the picture has NaN or infinite pixels')
    picture = picture.astype(np.float64)
    pixels, uncertain = square(picture, halves)
    return {'pixels': root(pixels), 'blocks': root(square(blocks(picture), [
        blocks(half) for half in halves])[0]),
        'pixels_uncertain': uncertain / (2.0 * max(root(pixels), root(uncertain), 1e-9))}


def root(value):
    return float(np.sqrt(max(value, 0.0)))


# --- Cycles


def fit(points):
    """What Cycles takes and how far off it is: t0, t1 by relative least squares, c of pixels and
    blocks, weighted by samples (few of them rarely meet what is bright and rare); "power" is that
    of N as it was measured, -1 in theory."""
    n = np.array([point['samples'] for point in points], float)
    found = {}
    for key in ('wall_s', 'cpu_s'):
        t = np.array([point[key] for point in points])
        t0, t1 = np.linalg.lstsq(np.stack([1 / t, n / t], axis=1), np.ones_like(t), rcond=None)[0]
        if t0 < 0.0:
            t0, t1 = 0.0, (n / t).sum() / ((n / t) ** 2).sum()
        found[key] = [float(t0), float(t1)]
    for key in ('pixels', 'blocks'):
        squares = np.array([point[key] for point in points]) ** 2
        found[key] = float((n * n * squares).sum() / n.sum())
        logs = np.log(n), np.log(np.maximum(squares, 1e-12))
        found[f'{key}_power'] = float(np.polyfit(*logs, 1)[0])
        found[f'{key}_misfit'] = float(np.abs(np.sqrt(squares * n / found[key]) - 1).max())
    return found


def to_reach(fitted, error, key):
    """(samples, wall, processor seconds) of Cycles until it is only so far off."""
    samples = max(fitted[key] / max(error, 1e-6) ** 2, 1.0)
    return samples, *(fitted[time][0] + fitted[time][1] * samples for time in ('wall_s', 'cpu_s'))


def merged(points):
    """One of each number of samples: times are medians, errors roots of mean squares."""
    found = []
    for samples in sorted({point['samples'] for point in points}):
        some = [point for point in points if point['samples'] == samples]
        one = {'samples': samples, 'seeds': len(some)}
        for key in ('wall_s', 'cpu_s'):
            one[key] = statistics.median(point[key] for point in some)
        for key in ('pixels', 'blocks'):
            one[key] = root(np.mean([point[key] ** 2 for point in some]))
        found.append(one)
    return found


# --- The plot

ENGINES = {  # series: name, colour, the frames that are its points and what is beside these
    'single scattering (OPV)': ('#7f7f7f', {'OPV': ''}), 'LPV': ('#2ca02c', {'LPV': ''}),
    'DOM': ('#d62728', {f'DOM_{preset}': preset.capitalize() for preset in PRESETS}),
    'EEVEE': ('#9467bd', {'EEVEE': ''})}


def panel(title, found, key):
    frames, fitted = found['frames'], found['fit']
    least = max(min(frame[key] for frame in frames.values()), 1e-4)
    last = max(found['cycles'][-1]['samples'], to_reach(fitted, least, key)[0])
    counts = np.geomspace(found['cycles'][0]['samples'], last, 24)
    t0, t1 = fitted['wall_s']
    series = [plot.Series('Cycles', '#1f77b4',
                          [(point['wall_s'], point[key]) for point in found['cycles']],
                          [(t0 + t1 * n, float(np.sqrt(fitted[key] / n))) for n in counts],
                          tuple(str(point['samples']) for point in found['cycles']))]
    for name, (color, labels) in ENGINES.items():
        if wanted := [frame for frame in labels if frame in frames]:
            series.append(plot.Series(
                name, color,
                [(frames[frame]['wall_s'], max(frames[frame][key], 1e-4)) for frame in wanted],
                labels=tuple(labels[frame] for frame in wanted)))
    return plot.Panel(title, 'seconds a frame', 'error', series)


def draw(name, found):
    plot.write(os.path.join(ROOT, 'docs', 'images', f'dom_time_{name}.svg'),
               [panel(f'{name}: pixels', found, 'pixels'),
                panel(f'{name}: blocks', found, 'blocks')])


def draw_kept():
    """The newest line of each scene, in the newest one's resolution: those that tables show."""
    with open(os.path.join(ROOT, 'out', 'bench', 'dom_time.jsonl'), encoding='utf-8') as file:
        lines = [json.loads(text) for text in file]
    for name, line in {line['scene']: line for line in lines
                       if line['resolution'] == lines[-1]['resolution']}.items():
        draw(name, line)


# --- A scene


def in_turn(rounds, kinds):
    """Jobs and their names: Cycles once with one sample, which reads its kernels, then all."""
    jobs = [('', cycles.job(1, FIRST_SEED - 1))]
    for number in range(rounds):
        jobs += [(kind, {'name': kind, **OUR_JOBS[kind]}) for kind in kinds]
        jobs += [(samples, cycles.job(samples, FIRST_SEED + number))
                 for samples in SAMPLES[:ALWAYS if number == 0 else ALWAYS - 1]]
    return jobs


def seen_by_cycles(case, jobs, halves, results):
    points = []
    for (samples, _), picture, took in zip(jobs, *results):
        if isinstance(samples, int):
            points.append({'samples': samples, 'wall_s': took['wall_s'], 'cpu_s': took['cpu_s'],
                           **errors(picture, halves)})
    return points


def more_of_cycles(case, points, halves, limit_s):
    """With as many samples as the time limit lets it take."""
    for samples in SAMPLES[ALWAYS:]:
        t0, t1 = fit(merged(points))['wall_s']
        if t0 + t1 * samples > limit_s:
            return
        jobs = [('', cycles.job(1, FIRST_SEED - 1)), (samples, cycles.job(samples, FIRST_SEED))]
        points += seen_by_cycles(case, jobs, halves, cycles.run(case, [job for _, job in jobs]))


def medians(items):
    """Of numbers, and of those in dictionaries."""
    some = items[0]
    if isinstance(some, dict):
        return {key: medians([item[key] for item in items]) for key in some}
    return statistics.median(items)


def measure(name, size, options):
    case = Case(name, REFERENCE_SAMPLES, size)
    pairs, halves = cycles.halves(case, options.pairs)
    jobs = in_turn(1 + options.repeats, options.kinds)
    results = cycles.run(case, [job for _, job in jobs], options.long)
    points = seen_by_cycles(case, jobs, halves, results)
    more_of_cycles(case, points, halves, options.limit)
    points = merged(points)
    fitted, frames = fit(points), {}
    for wanted in options.kinds:
        mine = [(picture, took) for (job, _), picture, took in zip(jobs, *results)
                if job == wanted and took]
        apart = errors(mine[-1][0], halves)
        compare.side_by_side(os.path.join(PICTURES, f'{name}-{wanted}.png'), mine[-1][0],
                             (halves[0] + halves[1]) / 2)
        frames[wanted] = {
            'first_s': mine[0][1]['wall_s'], 'frames': len(mine) - 1, **apart,
            **medians([took for _, took in mine[1:]]),
            'cycles': {key: dict(zip(('samples', 'wall_s', 'cpu_s'),
                                     to_reach(fitted, apart[key], key)))
                       for key in ('pixels', 'blocks')}}
    return {'frames': frames, 'cycles': points, 'fit': fitted,
            'reference': {'samples': 2 * pairs * REFERENCE_SAMPLES,
                          'noise': root(((halves[0] - halves[1]) ** 2).mean()) / 2
                          / float(np.mean(halves))}}


def told(name, found):
    lines = [f'{name}: reference\'s noise {found["reference"]["noise"]:.3f} of its pixels']
    for point in found['cycles']:
        lines.append(f'  Cycles {point["samples"]:5} {point["wall_s"]:8.2f} s  '
                     f'{point["pixels"]:.4f} {point["blocks"]:.4f}')
    for wanted, frame in found['frames'].items():
        other = frame['cycles']['pixels']
        lines.append(f'  {wanted:11} {frame["wall_s"]:8.2f} s  {frame["pixels"]:.4f} '
                     f'{frame["blocks"]:.4f}  Cycles: {other["samples"]:.0f} samples, '
                     f'{other["wall_s"]:.1f} s, {other["wall_s"] / frame["wall_s"]:.1f} times '
                     f'(processor {other["cpu_s"] / frame["cpu_s"]:.1f})')
    return '\n'.join(lines)


def main():
    parser = argparse.ArgumentParser(prog='dom_time.py')
    parser.add_argument('--scenes', nargs='+', default=list(SCENES))
    parser.add_argument('--kinds', nargs='+', choices=OUR_JOBS, default=list(OUR_JOBS),
                        help='of frames beside those of Cycles')
    parser.add_argument('--plots', action='store_true', help='draw what was measured before')
    parser.add_argument('--quick', action='store_true', help='small pictures, one frame of each')
    parser.add_argument('--repeats', type=int, default=3, help='frames after the first')
    parser.add_argument('--long', type=float, default=60.0,
                        help='seconds of a frame that is not repeated further')
    parser.add_argument('--pairs', type=int, default=2, help='of seeds of the reference, at least')
    parser.add_argument('--limit', type=float, default=240.0,
                        help='seconds that Cycles may take for one picture')
    options = parser.parse_args()
    if options.quick:
        options.repeats, options.limit = 1, 0.0
    if options.plots:
        draw_kept()
        return
    os.makedirs(PICTURES, exist_ok=True)
    size = QUICK if options.quick else SIZE
    device = native.Device().describe().renderer.decode()
    for name in options.scenes:
        line = {'bench': 'dom_time', **here(), 'device': device, 'resolution': list(size),
                'scene': name, **measure(name, size, options)}
        keep(line, shown=False)
        print(told(name, line), flush=True)


if __name__ == '__main__':
    main()
