/* A plugin that is as it should be, unless a definition on the command line makes it otherwise. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "longan_plugin.h"

#ifndef HANDSHAKE
#define HANDSHAKE longan_plugin_handshake
#endif
#ifndef DESCRIBE
#define DESCRIBE longan_plugin
#endif
#ifndef INTERFACE
#define INTERFACE LONGAN_INTERFACE
#endif
#ifndef NAME
#define NAME "plugin"
#endif
#ifndef VERSION
#define VERSION "1.0"
#endif
#ifndef MEASURE
#define MEASURE "all"
#endif
#ifndef SECOND
#define SECOND "length"
#endif
#ifndef DEFINITION
#define DEFINITION "the sum of all that a window has"
#endif
#ifndef UNIT
#define UNIT "rad"
#endif
#ifndef QUANTITY
#define QUANTITY LONGAN_QUANTITY_LENGTH
#endif
#ifndef SYMMETRY
#define SYMMETRY 0
#endif
#ifndef RANK
#define RANK 2
#endif
#ifndef NEEDS
#define NEEDS 0
#endif
#ifndef WEIGHT
#define WEIGHT LONGAN_WEIGHT_EITHER
#endif
#ifndef RANKS
#define RANKS 0, 2, 4
#endif
#ifndef RANKS_POINTER
#define RANKS_POINTER ranks
#endif
#ifndef RANKS_COUNT
#define RANKS_COUNT (sizeof ranks / sizeof *ranks)
#endif
#ifndef EVALUATE
#define EVALUATE all
#endif
#ifndef PLUGIN_SIZE
#define PLUGIN_SIZE sizeof(LonganPlugin)
#endif
#ifndef MEASURE_SIZE
#define MEASURE_SIZE sizeof(LonganMeasure)
#endif
#ifndef OWN_SIZE
#define OWN_SIZE sizeof(LonganMeasure)
#endif
#ifndef WINDOW_SIZE
#define WINDOW_SIZE sizeof(LonganWindow)
#endif
#ifndef WINDOWS_SIZE
#define WINDOWS_SIZE sizeof(LonganWindows)
#endif
#ifndef MEASURES
#define MEASURES measures
#endif
#ifndef COUNT
#define COUNT 2
#endif
#ifndef DESCRIPTION
#define DESCRIPTION &plugin
#endif
#ifndef REFUSAL
#define REFUSAL ""
#endif
#ifndef FAILURE
#define FAILURE 0
#endif

/* A text of 1024 bytes without an end. */
char endless[LONGAN_TEXT_SIZE] = {[0 ... LONGAN_TEXT_SIZE - 1] = 'x'};

/* As much of a text as there is room for, perhaps without its end. */
static void say(char *message) {
    memcpy(message, REFUSAL, sizeof(REFUSAL) < LONGAN_TEXT_SIZE ? sizeof(REFUSAL) : LONGAN_TEXT_SIZE);
}

int32_t all(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message);
int32_t all(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message) {
    for (size_t i = 0; i < windows->count; i++) {
        const LonganWindow *w = &windows->windows[i];
        double sum = w->colatitude + w->longitude + w->masked_fraction + w->area + w->length + w->curvature;
        for (uint32_t k = 0; k < measure->ranks_count; k++) {
            sum += (k + 1) * (w->psi[k].re + 2 * w->psi[k].im);
        }
        values[i] = sum;
#ifdef ODD
        /* Nothing at all, a number, an infinite one, in turn. */
        values[i] = i % 3 == 0 ? NAN : i % 3 == 1 ? 1 : -INFINITY;
#endif
    }
    if (FAILURE) {
        say(message);
    }
    return FAILURE;
}

int32_t length(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message);
int32_t length(const LonganMeasure *measure, const LonganWindows *windows, double *values, char *message) {
    (void)measure;
    (void)message;
    for (size_t i = 0; i < windows->count; i++) {
        values[i] = windows->windows[i].length;
    }
    return 0;
}

const uint32_t ranks[] = {RANKS};

const LonganMeasure measures[] = {
    {
        .size = OWN_SIZE,
        .rank = RANK,
        .needs = NEEDS,
        .weight = WEIGHT,
        .quantity = QUANTITY,
        .symmetry = SYMMETRY,
        .ranks = RANKS_POINTER,
        .ranks_count = RANKS_COUNT,
        .name = MEASURE,
        .definition = DEFINITION,
        .unit = UNIT,
        .evaluate = EVALUATE,
    },
    {
        .size = sizeof(LonganMeasure),
        .needs = LONGAN_NEEDS_LENGTH,
        .quantity = LONGAN_QUANTITY_LENGTH,
        .name = SECOND,
        .definition = "length, as contour-length",
        .unit = "rad",
        .evaluate = length,
    },
    /* What lies behind the end is no measure. */
    {.size = 0},
};

const LonganPlugin plugin = {
    .size = PLUGIN_SIZE,
    .measure_size = MEASURE_SIZE,
    .window_size = WINDOW_SIZE,
    .windows_size = WINDOWS_SIZE,
    .name = NAME,
    .version = VERSION,
    .measures = MEASURES,
    .measures_count = COUNT,
};

#ifndef _WIN32
/* Leaves a file when the library is unloaded. */
#ifdef UNLOADED
__attribute__((destructor)) static void unloaded(void) {
    FILE *file = fopen(UNLOADED, "w");
    if (file) {
        fclose(file);
    }
}
#endif
#endif

LONGAN_EXPORT uint32_t HANDSHAKE(uint32_t interface_version, const char *host_version);
LONGAN_EXPORT uint32_t HANDSHAKE(uint32_t interface_version, const char *host_version) {
    return interface_version == LONGAN_INTERFACE && strchr(host_version, '.') ? INTERFACE : 0;
}

LONGAN_EXPORT const LonganPlugin *DESCRIBE(char *message);
LONGAN_EXPORT const LonganPlugin *DESCRIBE(char *message) {
    say(message);
    return DESCRIPTION;
}

/* The types of the header are those of the functions. */
LonganHandshake check_handshake = HANDSHAKE;
LonganDescribe check_describe = DESCRIBE;
