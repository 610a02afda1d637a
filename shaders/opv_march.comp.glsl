// SPDX-License-Identifier: GPL-3.0-or-later
// Optical depth T(X, S) from every node of the lattice to a source (OPV, eq. 4), by a march all the
// way through the medium: the reference for opv_propagate. Kept as lib/depth.glsl says.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: source
};

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D depth_image;

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (any(greaterThanEqual(node, frame.lattice_dims.xyz)) || node.z >= stage.slab.w)
        return;
    gpu_depth_source source = sources[stage.offset.x];
    vec3 p = node_position(node);
    light_way way = way_to(source, p);
    vec3 tau = medium_tau(p, way.towards, way.to, frame.medium_lower.w, 0.5);
    imageStore(depth_image, node + source.tile.xyz, depth_texel(tau, way.to - way.from, p));
}
