# SPDX-License-Identifier: GPL-3.0-or-later
"""The binding: its structs against the library's, and errors with ids."""

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from brume import native
from conftest import write_vdb

HEADER = Path(__file__).resolve().parents[2] / "csrc" / "brume.h"


def enumerator(name):
    return int(re.search(rf"\b{name}\s*=\s*(\d+)", HEADER.read_text()).group(1))


@pytest.mark.parametrize("name", native.STRUCTS)
def test_struct_size(name):
    assert native.library().struct_size(name.encode()) == ctypes.sizeof(native.STRUCTS[name])


def test_every_struct_and_function_is_bound():
    header = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.S)
    structs = set(re.findall(r"typedef struct (brume_\w+) \{", header))
    assert structs == set(native.STRUCTS)
    functions = set(re.findall(r"BRUME_API[^;(]*?\b(brume_\w+)\(", header))
    assert functions == set(native._FUNCTIONS)


def test_numbers():
    assert enumerator("BRUME_OP_COUNT") == len(native.OPS)
    for name, number in native.OP.items():
        assert enumerator(f"BRUME_OP_{name}") == number
    for number, name in enumerate(native.PASSES):
        assert enumerator(f"BRUME_PASS_{name}") == number
        assert native.library().pass_channels(number) == native.PASS_CHANNELS[number]
    for kinds, prefix in ((native.KINDS, "KIND"), (native.LIGHTS, "LIGHT"),
                          (native.ALPHA, "ALPHA"), (native.METHODS, "METHOD"),
                          (native.BLOCKERS, "BLOCKERS"), (native.FOCUS, "FOCUS")):
        for name, number in kinds.items():
            assert enumerator(f"BRUME_{prefix}_{name.upper()}") == number
    assert len(native.STAGES) == enumerator("BRUME_STAGE_COUNT")
    assert len(native.FIELD_PARTS) == enumerator("BRUME_FIELD_PARTS")
    for number, name in enumerate(native.FIELD_PARTS):
        assert native.library().field_part_name(number) == name.encode()


def test_missing_file_has_an_id_and_names_the_file(tmp_path):
    path = tmp_path / "nothing.vdb"
    with pytest.raises(native.BrumeError) as caught:
        native.vdb_list(path)
    assert caught.value.id == "FILE_MISSING"
    assert "nothing.vdb" in caught.value.sentence


def test_truncated_file(tmp_path):
    values = np.random.default_rng(1).random((40, 40, 40), np.float32)
    path = Path(write_vdb(tmp_path / "cut.vdb", density=values))
    path.write_bytes(path.read_bytes()[:100_000])
    with pytest.raises(native.BrumeError) as caught:
        native.Grid.load_vdb(path, "density")
    assert caught.value.id == "FILE_FORMAT"
    assert "cut.vdb" in caught.value.sentence


def test_grid_round_trip():
    data = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    transform = np.diag((0.5, 0.5, 0.5, 1.0))
    transform[:3, 3] = 1, 2, 3
    info = native.Grid.create("density", data, transform).describe()
    assert (info.name, list(info.dims), info.channels) == (b"density", [4, 3, 2], 1)
    assert (info.minimum, info.maximum) == (0.0, 23.0)
    assert list(info.object_from_array)[12:15] == [1.0, 2.0, 3.0]


def test_exr_round_trip(tmp_path):
    values = np.random.default_rng(1).random((5, 7, 4), np.float32)
    native.exr_write(tmp_path / "a.exr",
                     {name: values[..., i] for i, name in enumerate("RGBA")})
    assert np.array_equal(native.exr_read(tmp_path / "a.exr"), values)


def build_library(folder, source):
    path = folder / "libother.so"
    (folder / "other.c").write_text(source)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", path, folder / "other.c"], check=True)
    return path


def test_another_abi_is_refused(tmp_path):
    path = build_library(tmp_path, "unsigned brume_abi(void) { return 999; }"
                                   "unsigned long brume_struct_size(const char *n) { return 1; }")
    with pytest.raises(native.BrumeError) as caught:
        native.Library(path)
    assert caught.value.id == "LIBRARY_ABI"
    assert "999" in caught.value.sentence


def test_another_struct_is_refused(tmp_path):
    path = build_library(tmp_path, f"unsigned brume_abi(void) {{ return {native.ABI}; }}"
                                   "unsigned long brume_struct_size(const char *n) { return 1; }")
    with pytest.raises(native.BrumeError) as caught:
        native.Library(path)
    assert caught.value.id == "LIBRARY_ABI"
    assert "brume_" in caught.value.sentence


def test_what_is_no_library_is_refused(tmp_path):
    (tmp_path / "libbrume.so").write_text("no library")
    with pytest.raises(native.BrumeError) as caught:
        native.Library(tmp_path / "libbrume.so")
    assert caught.value.id == "LIBRARY_MISSING"
