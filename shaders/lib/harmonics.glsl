// SPDX-License-Identifier: GPL-3.0-or-later
// Real spherical harmonics of bands 0 to 3, orthonormal, in the order l(l+1)+m.
#include "shared/brume_gpu.h"
#include "lib/phase.glsl"

void harmonics(vec3 d, out float y[MOMENTS])
{
    float x2 = d.x * d.x, y2 = d.y * d.y, z2 = d.z * d.z;
    y[0] = 0.28209479177387814;
    y[1] = 0.4886025119029199 * d.y;
    y[2] = 0.4886025119029199 * d.z;
    y[3] = 0.4886025119029199 * d.x;
    y[4] = 1.0925484305920792 * d.x * d.y;
    y[5] = 1.0925484305920792 * d.y * d.z;
    y[6] = 0.31539156525252005 * (3.0 * z2 - 1.0);
    y[7] = 1.0925484305920792 * d.x * d.z;
    y[8] = 0.5462742152960396 * (x2 - y2);
    y[9] = 0.5900435899266435 * d.y * (3.0 * x2 - y2);
    y[10] = 2.890611442640554 * d.x * d.y * d.z;
    y[11] = 0.4570457994644658 * d.y * (5.0 * z2 - 1.0);
    y[12] = 0.3731763325901154 * d.z * (5.0 * z2 - 3.0);
    y[13] = 0.4570457994644658 * d.x * (5.0 * z2 - 1.0);
    y[14] = 1.445305721320277 * d.z * (x2 - y2);
    y[15] = 0.5900435899266435 * d.x * (x2 - 3.0 * y2);
}

// The band of a moment.
int band_of(int moment)
{
    return moment < 1 ? 0 : (moment < 4 ? 1 : (moment < 9 ? 2 : 3));
}

// Moments of Henyey and Greenstein's phase function by bands, scaled.
vec4 scaled_bands(float g)
{
    float f = forward_share(g);
    return (vec4(1.0, g, g * g, g * g * g) - f) / max(1.0 - f, 1e-6);
}
