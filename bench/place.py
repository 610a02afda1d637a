# SPDX-License-Identifier: GPL-3.0-or-later
"""Of what, when and on what a benchmark's line was measured; and where lines are kept."""

import json
import os
import platform
import subprocess
from datetime import datetime, timezone

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def _git(*arguments):
    return subprocess.run(['git', '-C', ROOT, *arguments], capture_output=True, text=True,
                          check=True).stdout.strip()


def _processor():
    with open('/proc/cpuinfo', encoding='utf-8') as file:
        for line in file:
            if line.startswith('model name'):
                return line.split(':', 1)[1].strip()
    return platform.processor()


def here():
    return {'commit': _git('rev-parse', '--short=12', 'HEAD'),
            'modified': bool(_git('status', '--porcelain', '--untracked-files=no')),
            'time': datetime.now(timezone.utc).isoformat(timespec='seconds'),
            'processor': _processor(), 'threads': len(os.sched_getaffinity(0)),
            'load': os.getloadavg()[0]}


def keep(line, shown=True):
    """Appends it to out/bench/NAME.jsonl, by its "bench", and prints it where it is to be shown."""
    folder = os.path.join(ROOT, 'out', 'bench')
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, f'{line["bench"]}.jsonl'), 'a', encoding='utf-8') as file:
        file.write(json.dumps(line) + '\n')
    if shown:
        print(json.dumps(line, indent=1))
