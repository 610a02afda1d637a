# SPDX-License-Identifier: GPL-3.0-or-later
"""The binding to libbrume: the only module that touches ctypes.

Mirrors csrc/brume.h. Arrays go in as numpy arrays and are copied by the library before a call
returns. Every call may be made from any thread; ctypes releases the GIL while the library works.
"""

import ctypes
import itertools
import os
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_char,
    c_char_p,
    c_double,
    c_float,
    c_int32,
    c_int64,
    c_size_t,
    c_uint32,
    c_uint64,
    c_void_p,
)
from pathlib import Path

import numpy as np

ABI = 10
PASSES = ("COMBINED", "DEPTH", "NORMAL", "VOLUME_DIRECT", "EMISSION", "ENVIRONMENT",
          "TRANSMITTANCE", "VOLUME_INDIRECT")
PASS_CHANNELS = (4, 1, 3, 3, 3, 3, 3, 3)
STAGES = ("upload", "medium", "shadow", "transport", "gbuffer", "shade", "march", "passes")
FIELD_PARTS = ("surfaces", "media", "reflected", "scattered", "blockers", "aggregate", "prepare",
               "iterations", "copy")
METHODS = {"OPV": 0, "LPV": 1, "DOM": 2}
LIGHT_PATHS = {"ALL": 0, "DIRECT": 1, "REFLECTED": 2, "SINGLE": 3, "REFLECTED_MARCHED": 4,
               "SUM": 5}
BLOCKERS = {"LINKS": 0, "FUZZY": 1}
FOCUS = {"MEDIUM": 0, "CAMERA": 1}
DEPTHS = {"PROPAGATED": 0, "MARCHED": 1, "CORRECTED": 2, "PAPER": 3, "ITERATED": 4}
KINDS = {"mesh": 0, "instances": 1, "material": 2, "image": 3, "light": 4, "volume": 5}
JOB_QUEUED, JOB_RUNNING, JOB_DONE, JOB_FAILED, JOB_CANCELLED = range(5)
VISIBLE_CAMERA, VISIBLE_SHADOW, VISIBLE_HOLDOUT = 1, 2, 4
ALPHA = {"OPAQUE": 0, "CLIP": 1, "BLEND": 2}
EXTEND = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}
LIGHTS = {"SUN": 0, "POINT": 1, "SPOT": 2, "RECTANGLE": 3, "ELLIPSE": 4}
OPS = (
    "CONSTANT GRID ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD POWER LOGARITHM SQRT INVERSE_SQRT "
    "ABSOLUTE EXPONENT MINIMUM MAXIMUM LESS GREATER SIGN COMPARE SMOOTH_MIN SMOOTH_MAX ROUND "
    "FLOOR CEIL TRUNCATE FRACTION MODULO WRAP SNAP PINGPONG SINE COSINE TANGENT ARCSINE ARCCOSINE "
    "ARCTANGENT ARCTANGENT2 HYPERBOLIC_SINE HYPERBOLIC_COSINE HYPERBOLIC_TANGENT CLAMP01 MIX "
    "SMOOTHSTEP SMOOTHERSTEP RAMP AVERAGE LUMINANCE COMPONENT COMBINE BLACKBODY POSITION "
    "NOISE").split()
OP = {name: number for number, name in enumerate(OPS)}
SPACES = {"OBJECT": 0, "WORLD": 1, "GENERATED": 2}  # of POSITION
REGISTERS = 64
RAMP_SIZE = 256
IDENTITY = np.eye(4)


class BrumeError(Exception):
    """A failure with an id that tests and callers can tell apart, and a sentence for people."""

    def __init__(self, id, sentence):
        super().__init__(sentence)
        self.id = id
        self.sentence = sentence


# ------------------------------------------------------------------------------------------------
# Structs, under their names in brume.h.

Vec2, Vec3, Mat4 = c_float * 2, c_float * 3, c_float * 16
Dims = c_int32 * 3
LOG_FUNCTION = ctypes.CFUNCTYPE(None, c_void_p, c_int32, c_char_p)


class DeviceParams(Structure):
    _fields_ = [("shader_dir", c_char_p), ("log", LOG_FUNCTION), ("log_user", c_void_p),
                ("debug", c_uint32), ("reserved", c_uint32)]


