# SPDX-License-Identifier: GPL-3.0-or-later
"""Times the rendered view in a Blender window of its own: orbits in Brume and in EEVEE, a lamp's
moves, the first picture, and the processor at rest.

    python3 bench/viewport.py [--out FILE]

Plays the scenario of tests/viewport/latency.py on a virtual display, prints a JSON line and
appends it to FILE (out/bench/viewport.jsonl). A run that misses what the scenario asserts leaves
no line.
"""
import argparse
import json
import os
import sys

from place import ROOT, here

sys.path.insert(0, os.path.join(ROOT, 'tests', 'viewport'))
import launch

SCENARIO = 'smooth'


def rounded(value):
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return round(value, 4) if isinstance(value, float) else value


def main():
    parser = argparse.ArgumentParser(prog='viewport.py')
    parser.add_argument('--out', default=os.path.join(ROOT, 'out', 'bench', 'viewport.jsonl'))
    options = parser.parse_args()
    where = here()
    run = launch.play('latency', [SCENARIO], BRUME_SLOW='1')
    result = run.results.get(SCENARIO)
    if result is None or result['error']:
        sys.exit(f'{result["error"] if result else run.said}\nBlender ended with {run.status}')
    text = json.dumps(rounded({'bench': 'viewport', **where, **result['values']}))
    print(text)
    os.makedirs(os.path.dirname(os.path.abspath(options.out)), exist_ok=True)
    with open(options.out, 'a', encoding='utf-8') as file:
        file.write(text + '\n')


main()
