# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: final renders, previews, passes; the viewport is in viewport.py."""

import time
import traceback

import bpy

from . import compat, native, session, viewport
from .export import camera, scene
from .properties import native_settings, passes_of

POLL_MS = 30
# A final render's status line changes at most this often, in seconds.
STATUS_INTERVAL = 0.2
PICTURE_INTERVAL = 1.0   # seconds between two pictures while a window shows the render


def _told(id, sentence):
    return f"{sentence.rstrip('.')} ({id})"


class BrumeEngine(bpy.types.RenderEngine):
    """Owns nothing native: Blender makes one per frame and throws it away."""

    bl_idname = "BRUME"
    bl_label = "Brume"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False  # True, the default, hides Cycles' shader nodes
    bl_use_eevee_viewport = True
    bl_use_gpu_context = False           # True freezes Blender's windows during F12

    # -- final render

    def render(self, depsgraph):
        # Blender dies when a render that writes a file ends without a completed result, so the
        # result is begun first and always ended; cancel=True only when the user asked for it.
        layer = depsgraph.view_layer_eval
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=layer.name)
        try:
            self._render(depsgraph, result)
        except native.BrumeError as error:
            self._fail(_told(error.id, error.sentence))
        except Exception as error:
            traceback.print_exc()
            self._fail(f"Brume: {type(error).__name__}: {error}")
        finally:
            self.end_result(result, cancel=self.test_break())

    def _fail(self, sentence):
        self.report({'ERROR'}, sentence)
        self.error_set(sentence)

    def _render(self, depsgraph, result):
        began = time.perf_counter()
        stage = session.stage("preview" if self.is_preview else "final")
        with stage.lock:
            self.update_stats("", "Brume | Exporting")
            scene.export(depsgraph, stage.target)
            if depsgraph.scene_eval.render.use_multiview:
                stage.target.reports.unsupported(
                    f'Scene "{depsgraph.scene.name}"', "all views of stereoscopy are alike.")
            view, passes = self._view(depsgraph, result, stage.target)
            warnings = list(stage.target.reports)
            exported = time.perf_counter()
            settings = native_settings(depsgraph.scene_eval.brume)
            job = stage.scene.render(settings, view)
            try:
                if self._wait(job, view, result, passes):
                    self._write(result, job, passes)
                    self.update_progress(1.0)
                    if not self.is_preview:
                        now = time.perf_counter()
                        self._finish(depsgraph, session.RenderStats(
                            job.stats(), exported - began, now - began))
            finally:
                # After the statistics, since Blender's status bar shows the last report.
                self._warn(warnings + job.warnings())
                job.close()

    def _view(self, depsgraph, result, target):
        """brume_view of the scene's camera, and the passes to read."""
        scene_eval = depsgraph.scene_eval
        full = self.resolution_x, self.resolution_y
        part = camera.border_pixels(scene_eval.render, *full)
        buffer = result.resolution_x, result.resolution_y
        if part[2:] != buffer:
            part = (*part[:2], *buffer) if scene_eval.render.use_border else (0, 0, *buffer)
        seen = camera.final(self, depsgraph, target, full, part)
        passes = passes_of(depsgraph.view_layer_eval)
        if self.is_preview:
            passes = passes[:1]
        settings = scene_eval.brume
        view = native.View(
            width=buffer[0], height=buffer[1], view_from_world=native.matrix(seen.view_from_world),
            clip_from_view=native.matrix(seen.clip_from_view), clip_near=seen.clip_near,
            clip_far=seen.clip_far, samples=4 if self.is_preview else settings.samples,
            seed=settings.seed, filter_width=scene_eval.render.filter_size,
            film_transparent=scene_eval.render.film_transparent,
            half_march=settings.half_resolution_volumes, lens=native.Lens(*seen.lens),
            passes=sum(1 << number for number, *_ in passes),
            progressive=not (self.is_preview or bpy.app.background), urgent=self.is_preview)
        return view, passes

    def _wait(self, job, view, result, passes):
        """Follows the job to its end; False if the user broke it off. In a window the picture is
        shown as it gets cleaner."""
        shown = 0.0
        pictured = time.perf_counter()
        cancelled = False
        while True:
            status = job.wait(POLL_MS)
            if status.ended:
                break
            if not cancelled and self.test_break():
                job.cancel()
                cancelled = True
            self.update_progress(status.progress)
            now = time.perf_counter()
            if now - shown > STATUS_INTERVAL:
                shown = now
                name = native.library().stage_name(status.stage).decode()
                self.update_stats("", f"Brume | {name} | "
                                      f"Sample {status.samples_done}/{view.samples}")
            # The first picture is there once the second sample has begun.
            if (view.progressive and status.samples_done > 1
                    and now - pictured > PICTURE_INTERVAL):
                pictured = now
                self._write(result, job, passes[:1])
                self.update_result(result)
        job.check(status)
        return status.state == native.JOB_DONE

    def _write(self, result, job, passes):
        layer = result.layers[0]
        for number, name, channels, _ in passes:
            pixels = job.read(number)
            for target in layer.passes:  # one a view
                if target.name == name:
                    compat.set_pass(target, pixels[..., :len(channels)])

    def _warn(self, entries):
        """Reports what is not shown; in background, where reports are not seen, in print. The
        scene of a preview is Blender's own, and no concern of the user's."""
        if self.is_preview:
            return
        for entry in entries:
            self.report({'WARNING'}, _told(*entry))
            if bpy.app.background:
                print(f"Brume: warning: {_told(*entry)}", flush=True)

    def _finish(self, depsgraph, last):
        """Tells what the frame took: session.RenderStats."""
        session.last_stats = last
        stats = last.stats
        line = (f"Brume | {last.whole_s:.2f} s | export {last.export_s * 1000:.0f}, "
                f"{session.stage_times(stats)} | {session.iterations(stats)}"
                f"peak {stats.peak_bytes / 2 ** 20:.0f} MiB | "
                f"frame {depsgraph.scene_eval.frame_current}")
        self.update_memory_stats(memory_used=stats.total_bytes / 2 ** 20,
                                 memory_peak=stats.peak_bytes / 2 ** 20)
        if bpy.app.background:
            print(line, flush=True)
        else:  # Blender clears the status of a render that ended, and shows the last report
            self.report({'INFO'}, line)

    def update_render_passes(self, scene=None, renderlayer=None):
        for _, name, channels, kind in passes_of(renderlayer):
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    # -- viewport

    def view_update(self, context, depsgraph):
        viewport.of(self).update(self, context, depsgraph)

    def view_draw(self, context, depsgraph):
        viewport.of(self).draw(self, context, depsgraph)


def register():
    bpy.utils.register_class(BrumeEngine)


def unregister():
    bpy.utils.unregister_class(BrumeEngine)