class DeviceInfo(Structure):
    _fields_ = [("renderer", c_char * 128), ("version", c_char * 128), ("software", c_uint32),
                ("gl_major", c_int32), ("gl_minor", c_int32), ("max_texture_3d", c_int32)]


class GridInfo(Structure):
    _fields_ = [("name", c_char * 64), ("type", c_char * 32), ("channels", c_int32),
                ("dims", Dims), ("file_dims", c_int64 * 3), ("reduction", c_int32),
                ("supported", c_uint32), ("object_from_array", Mat4), ("minimum", c_float),
                ("maximum", c_float)]


class Instruction(Structure):
    _fields_ = [("op", c_uint32), ("dst", c_uint32), ("a", c_uint32), ("b", c_uint32),
                ("c", c_uint32), ("value", Vec3)]


class VolumeProgram(Structure):
    _fields_ = [("instructions", POINTER(Instruction)), ("ramps", c_void_p),
                ("instruction_count", c_uint32), ("ramp_count", c_uint32), ("sigma_s", c_uint32),
                ("sigma_a", c_uint32), ("g", c_uint32), ("emission", c_uint32)]


class Gaussian(Structure):
    _fields_ = [("center", Vec3), ("scale", c_float), ("color", Vec3), ("amplitude", c_float)]


class Volume(Structure):
    _fields_ = [("name", c_char_p), ("grids", POINTER(c_void_p)), ("positions", c_void_p),
                ("triangles", c_void_p), ("gaussians", c_void_p), ("grid_count", c_uint32),
                ("vertex_count", c_uint32), ("triangle_count", c_uint32),
                ("gaussian_count", c_uint32), ("program", VolumeProgram),
                ("world_from_object", Mat4), ("scale", c_float), ("generated_lower", Vec3),
                ("generated_upper", Vec3), ("reserved2", c_float)]


class Mesh(Structure):
    _fields_ = [("name", c_char_p), ("positions", c_void_p), ("triangles", c_void_p),
                ("corner_normals", c_void_p), ("corner_uvs", c_void_p),
                ("triangle_slots", c_void_p), ("materials", c_void_p), ("vertex_count", c_uint32),
                ("triangle_count", c_uint32), ("material_count", c_uint32),
                ("reserved", c_uint32)]


class Instances(Structure):
    _fields_ = [("world_from_object", c_void_p), ("mesh", c_uint64), ("count", c_uint32),
                ("visibility", c_uint32)]


class Material(Structure):
    _fields_ = [("name", c_char_p), ("base_image", c_uint64), ("roughness_image", c_uint64),
                ("diffuse", Vec3), ("specular", Vec3), ("metal", Vec3), ("emission", Vec3),
                ("transparent", Vec3), ("roughness", c_float), ("alpha", c_float),
                ("alpha_threshold", c_float), ("alpha_mode", c_uint32),
                ("alpha_from_base_image", c_uint32), ("backface_culling", c_uint32),
                ("burley", c_float)]


class Image(Structure):
    _fields_ = [("name", c_char_p), ("pixels", c_void_p), ("width", c_int32), ("height", c_int32),
                ("extend", c_uint32), ("nearest", c_uint32)]


class Light(Structure):
    _fields_ = [("name", c_char_p), ("world_from_light", Mat4), ("power", Vec3),
                ("radius", c_float), ("angle", c_float), ("size", Vec2), ("spot_angle", c_float),
                ("spot_blend", c_float), ("spread", c_float), ("diffuse_factor", c_float),
                ("specular_factor", c_float), ("volume_factor", c_float), ("type", c_uint32),
                ("cast_shadow", c_uint32), ("camera_visible", c_uint32),
                ("type_reserved", c_uint32)]


class World(Structure):
    _fields_ = [("color", Vec3), ("has_volume", c_uint32), ("image", c_uint64),
                ("image_from_world", Mat4), ("sigma_s", Vec3), ("sigma_a", Vec3),
                ("emission", Vec3), ("g", c_float), ("reach", c_float), ("reserved", c_float)]


