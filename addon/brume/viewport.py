# SPDX-License-Identifier: GPL-3.0-or-later
"""The rendered viewport: exports on changes, draws the newest finished picture, never waits."""

import numpy as np

from . import native, session
from .export import scene
from .properties import native_settings

# Samples of the pictures shown one after the other while nothing changes.
REFINEMENT = (1, 4, 16, 64)

_views = {}


def of(engine):
    """The view of an engine object. Blender keeps one engine per 3D view, and gives no sign when
    it goes, so views of engines that are gone are dropped here."""
    for key, (owner, view) in list(_views.items()):
        if not _alive(owner):
            view.close()
            del _views[key]
    key = engine.as_pointer()
    if key not in _views:
        _views[key] = engine, View(f"viewport {key}")
    return _views[key][1]


def _alive(engine):
    try:
        engine.as_pointer()
        return True
    except ReferenceError:
        return False


def close():
    for _, view in _views.values():
        view.close()
    _views.clear()


class View:
    def __init__(self, name):
        self.name = name
        self.job = None
        self.wanted = None    # what the picture must show: size, matrices, scene's state
        self.running = None   # what the job shows
        self.level = 0
        self.picture = None
        self.texture = None
        self.exports = 0
        self.failed = None

    def update(self, engine, context, depsgraph):
        try:
            stage = session.stage(self.name)
            with stage.lock:
                scene.export(depsgraph, stage.target)
                for _, sentence in stage.target.reports:
                    engine.report({'WARNING'}, sentence)
            self.exports += 1
            self.failed = None
        except native.BrumeError as error:
            self._fail(engine, error)
        engine.tag_redraw()

    def draw(self, engine, context, depsgraph):
        if self.failed is None:
            try:
                self._advance(engine, context, depsgraph)
            except native.BrumeError as error:
                self._fail(engine, error)
        if self.picture is not None:
            self._show(context)
        if self.failed is None and self.job is not None:
            engine.tag_redraw()

    def close(self):
        self._drop_job()
        session.drop(self.name)

    def _fail(self, engine, error):
        """Says what is wrong once; the next change of the scene tries again."""
        self.failed = error
        self._drop_job()
        engine.report({'ERROR'}, error.sentence)
        engine.update_stats("Brume", error.sentence)

    def _drop_job(self):
        if self.job is not None:
            self.job.close()
            self.job = None

    def _advance(self, engine, context, depsgraph):
        """Takes a finished picture and starts the next job."""
        if self.job is not None:
            status = self.job.poll()
            if status.ended:
                self.job.check(status)
                if status.state == native.JOB_DONE:
                    self.picture, self.texture = self.job.read(0), None
                    self.level += 1
                    self._tell(engine, depsgraph, self.job)
                self._drop_job()
        region, space = context.region, context.region_data
        wanted = (self.exports, region.width, region.height,
                  *np.array(space.perspective_matrix).ravel().tolist())
        if wanted != self.wanted:
            # A first picture that is under way is let finish: cancelling it on every mouse
            # move would show none while the view turns.
            if self.job is not None and self.level > 0:
                self.job.cancel()
            self.wanted, self.level = wanted, 0
        if self.job is None and self.level < len(REFINEMENT):
            self._start(context, depsgraph)

    def _tell(self, engine, depsgraph, job):
        """The stages' times in the view's corner, if wanted."""
        text = ""
        if depsgraph.scene_eval.brume.show_statistics:
            stats = job.stats()
            times = (f"{native.library().stage_name(i).decode()} {stats.stages[i].wall_ms:.0f}"
                     for i in range(len(native.STAGES)))
            text = f"{stats.samples} samples | {', '.join(times)} ms"
        engine.update_stats("", text)

    def _start(self, context, depsgraph):
        region, space = context.region, context.region_data
        settings = depsgraph.scene_eval.brume
        near, far = context.space_data.clip_start, context.space_data.clip_end
        view = native.View(
            width=region.width, height=region.height,
            view_from_world=native.matrix(space.view_matrix),
            clip_from_view=native.matrix(space.window_matrix), clip_near=near, clip_far=far,
            samples=REFINEMENT[self.level], seed=settings.seed, passes=1,
            film_transparent=depsgraph.scene_eval.render.film_transparent)
        stage = session.stage(self.name)
        with stage.lock:
            self.job = stage.scene.render(native_settings(settings), view)

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
