# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: Blender's evaluated scene to the library's, one module per kind of datablock."""