class Settings(Structure):
    _fields_ = [("method", c_uint32), ("medium_resolution", c_int32),
                ("lattice_resolution", c_int32), ("iterations", c_int32),
                ("shadow_resolution", c_int32), ("light_samples", c_int32),
                ("world_samples", c_int32), ("step", c_float), ("depths", c_uint32),
                ("light_paths", c_uint32), ("blockers", c_uint32), ("field_resolution", c_int32),
                ("cascades", c_int32), ("cascade_focus", c_uint32),
                ("ordinates", c_int32), ("warm", c_uint32),
                ("converged", c_float), ("reserved", c_uint32),
                ("memory_budget", c_uint64)]


class Lens(Structure):
    _fields_ = [("radius", c_float), ("focus", c_float), ("blades", c_uint32),
                ("rotation", c_float), ("ratio", c_float)]


class View(Structure):
    _fields_ = [("width", c_int32), ("height", c_int32), ("view_from_world", Mat4),
                ("clip_from_view", Mat4), ("clip_near", c_float), ("clip_far", c_float),
                ("samples", c_uint32), ("seed", c_uint32), ("filter_width", c_float),
                ("film_transparent", c_uint32), ("passes", c_uint32), ("progressive", c_uint32),
                ("urgent", c_uint32), ("world_draws", c_uint32), ("half_march", c_uint32),
                ("lens", Lens)]


class StageStats(Structure):
    _fields_ = [("wall_ms", c_double), ("gpu_ms", c_double), ("runs", c_uint64),
                ("revision", c_uint64)]


class Stats(Structure):
    _fields_ = [("stages", StageStats * 8), ("total_ms", c_double), ("medium_bytes", c_uint64),
                ("transport_bytes", c_uint64), ("shadow_bytes", c_uint64),
                ("mesh_bytes", c_uint64), ("image_bytes", c_uint64), ("target_bytes", c_uint64),
                ("total_bytes", c_uint64), ("peak_bytes", c_uint64), ("medium_dims", Dims),
                ("transport_dims", Dims), ("light_count", c_uint32), ("triangle_count", c_uint32),
                ("samples", c_uint32), ("shadow_maps_drawn", c_uint32),
                ("lights_propagated", c_uint32), ("sky_propagated", c_uint32),
                ("iterations", c_uint32), ("power_begun", c_double),
                ("power_in_flight", c_double), ("change", c_double),
                ("field_ms", c_double * 9)]


class JobStatus(Structure):
    _fields_ = [("state", c_uint32), ("stage", c_uint32), ("progress", c_float),
                ("samples_done", c_uint32), ("result", c_int32), ("warnings", c_uint32),
                ("picture_samples", c_uint32)]

    @property
    def ended(self):
        return self.state >= JOB_DONE


class ExrChannel(Structure):
    _fields_ = [("name", c_char_p), ("pixels", c_void_p), ("stride", c_uint32),
                ("reserved", c_uint32)]


STRUCTS = {
    "brume_device_params": DeviceParams, "brume_device_info": DeviceInfo,
    "brume_grid_info": GridInfo, "brume_instruction": Instruction,
    "brume_volume_program": VolumeProgram, "brume_gaussian": Gaussian, "brume_volume": Volume,
    "brume_mesh": Mesh, "brume_instances": Instances, "brume_material": Material,
    "brume_image": Image, "brume_light": Light, "brume_world": World, "brume_settings": Settings,
    "brume_lens": Lens, "brume_view": View, "brume_stage_stats": StageStats, "brume_stats": Stats,
    "brume_job_status": JobStatus, "brume_exr_channel": ExrChannel,
}

