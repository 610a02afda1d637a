// SPDX-License-Identifier: GPL-3.0-or-later
// Light in flight from a cell. What is gathered is its power and its flux, spherical harmonics of
// bands 0 and 1 a colour; what is kept is the lobe that it leaves by: exp(K u) times a scale, with the
// mean cosine that the flux tells (von Mises and Fisher's distribution). The two bands themselves
// would be less than nothing backwards, as soon as the flux is a third of the power, and cutting that
// off turns nearly half of a beam's flux aside in every cell: the finer the cells, the less far light
// got.
#include "lib/links.glsl"

// 1 less the mean cosine of the sharpest lobe, about Lambert's: sharper ones are seen, as beams between
// cells' centres on a ceiling. Every hop widens them anew, and hops along the diagonals are longer:
// measured by the way flown, not by hops, light widens alike in all directions.
const float LEAST_WIDTH = 0.38;
const float MEAN_HOP = 1.25; // cells

float leaving(vec4 lobe, int link_class_number, vec3 direction)
{
    return WEIGHTS[link_class_number] * lobe.x * exp(dot(lobe.yzw, direction));
}

// cosh(sqrt(x)), within 1e-6 of itself up to the sharpest lobe's 11.5: its series, for the built-in one takes
// two exponentials.
vec3 cosh_of_root(vec3 x)
{
    vec3 sum = 1.0 + x * (1.0 / 182.0);
    sum = 1.0 + x * (1.0 / 132.0) * sum;
    sum = 1.0 + x * (1.0 / 90.0) * sum;
    sum = 1.0 + x * (1.0 / 56.0) * sum;
    sum = 1.0 + x * (1.0 / 30.0) * sum;
    sum = 1.0 + x * (1.0 / 12.0) * sum;
    return 1.0 + x * 0.5 * sum;
}

// The lobe of a power and flux. What leaves by all links together is the power.
vec4 lobe_of(vec4 flow)
{
    if (!(flow.x > 0.0))
        return vec4(0.0);
    float flux = length(flow.yzw);
    vec3 axis = flow.yzw / max(flux, 1e-30);
    float hop = 1.0 / max(max(abs(axis.x), max(abs(axis.y), abs(axis.z))), 0.5);
    float cosine = min(flux / flow.x, 1.0 - LEAST_WIDTH * (hop / MEAN_HOP));
    // Banerjee et al., "Clustering on the Unit Hypersphere using von Mises-Fisher Distributions",
    // JMLR 2005, eq. 4.4, for three dimensions.
    float sharpness = cosine * (3.0 - cosine * cosine) / (1.0 - cosine * cosine);
    vec4 lobe = vec4(1.0, axis * sharpness);
    // exp(K u) over the links of a class, both ways: products, since exponents add up.
    vec3 squares = lobe.yzw * lobe.yzw;
    vec3 face = cosh_of_root(squares), edge = cosh_of_root(squares / 2.0);
    vec3 corner = cosh_of_root(squares / 3.0);
    float sum = WEIGHTS[0] * 2.0 * (face.x + face.y + face.z) +
                WEIGHTS[1] * 4.0 * dot(edge, edge.yzx) +
                WEIGHTS[2] * 8.0 * corner.x * corner.y * corner.z;
    lobe.x = flow.x / sum;
    return lobe;
}
