# SPDX-License-Identifier: GPL-3.0-or-later
"""The rendered viewport: exports on changes, draws the newest finished picture, never waits."""

import traceback
import weakref

import numpy as np

from . import native, session
from .export import scene
from .properties import native_settings

# Screen pixels along the side of one of the picture's, from the first look to the last.
PIXEL_SIZES = (8, 4, 2, 1)
# After a change the finest picture comes first that is likely to be there so soon, in seconds.
FIRST_PICTURE_S = 0.1
# The stages whose time grows with the pixels.
_PIXEL_STAGES = [native.STAGES.index(name) for name in ("gbuffer", "shade", "march", "passes")]

_views = weakref.WeakSet()


def of(engine):
    """The view of an engine object; Blender keeps one of these per 3D view, and the view ends
    with it."""
    view = getattr(engine, "view", None)
    if view is None:
        view = engine.view = View(f"viewport {engine.as_pointer()}")
        _views.add(view)
    return view


def close():
    for view in list(_views):
        view.close()


def clip_range(window_matrix):
    """(near, far) of an OpenGL projection: what a 3D view says itself does not hold for the
    camera that it looks through, nor for orthographic views, which also see behind their plane."""
    scale, offset = window_matrix[2][2], window_matrix[2][3]
    if window_matrix[3][3] == 0.0:
        return offset / (scale - 1.0), offset / (scale + 1.0)
    return (offset + 1.0) / scale, (offset - 1.0) / scale


def ladder(pixels, seconds, finest, samples):
    """(pixel size, samples) of the pictures that follow one another while nothing changes.
    seconds: what one sample of a pixel took; None: not known yet."""
    sizes = [size for size in PIXEL_SIZES if size > finest] + [finest]
    while seconds is not None and len(sizes) > 1 and (
            seconds * pixels / sizes[1] ** 2 < FIRST_PICTURE_S):
        del sizes[0]
    steps = [(size, 1) for size in sizes]
    while steps[-1][1] < samples:
        steps.append((finest, min(4 * steps[-1][1], samples)))
    return steps


class View:
    def __init__(self, name):
        self.name = name
        self.job = None
        self.wanted = None   # what the picture must show: the scene's state, size, matrices
        self.steps = []      # what is still to be rendered: pixel size, samples
        self.turned = False  # whether nothing of what is wanted has been begun
        self.first = False   # whether the job is the first of its steps
        self.reports = []    # what the last export said
        self.exports = 0
        self.seconds = None  # what one sample of a pixel took last
        self.picture = None
        self.texture = None
        self.failed = False

    def __del__(self):
        self.close()

    def update(self, engine, context, depsgraph):
        self.failed = False
        self._guard(self._export, engine, depsgraph)
        engine.tag_redraw()

    def draw(self, engine, context, depsgraph):
        if not self.failed:
            self._guard(self._advance, engine, context, depsgraph)
        if self.picture is not None:
            self._show(context)
        if self.job is not None:
            engine.tag_redraw()

    def close(self):
        self._drop_job()
        session.drop(self.name, wait=False)

    def _guard(self, work, engine, *arguments):
        """Does the work; what goes wrong is said in the corner, and the scene's next change
        tries again."""
        try:
            work(engine, *arguments)
            return
        except native.BrumeError as error:
            sentence = f"{error.sentence} ({error.id})"
        except Exception as error:
            traceback.print_exc()
            sentence = f"{type(error).__name__}: {error}"
        self.failed = True
        self._drop_job()
        engine.update_stats("Brume", sentence)

    def _drop_job(self):
        if self.job is not None:
            self.job.close()
            self.job = None

    def _export(self, engine, depsgraph):
        stage = session.stage(self.name)
        with stage.lock:
            scene.export(depsgraph, stage.target)
            reports = list(stage.target.reports)
        self.exports += 1
        # Blender drops what a viewport's engine reports.
        for _, sentence in reports:
            if sentence not in self.reports:
                print(f"Brume: warning: {sentence}", flush=True)
        self.reports = [sentence for _, sentence in reports]

    def _advance(self, engine, context, depsgraph):
        """Takes a finished picture and starts the next job."""
        if self.job is not None and self.job.poll().ended:
            self._take(engine, depsgraph)
        region, settings = context.region, depsgraph.scene_eval.brume
        finest = engine.get_preview_pixel_size(depsgraph.scene)
        wanted = (self.exports, region.width, region.height, finest, settings.viewport_samples,
                  *np.array(context.region_data.perspective_matrix).ravel().tolist())
        if wanted != self.wanted:
            # A first picture that is under way is let finish: cancelling it on every mouse
            # move would show none while the view turns.
            if self.job is not None and not self.first:
                self.job.cancel()
            self.wanted, self.turned = wanted, True
            self.steps = ladder(region.width * region.height, self.seconds, finest,
                                settings.viewport_samples)
        if self.job is None and self.steps:
            self._start(context, depsgraph, *self.steps.pop(0))
            self.first, self.turned = self.turned, False

    def _take(self, engine, depsgraph):
        job, self.job = self.job, None
        try:
            status = job.poll()
            job.check(status)
            if status.state == native.JOB_DONE:
                self.picture, self.texture = job.read(0), None
                stats = job.stats()
                spent = sum(stats.stages[stage].wall_ms for stage in _PIXEL_STAGES) / 1000
                self.seconds = spent / (job.width * job.height * stats.samples)
                self._tell(engine, depsgraph, stats)
        finally:
            job.close()

    def _tell(self, engine, depsgraph, stats):
        """In the view's corner: the first warning, and the stages' times if wanted."""
        said = [f"{len(self.reports)} warnings, the first: {self.reports[0]}" if self.reports[1:]
                else sentence for sentence in self.reports[:1]]
        if depsgraph.scene_eval.brume.show_statistics:
            said += [f"{stats.samples} samples", session.stage_times(stats)]
        engine.update_stats("", " | ".join(said))

    def _start(self, context, depsgraph, pixel_size, samples):
        region, space = context.region, context.region_data
        scene_eval = depsgraph.scene_eval
        near, far = clip_range(space.window_matrix)
        view = native.View(
            width=max(region.width // pixel_size, 1), height=max(region.height // pixel_size, 1),
            view_from_world=native.matrix(space.view_matrix),
            clip_from_view=native.matrix(space.window_matrix), clip_near=near, clip_far=far,
            samples=samples, seed=scene_eval.brume.seed, passes=1,
            filter_width=scene_eval.render.filter_size,
            film_transparent=scene_eval.render.film_transparent)
        stage = session.stage(self.name)
        with stage.lock:
            self.job = stage.scene.render(native_settings(scene_eval.brume), view)

    def _show(self, context):
        import gpu  # not usable, and not needed, in background
        from gpu_extras.presets import draw_texture_2d
        height, width = self.picture.shape[:2]
        if self.texture is None:
            data = gpu.types.Buffer('FLOAT', self.picture.size, self.picture.reshape(-1))
            self.texture = gpu.types.GPUTexture((width, height), format='RGBA16F', data=data)
        gpu.state.blend_set('ALPHA_PREMULT')
        draw_texture_2d(self.texture, (0, 0), context.region.width, context.region.height)
        gpu.state.blend_set('NONE')