_RESULT = object()  # marks a function that returns a brume_result
_FUNCTIONS = {
    "brume_abi": (c_uint32, []),
    "brume_struct_size": (c_size_t, [c_char_p]),
    "brume_result_name": (c_char_p, [c_int32]),
    "brume_last_error": (c_char_p, []),
    "brume_device_create": (_RESULT, [POINTER(DeviceParams), POINTER(c_void_p)]),
    "brume_device_destroy": (None, [c_void_p]),
    "brume_device_describe": (_RESULT, [c_void_p, POINTER(DeviceInfo)]),
    "brume_vdb_list": (_RESULT, [c_char_p, POINTER(GridInfo), c_uint32, POINTER(c_uint32)]),
    "brume_grid_load_vdb": (_RESULT, [c_char_p, c_char_p, c_uint64, c_uint32,
                                     POINTER(c_void_p)]),
    "brume_grid_create": (_RESULT, [c_char_p, Dims, c_int32, c_void_p, Mat4, POINTER(c_void_p)]),
    "brume_grid_describe": (_RESULT, [c_void_p, POINTER(GridInfo)]),
    "brume_grid_release": (None, [c_void_p]),
    "brume_scene_create": (_RESULT, [c_void_p, POINTER(c_void_p)]),
    "brume_scene_destroy": (None, [c_void_p]),
    "brume_scene_remove": (_RESULT, [c_void_p, c_uint32, c_uint64]),
    "brume_scene_keep": (_RESULT, [c_void_p, c_uint32, c_void_p, c_uint64]),
    "brume_scene_set_volume": (_RESULT, [c_void_p, c_uint64, POINTER(Volume)]),
    "brume_scene_set_mesh": (_RESULT, [c_void_p, c_uint64, POINTER(Mesh)]),
    "brume_scene_set_instances": (_RESULT, [c_void_p, c_uint64, POINTER(Instances)]),
    "brume_scene_set_material": (_RESULT, [c_void_p, c_uint64, POINTER(Material)]),
    "brume_scene_set_image": (_RESULT, [c_void_p, c_uint64, POINTER(Image)]),
    "brume_scene_set_light": (_RESULT, [c_void_p, c_uint64, POINTER(Light)]),
    "brume_scene_set_world": (_RESULT, [c_void_p, POINTER(World)]),
    "brume_pass_channels": (c_uint32, [c_uint32]),
    "brume_pass_name": (c_char_p, [c_uint32]),
    "brume_stage_name": (c_char_p, [c_uint32]),
    "brume_field_part_name": (c_char_p, [c_uint32]),
    "brume_render": (_RESULT, [c_void_p, POINTER(Settings), POINTER(View), POINTER(c_void_p)]),
    "brume_job_poll": (_RESULT, [c_void_p, POINTER(JobStatus)]),
    "brume_job_wait": (_RESULT, [c_void_p, c_int32, POINTER(JobStatus)]),
    "brume_job_cancel": (None, [c_void_p]),
    "brume_job_error": (c_char_p, [c_void_p]),
    "brume_job_warning": (_RESULT, [c_void_p, c_uint32, POINTER(c_char_p), POINTER(c_char_p)]),
    "brume_job_stats": (_RESULT, [c_void_p, POINTER(Stats)]),
    "brume_job_read": (_RESULT, [c_void_p, c_uint32, c_void_p, c_uint64]),
    "brume_job_release": (None, [c_void_p]),
    "brume_exr_write": (_RESULT, [c_char_p, c_int32, c_int32, POINTER(ExrChannel), c_uint32]),
    "brume_exr_read": (_RESULT, [c_char_p, POINTER(c_int32), POINTER(c_int32),
                                 POINTER(POINTER(c_float))]),
    "brume_free": (None, [c_void_p]),
}

# ------------------------------------------------------------------------------------------------
# The library


def library_path():
    """Where the library is looked for: BRUME_LIBRARY, the add-on's lib folder, the checkout."""
    named = os.environ.get("BRUME_LIBRARY")
    if named:
        return Path(named)
    here = Path(__file__).resolve().parent
    candidates = [here / "lib" / "libbrume.so", here.parents[1] / "build" / "lib" / "libbrume.so"]
    return next((path for path in candidates if path.exists()), candidates[0])


