/* The interface between longan and its plugins. Made from measures/src/plugin/interface.rs: do not edit it here.
 *
 * A plugin is a library that exports the two functions at the end of this file. Its code runs with the rights of whoever
 * runs longan. examples/plugin-c/axis_ratio.c is one; licensed under MIT or Apache-2.0.
 */
#ifndef LONGAN_PLUGIN_H
#define LONGAN_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

// Version of this interface. A plugin works with a longan of the same version only.
#define LONGAN_INTERFACE 2

// Most bytes of a text, its final zero among them. Texts are UTF-8, on one line.
#define LONGAN_TEXT_SIZE 1024

// Most measures of a plugin.
#define LONGAN_MEASURES_MAX 256

// Largest rank that a measure may ask for.
#define LONGAN_RANK_MAX 1000

// Bit of `needs`: W0, the body's area.
#define LONGAN_NEEDS_AREA 1

// Bit of `needs`: W1, the contour's length.
#define LONGAN_NEEDS_LENGTH 2

// Bit of `needs`: W2, the contour's total curvature.
#define LONGAN_NEEDS_CURVATURE 4

// A measure of tensors of either weight.
#define LONGAN_WEIGHT_EITHER 0

// A measure of tensors that are weighted by length, W_1.
#define LONGAN_WEIGHT_LENGTH 1

// A measure of tensors that are weighted by curvature, W_2.
#define LONGAN_WEIGHT_CURVATURE 2

// A complex number.
typedef struct LonganComplex {
  // Real part.
  double re;
  // Imaginary part.
  double im;
} LonganComplex;

// The moments of one window, the mean over the thresholds, made up for what is masked.
typedef struct LonganWindow {
  // Colatitude of the centre in degrees.
  double colatitude;
  // Longitude of the centre in degrees.
  double longitude;
  // Share of the window's cells that are masked, below 1.
  double masked_fraction;
  // W0 in steradian; 0 unless needed.
  double area;
  // W1 in radians; 0 unless needed.
  double length;
  // W2 in radians; 0 unless needed.
  double curvature;
  // psi_s for each of the measure's `ranks`, in their order: the sum of L exp(i s phi) over the contour's pieces,
  // phi the angle of their outward normal from south towards east. psi_0 is real.
  const struct LonganComplex *psi;
  // The accuracy of psi_s, s from 1, as a share of the contour's weight: what differs by less is not told apart.
  double resolution;
} LonganWindow;

// Windows to be evaluated in one call.
typedef struct LonganWindows {
  // Number of windows, at least 1.
  size_t count;
  // The windows.
  const struct LonganWindow *windows;
} LonganWindows;

// A measure of a plugin.
typedef struct LonganMeasure {
  // sizeof(LonganMeasure).
  uint32_t size;
  // The rank of the tensor that it belongs to.
  uint32_t rank;
  // LONGAN_NEEDS_... or'ed: which of W0, W1 and W2 it needs.
  uint32_t needs;
  // LONGAN_WEIGHT_...: the tensors that it is defined for.
  uint32_t weight;
  // The ranks of the moments psi_s that it needs, ascending, 0 for psi_0; may be NULL for none.
  const uint32_t *ranks;
  // The number of `ranks`.
  uint32_t ranks_count;
  // The name on the command line: a lower-case letter, then lower-case letters, digits and hyphens, up to 60.
  const char *name;
  // What it is, in one line, with its formula.
  const char *definition;
  // Its unit, in ASCII: "sr", "rad", "deg", or "" for a pure number.
  const char *unit;
  // Evaluates windows: `values` has room for one number for each, in the measure's unit, and NaN says that the
  // measure is not defined there. What is infinite is taken as not defined.
  //
  // Returns 0, or anything else for a failure, which ends the run. Then `message`, which has room for
  // LONGAN_TEXT_SIZE bytes and is empty at first, may hold a text for the user.
  //
  // Many threads call this at the same time. Nothing of the arguments may be kept but the measure itself.
  int32_t (*evaluate)(const struct LonganMeasure *measure,
                      const struct LonganWindows *windows,
                      double *values,
                      char *message);
  // Whatever the plugin wants to find here again; may be NULL.
  const void *context;
} LonganMeasure;

// A plugin. It and all that it points to stay as they are for as long as the library is loaded.
typedef struct LonganPlugin {
  // sizeof(LonganPlugin).
  uint32_t size;
  // sizeof(LonganMeasure).
  uint32_t measure_size;
  // sizeof(LonganWindow).
  uint32_t window_size;
  // sizeof(LonganWindows).
  uint32_t windows_size;
  // The plugin's name, of the same form as a measure's.
  const char *name;
  // The plugin's own version, such as "0.1.0".
  const char *version;
  // Its measures.
  const struct LonganMeasure *measures;
  // The number of `measures`.
  uint32_t measures_count;
} LonganPlugin;

// `longan_plugin_handshake`, which every plugin exports and longan calls first: tells the plugin longan's version of
// this interface and longan's own version, such as "0.1.0", and returns LONGAN_INTERFACE.
typedef uint32_t (*LonganHandshake)(uint32_t interface_version, const char *host_version);

// `longan_plugin`, which every plugin exports and longan calls once, if the versions are the same. Returns NULL for a
// failure; then `message`, which has room for LONGAN_TEXT_SIZE bytes and is empty at first, may hold a text for the
// user.
typedef const struct LonganPlugin *(*LonganDescribe)(char *message);


// Before a function that a plugin exports.
#ifdef __cplusplus
#define LONGAN_LINKAGE extern "C"
#else
#define LONGAN_LINKAGE
#endif
#ifdef _WIN32
#define LONGAN_EXPORT LONGAN_LINKAGE __declspec(dllexport)
#else
#define LONGAN_EXPORT LONGAN_LINKAGE __attribute__((visibility("default")))
#endif

// The two functions that a plugin defines: a LonganHandshake and a LonganDescribe.
LONGAN_EXPORT uint32_t longan_plugin_handshake(uint32_t interface_version, const char *host_version);
LONGAN_EXPORT const LonganPlugin *longan_plugin(char *message);

#endif
