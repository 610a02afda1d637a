// SPDX-License-Identifier: GPL-3.0-or-later
// Phase functions, normalised to 1 over the sphere; cosine +1 is forward.

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941, eq. 2.
float phase_hg(float cosine, float g)
{
    float denominator = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * 3.14159265358979 * denominator * sqrt(denominator));
}

// Of what is scattered, the share that counts as not scattered at all, where strong forward scattering is
// scaled away (Wiscombe, "The Delta-M Method", J. Atmos. Sci. 1977, eq. 14).
float forward_share(float g)
{
    return g * g * g * g;
}

// What bands 0 to 3 show of it without that, per unit of sigma_s.
float phase_truncated(float cosine, float g)
{
    float f = forward_share(g), x2 = cosine * cosine;
    return ((1.0 - f) + 3.0 * (g - f) * cosine + 2.5 * (g * g - f) * (3.0 * x2 - 1.0) +
            3.5 * (g * g * g - f) * cosine * (5.0 * x2 - 3.0)) / (4.0 * 3.14159265358979);
}