class Library:
    """The loaded library; a call that fails raises BrumeError with the result's name as id."""

    def __init__(self, path):
        try:
            self._dll = ctypes.CDLL(str(path))
        except OSError as error:
            raise BrumeError("LIBRARY_MISSING",
                             f"The Brume library could not be loaded from {path}: {error}"
                             ) from error
        self._check_abi(path)
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(self._dll, name, None)
            if function is None:
                raise BrumeError("LIBRARY_ABI", f"The Brume library {path} has no {name}.")
            function.argtypes = arguments
            function.restype = c_int32 if result is _RESULT else result
            short = name[len("brume_"):]
            setattr(self, short, self._checked(function) if result is _RESULT else function)

    def _check_abi(self, path):
        abi = getattr(self._dll, "brume_abi", None)
        size = getattr(self._dll, "brume_struct_size", None)
        if abi is None or size is None:
            raise BrumeError("LIBRARY_ABI", f"{path} is not a Brume library.")
        abi.restype, abi.argtypes = _FUNCTIONS["brume_abi"]
        size.restype, size.argtypes = _FUNCTIONS["brume_struct_size"]
        if abi() != ABI:
            raise BrumeError("LIBRARY_ABI",
                             f"The Brume library {path} has ABI {abi()}, this add-on needs {ABI}.")
        for name, struct in STRUCTS.items():
            if size(name.encode()) != ctypes.sizeof(struct):
                raise BrumeError("LIBRARY_ABI",
                                 f"The Brume library {path} has {size(name.encode())} bytes for "
                                 f"{name}, this add-on {ctypes.sizeof(struct)}.")

    def _checked(self, function):
        def call(*arguments):
            result = function(*arguments)
            if result != 0:
                raise BrumeError(self.name_of(result), self.last_error().decode(errors="replace"))
        return call

    def name_of(self, result):
        return self.result_name(result).decode().replace("BRUME_E_", "", 1)


_library = None


def library():
    """The process's one library, loaded on the first call; BrumeError if it cannot be had."""
    global _library
    if _library is None:
        path = library_path()
        if not path.exists():
            raise BrumeError("LIBRARY_MISSING",
                             f"The Brume library was not found at {path}. Build it, or name it "
                             f"in the environment variable BRUME_LIBRARY.")
        _library = Library(path)
    return _library


# ------------------------------------------------------------------------------------------------
# Arrays and matrices


def _array(values, dtype):
    return None if values is None else np.ascontiguousarray(values, dtype)


def _pointer(array):
    return None if array is None else array.ctypes.data


def _count(array, per_item):
    return 0 if array is None else array.size // per_item


def matrix(rows):
    """16 floats, column-major, of a 4x4 matrix given by rows (mathutils or numpy)."""
    return Mat4(*np.asarray(rows, np.float32).T.ravel().tolist())


# ------------------------------------------------------------------------------------------------
# Handles. Each owns one native object; close() may be called twice.


class Handle:
    _release = ""

    def __init__(self, pointer):
        self._pointer = pointer

    @property
    def pointer(self):
        if self._pointer is None:
            raise BrumeError("ARGUMENT", f"This {type(self).__name__.lower()} is closed.")
        return self._pointer

    def close(self):
        pointer, self._pointer = self._pointer, None
        if pointer is not None:
            getattr(library(), self._release)(pointer)


class Device(Handle):
    _release = "device_destroy"

    def __init__(self, log=None, debug=False):
        """log(level, sentence) is called from any thread."""
        self._log = LOG_FUNCTION(
            lambda user, level, sentence: log(level, sentence.decode(errors="replace"))
        ) if log else LOG_FUNCTION()
        out = c_void_p()
        library().device_create(byref(DeviceParams(log=self._log, debug=debug)), byref(out))
        super().__init__(out)

    def describe(self):
        info = DeviceInfo()
        library().device_describe(self.pointer, byref(info))
        return info


class Grid(Handle):
    """An immutable field of voxels; the library counts its references, so it may be closed while
    a scene still uses it."""
    _release = "grid_release"
    _serial = itertools.count()

    def __init__(self, pointer):
        super().__init__(pointer)
        self._number = next(Grid._serial)

    def fingerprint(self):
        """Differs between all grids of the process: a grid never changes."""
        return self._number.to_bytes(8, "little")

    @classmethod
    def load_vdb(cls, path, name, max_voxels=0, at_corner=False):
        """at_corner: the file's indices stand for voxels' corners, not for their centres."""
        out = c_void_p()
        library().grid_load_vdb(os.fsencode(path), name.encode(), max_voxels, at_corner,
                                byref(out))
        return cls(out)

    @classmethod
    def create(cls, name, data, object_from_array):
        """data: float32 of shape (z, y, x) or (z, y, x, 3)."""
        data = _array(data, np.float32)
        depth, height, width = data.shape[:3]
        channels = 1 if data.ndim == 3 else data.shape[3]
        out = c_void_p()
        library().grid_create(name.encode(), Dims(width, height, depth), channels,
                              _pointer(data), matrix(object_from_array), byref(out))
        return cls(out)

    def describe(self):
        info = GridInfo()
        library().grid_describe(self.pointer, byref(info))
        return info

    def __del__(self):
        self.close()


