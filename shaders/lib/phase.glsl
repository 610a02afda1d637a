// SPDX-License-Identifier: GPL-3.0-or-later
// Phase functions, normalised to 1 over the sphere; cosine +1 is forward.

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941, eq. 2.
float phase_hg(float cosine, float g)
{
    float denominator = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * 3.14159265358979 * denominator * sqrt(denominator));
}
