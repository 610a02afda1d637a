#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds every scene, or those named as arguments, with $BLENDER (default: blender). The plume's
# simulation takes a minute; the others take seconds. Fog sources and some scenes' method are settings
# of the add-on, which scripts/blender brings.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
[ $# -gt 0 ] || set -- plume plume_vdb cloud room cube lamps surfaces environment \
    fog_one fog_sixteen fog_lights arcade room_smoke partition lantern smoke_sky cumulus
for name; do
    case $name in
        fog_* | arcade | room_smoke | partition | lantern | smoke_sky | cumulus)
            blender=$here/../scripts/blender
            ;;
        *) blender=${BLENDER:-blender} ;;
    esac
    "$blender" -b --factory-startup --python-exit-code 1 -P "$here/build_$name.py"
done