def vdb_list(path):
    """GridInfo of every grid in a file, in the file's order."""
    count = c_uint32()
    library().vdb_list(os.fsencode(path), None, 0, byref(count))
    infos = (GridInfo * count.value)()
    library().vdb_list(os.fsencode(path), infos, count.value, byref(count))
    return list(infos)


class Scene(Handle):
    """The library's copy of a scene. Keys are 64-bit numbers of the caller's choosing."""
    _release = "scene_destroy"

    def __init__(self, device):
        out = c_void_p()
        library().scene_create(device.pointer, byref(out))
        super().__init__(out)

    def keep(self, kind, keys):
        keys = np.array(sorted(keys), np.uint64)
        library().scene_keep(self.pointer, KINDS[kind], _pointer(keys), len(keys))

    def remove(self, kind, key):
        library().scene_remove(self.pointer, KINDS[kind], key)

    def set_mesh(self, key, *, name, positions, triangles, corner_normals=None, corner_uvs=None,
                 triangle_slots=None, materials=()):
        positions = _array(positions, np.float32)
        triangles = _array(triangles, np.uint32)
        normals = _array(corner_normals, np.float32)
        uvs = _array(corner_uvs, np.float32)
        slots = _array(triangle_slots, np.uint16)
        materials = np.array(materials, np.uint64)
        library().scene_set_mesh(self.pointer, key, byref(Mesh(
            name.encode(), _pointer(positions), _pointer(triangles), _pointer(normals),
            _pointer(uvs), _pointer(slots), _pointer(materials), _count(positions, 3),
            _count(triangles, 3), len(materials))))

    def set_instances(self, key, *, mesh, world_from_object, visibility):
        """world_from_object: (count, 4, 4), by rows."""
        matrices = _array(np.swapaxes(world_from_object, 1, 2), np.float32)
        library().scene_set_instances(self.pointer, key, byref(Instances(
            _pointer(matrices), mesh, len(matrices), visibility)))

    def set_material(self, key, *, name, diffuse, specular, metal, emission, transparent,
                     roughness, alpha, alpha_mode, alpha_threshold=0.5, base_image=0,
                     roughness_image=0, alpha_from_base_image=False, burley=0.0):
        library().scene_set_material(self.pointer, key, byref(Material(
            name.encode(), base_image, roughness_image, Vec3(*diffuse), Vec3(*specular),
            Vec3(*metal), Vec3(*emission), Vec3(*transparent), roughness, alpha, alpha_threshold,
            ALPHA[alpha_mode], alpha_from_base_image, False, burley)))

    def set_image(self, key, *, name, pixels, extend="REPEAT", nearest=False):
        """pixels: (height, width, 4)."""
        pixels = _array(pixels, np.float32)
        height, width = pixels.shape[:2]
        library().scene_set_image(self.pointer, key, byref(Image(
            name.encode(), _pointer(pixels), width, height, EXTEND[extend], nearest)))

    def set_light(self, key, *, name, type, world_from_light, power, radius=0.0, angle=0.0,
                  size=(0.0, 0.0), spot_angle=0.0, spot_blend=0.0, spread=0.0, cast_shadow=True,
                  camera_visible=True, factors=(1.0, 1.0, 1.0)):
        """factors: of its light that surfaces scatter and mirror, and that volumes scatter."""
        library().scene_set_light(self.pointer, key, byref(Light(
            name.encode(), matrix(world_from_light), Vec3(*power), radius, angle, Vec2(*size),
            spot_angle, spot_blend, spread, *factors, LIGHTS[type], cast_shadow,
            camera_visible)))

    def set_world(self, *, color, image=0, image_from_world=IDENTITY, volume=None, reach=0.0):
        """volume: None, or sigma_s, sigma_a, emission (three floats each) and g."""
        sigma_s, sigma_a, emission, g = volume or ((0, 0, 0), (0, 0, 0), (0, 0, 0), 0.0)
        library().scene_set_world(self.pointer, byref(World(
            Vec3(*color), volume is not None, image, matrix(image_from_world), Vec3(*sigma_s),
            Vec3(*sigma_a), Vec3(*emission), g, reach)))

    def set_volume(self, key, *, name, program, world_from_object, scale=1.0, grids=(),
                   positions=None, triangles=None, gaussians=None, generated=None):
        """program: has instructions (op, dst, a, b, c, value), ramps (n, 256, 3) and the four
        result registers. grids: Grid or None each. gaussians: (n, 8): center, scale, color,
        amplitude. generated: the corners of the box that generated coordinates span."""
        positions = _array(positions, np.float32)
        triangles = _array(triangles, np.uint32)
        gaussians = _array(gaussians, np.float32)
        ramps = _array(program.ramps, np.float32)
        code = (Instruction * max(1, len(program.instructions)))()
        for slot, (op, dst, a, b, c, value) in zip(code, program.instructions):
            slot.op, slot.dst, slot.a, slot.b, slot.c = op, dst, a, b, c
            slot.value = Vec3(*value)
        handles = (c_void_p * max(1, len(grids)))(*[g.pointer if g else None for g in grids])
        library().scene_set_volume(self.pointer, key, byref(Volume(
            name.encode(), handles, _pointer(positions), _pointer(triangles),
            _pointer(gaussians), len(grids), _count(positions, 3), _count(triangles, 3),
            _count(gaussians, 8),
            VolumeProgram(code, _pointer(ramps), len(program.instructions), len(program.ramps),
                          program.sigma_s, program.sigma_a, program.g, program.emission),
            matrix(world_from_object), scale,
            *(Vec3(*corner) for corner in generated or ()))))

    def render(self, settings, view):
        out = c_void_p()
        library().render(self.pointer, byref(settings), byref(view), byref(out))
        return Job(out, view.width, view.height)


