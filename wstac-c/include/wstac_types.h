/**
 * @file
 * What WSTac's headers share: wstac.h for hosts and wstac_fw.h for firmware include this one.
 *
 * cbindgen makes this file from wstac-c/src/types.rs: change it there.
 */

#ifndef WSTAC_TYPES_H
#define WSTAC_TYPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/// The version of the header as text.
#define WSTAC_VERSION_TEXT "0.3.0"

/// Number of features of a frame: five rows, then five columns.
#define WSTAC_FEATURES 10

/// Number of frames of a sample.
#define WSTAC_SAMPLE_FRAMES 70

/// Units of a feature per natural logarithm: a feature is a multiple of 1/2048.
#define WSTAC_FEATURE_ONE 2048

/// The major version of the header.
#define WSTAC_VERSION_MAJOR 0

/// The minor version of the header.
#define WSTAC_VERSION_MINOR 3

/// The patch of the header's version.
#define WSTAC_VERSION_PATCH 0

/// The version of the header in one number: 65536 · major + 256 · minor + patch.
#define WSTAC_VERSION 768

/// A choice of a program: 0 or 1, `false` or `true`. Any other byte is refused.
typedef uint8_t WstacBool;

#endif  /* WSTAC_TYPES_H */
