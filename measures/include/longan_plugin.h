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
#define LONGAN_INTERFACE 3

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

// An area on the sphere.
#define LONGAN_QUANTITY_AREA 1

// A length on the sphere.
#define LONGAN_QUANTITY_LENGTH 2

// A total curvature, which has a sign.
#define LONGAN_QUANTITY_CURVATURE 3

// A moment psi_s by magnitude, or an eigenvalue: a length, or of tensors weighted by curvature a curvature.
#define LONGAN_QUANTITY_MOMENT 4

// A number of things.
#define LONGAN_QUANTITY_COUNT 5

// A quotient of quantities of one kind.
#define LONGAN_QUANTITY_RATIO 6

// A direction in degrees, from south towards east, up to 360 degrees over the measure's `symmetry`.
#define LONGAN_QUANTITY_ANGLE 7

// A deviation from an expected value in standard deviations, about 0.
#define LONGAN_QUANTITY_DEVIATION 8

// A rank among other values, from 0 to 100.
#define LONGAN_QUANTITY_PERCENTILE 9

// Any other number.
#define LONGAN_QUANTITY_NUMBER 10

// A complex number.
typedef struct LonganComplex {
  // Real part.
  double re;
  // Imaginary part.
  double im;
} LonganComplex;

// The moments of one window, the mean over the thresholds, divided by the share of it that is not masked.
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
  // The accuracy of psi_s, s from 1, as a share of the contour's weight: values that differ by less are not told apart.
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
  // LONGAN_QUANTITY_...: the kind of quantity that it is; how values are drawn, averaged and compared follows from
  // it, and so does whether windows with hardly any contour are left out (ratios and angles are).
  uint32_t quantity;
  // Of an angle the number of turns within 360 degrees that change nothing, from 1 to LONGAN_RANK_MAX; of other
  // quantities 0.
  uint32_t symmetry;
  // The ranks of the moments psi_s that it needs, ascending, 0 for psi_0; may be NULL for none.
  const uint32_t *ranks;
  // The number of `ranks`.
  uint32_t ranks_count;
  // The name on the command line: a lower-case letter, then lower-case letters, digits and hyphens, up to 60.
  const char *name;
  // The definition in one line, with the formula.
  const char *definition;
  // The unit, in ASCII: "sr", "rad", "deg", or "" for a pure number; of an angle "deg".
  const char *unit;
  // Evaluates windows: `values` has room for one number for each, in the measure's unit, and NaN says that the
  // measure is not defined there. An infinite value is taken as not defined.
  //
  // Returns 0, or anything else for a failure, which ends the run. Then `message`, which has room for
  // LONGAN_TEXT_SIZE bytes and is empty at first, may hold a text for the user.
  //
  // Many threads call this at the same time. Nothing of the arguments may be kept but the measure itself.
  int32_t (*evaluate)(const struct LonganMeasure *measure,
                      const struct LonganWindows *windows,
                      double *values,
                      char *message);
  // A pointer of the plugin's own, which longan hands back unread; may be NULL.
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