class Job(Handle):
    _release = "job_release"

    def __init__(self, pointer, width, height):
        super().__init__(pointer)
        self.width, self.height = width, height

    def poll(self):
        status = JobStatus()
        library().job_poll(self.pointer, byref(status))
        return status

    def wait(self, timeout_ms):
        status = JobStatus()
        library().job_wait(self.pointer, timeout_ms, byref(status))
        return status

    def cancel(self):
        library().job_cancel(self.pointer)

    def check(self, status):
        """Raises the error of a job that failed."""
        if status.state == JOB_FAILED:
            raise BrumeError(library().name_of(status.result),
                             library().job_error(self.pointer).decode(errors="replace"))

    def warnings(self):
        """(id, sentence) of each warning so far."""
        found = []
        for index in range(self.poll().warnings):
            id, sentence = c_char_p(), c_char_p()
            library().job_warning(self.pointer, index, byref(id), byref(sentence))
            found.append((id.value.decode(), sentence.value.decode(errors="replace")))
        return found

    def stats(self):
        stats = Stats()
        library().job_stats(self.pointer, byref(stats))
        return stats

    def read(self, number):
        """The pass as (height, width, channels), first row at the bottom."""
        channels = library().pass_channels(number)
        pixels = np.empty((self.height, self.width, channels), np.float32)
        library().job_read(self.pointer, number, _pointer(pixels), pixels.size)
        return pixels

    def __del__(self):
        self.close()


def exr_write(path, channels):
    """channels: name -> (height, width) array, rows bottom to top."""
    arrays = {name: _array(values, np.float32) for name, values in channels.items()}
    height, width = next(iter(arrays.values())).shape
    structs = (ExrChannel * len(arrays))(*[
        ExrChannel(name.encode(), _pointer(values), 1) for name, values in arrays.items()])
    library().exr_write(os.fsencode(path), width, height, structs, len(structs))


def exr_read(path):
    """(height, width, 4), rows bottom to top."""
    width, height, pixels = c_int32(), c_int32(), POINTER(c_float)()
    library().exr_read(os.fsencode(path), byref(width), byref(height), byref(pixels))
    try:
        return np.ctypeslib.as_array(pixels, (height.value, width.value, 4)).copy()
    finally:
        library().free(pixels)
