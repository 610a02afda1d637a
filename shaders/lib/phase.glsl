// SPDX-License-Identifier: GPL-3.0-or-later
// Phase functions, normalised to 1 over the sphere; cosine +1 is forward.

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941, eq. 2.
float phase_hg(float cosine, float g)
{
    float denominator = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * 3.14159265358979 * denominator * sqrt(denominator));
}

// What bands 0 to 3 show of it without its strong forward peak, which counts as not scattered (delta-M,
// lib/harmonics.glsl), per unit of sigma_s.
float phase_truncated(float cosine, float g)
{
    float f = g * g * g * g, x2 = cosine * cosine;
    return ((1.0 - f) + 3.0 * (g - f) * cosine + 2.5 * (g * g - f) * (3.0 * x2 - 1.0) +
            3.5 * (g * g * g - f) * cosine * (5.0 * x2 - 3.0)) / (4.0 * 3.14159265358979);
}
