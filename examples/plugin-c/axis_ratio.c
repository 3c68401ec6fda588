/* A plugin in C: the axis ratio, and EVQ as the built-in measure has it.
 *
 *     cc -O2 -shared -fPIC -I measures/include examples/plugin-c/axis_ratio.c -o axis_ratio.so -lm
 *     longan map sky.fits -o out.fits --plugin ./axis_ratio.so --measure axis-ratio
 */
#include <math.h>
#include <stdio.h>

#include "longan_plugin.h"

/* The moments that both measures need. */
static const uint32_t RANKS[] = {0, 2};

/* Fills in the rank 2 tensor's eigenvalues, times two, by magnitude: the smaller is negative where they differ in sign. */
static void eigenvalues(const LonganWindow *window, double *larger, double *smaller) {
    const double psi0 = fabs(window->psi[0].re);
    const double anisotropy = hypot(window->psi[1].re, window->psi[1].im);
    *larger = psi0 + anisotropy;
    *smaller = psi0 - anisotropy;
}

static int32_t axis_ratio(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message) {
    (void)measure;
    for (size_t i = 0; i < windows->count; i++) {
        const LonganWindow *window = &windows->windows[i];
        double larger, smaller;
        eigenvalues(window, &larger, &smaller);
        if (window->psi[0].re < 0) {
            snprintf(message, LONGAN_TEXT_SIZE, "a contour of negative length at colatitude %g, longitude %g",
                     window->colatitude, window->longitude);
            return 1;
        }
        values[i] = larger > 0 ? fmax(smaller, 0) / larger : NAN;
    }
    return 0;
}

static int32_t quotient(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message) {
    (void)measure;
    (void)message;
    for (size_t i = 0; i < windows->count; i++) {
        const LonganWindow *window = &windows->windows[i];
        double larger, smaller;
        eigenvalues(window, &larger, &smaller);
        values[i] = smaller > window->resolution * fabs(window->psi[0].re) ? larger / smaller : NAN;
    }
    return 0;
}

static const LonganMeasure MEASURES[] = {
    {
        .size = sizeof(LonganMeasure),
        .rank = 2,
        .quantity = LONGAN_QUANTITY_RATIO,
        .weight = LONGAN_WEIGHT_LENGTH,
        .ranks = RANKS,
        .ranks_count = 2,
        .name = "axis-ratio",
        .definition = "axis ratio, the inverse of EVQ: (psi_0 - |psi_2|)/(psi_0 + |psi_2|)",
        .unit = "",
        .evaluate = axis_ratio,
    },
    {
        .size = sizeof(LonganMeasure),
        .rank = 2,
        .quantity = LONGAN_QUANTITY_RATIO,
        .ranks = RANKS,
        .ranks_count = 2,
        .name = "quotient",
        .definition = "eigenvalue quotient of the rank 2 tensor, larger over smaller, as evq",
        .unit = "",
        .evaluate = quotient,
    },
};

static const LonganPlugin PLUGIN = {
    .size = sizeof(LonganPlugin),
    .measure_size = sizeof(LonganMeasure),
    .window_size = sizeof(LonganWindow),
    .windows_size = sizeof(LonganWindows),
    .name = "example-c",
    .version = "1.0",
    .measures = MEASURES,
    .measures_count = sizeof MEASURES / sizeof *MEASURES,
};

LONGAN_EXPORT uint32_t longan_plugin_handshake(uint32_t interface_version, const char *host_version) {
    (void)interface_version;
    (void)host_version;
    return LONGAN_INTERFACE;
}

LONGAN_EXPORT const LonganPlugin *longan_plugin(char *message) {
    (void)message;
    return &PLUGIN;
}
