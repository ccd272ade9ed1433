/*
 * WSTac for hosts: tactile events of cameras, recordings and scenes, or of frames that a program pushes.
 *
 * The library is libwstac.so, which ci/libwstac builds and installs; docs/C.md says how to use it. The header for firmware is wstac_fw.h.
 * Made of wstac-c/src by cbindgen: change it there.
 */

#ifndef WSTAC_H
#define WSTAC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Features of a frame: five rows, then five columns.
#define WSTAC_FEATURES 10

// Frames of a sample.
#define WSTAC_SAMPLE_FRAMES 70

// What a feature is in units of: 1/2048 of a natural logarithm.
#define WSTAC_FEATURE_ONE 2048

// What a call comes back with.
enum WstacStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  WSTAC_STATUS_OK = 0,
  // A pointer is null.
  WSTAC_STATUS_NULL = 1,
  // A text is not UTF-8.
  WSTAC_STATUS_TEXT = 2,
  // An option, or a description of frames, is wrong, or does not go with what is opened.
  WSTAC_STATUS_OPTION = 3,
  // The configuration cannot be read, or does not fit the source.
  WSTAC_STATUS_CONFIG = 4,
  // A model cannot be used.
  WSTAC_STATUS_MODEL = 5,
  // The source cannot be opened, or not be read any further.
  WSTAC_STATUS_SOURCE = 6,
  // A frame has too few bytes.
  WSTAC_STATUS_FRAME = 7,
  // The call does not fit what the handle is, or what it has done.
  WSTAC_STATUS_STATE = 8,
  // Something inside has failed: the handle can only be closed.
  WSTAC_STATUS_PANIC = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacStatus WstacStatus;
#else
typedef int32_t WstacStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a record is.
enum WstacKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing yet: ask again, or push more frames.
  WSTAC_KIND_WAITING = 0,
  // The features of a frame, where options ask for them: frame and features.
  WSTAC_KIND_FEATURES = 1,
  // A tactile event: frame and event.
  WSTAC_KIND_EVENT = 2,
  // What a model that needs fewer than 70 frames says before the event is complete, which will say the same: frame and texture.
  WSTAC_KIND_TEXTURE = 3,
  // A sample that a long gap interrupted: frame, and frames of it that had arrived.
  WSTAC_KIND_INCOMPLETE = 4,
  // Something happened to the source, which goes on: fault and message.
  WSTAC_KIND_FAULT = 5,
  // The end: frame is the number of feature frames, and end says more.
  WSTAC_KIND_END = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacKind WstacKind;
#else
typedef int32_t WstacKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A sensor: what wstac_open and wstac_open_frames make. It belongs to the thread that opened it; several sensors share nothing.
typedef struct Wstac Wstac;

// How a sensor is opened. All zeros, `WstacOptions options = {0};`, are the defaults.
typedef struct WstacOptions {
  // Path of a configuration file (TOML); null for the source's own, else the default.
  const char *config;
  // Texture models, each a path of a .wsm file or such as "builtin:svm"; the last is null. Null for none.
  const char *const *models;
  // Frames a second, numerator: of a recording, instead of what it says; of a camera, to ask for. 0 and 0 ask nothing.
  uint32_t fps_numerator;
  // Frames a second, denominator.
  uint32_t fps_denominator;
  // Pixel format to ask a camera for, by its four-character code, such as "YUYV"; null asks nothing.
  const char *format;
  // Pixels of a row to ask a camera for; 0 and 0 ask nothing.
  uint32_t width;
  // Rows of a frame to ask a camera for.
  uint32_t height;
  // Give a record of every frame's features.
  bool features;
  // Give every frame of a camera, the oldest first, as long as the driver has room; otherwise the newest, where the program is slower.
  bool every_frame;
  // Leave a camera's controls automatic instead of locking them.
  bool keep_controls;
} WstacOptions;

// Frames that a program pushes.
typedef struct WstacFrames {
  // Pixels of a row, 1 to 16384.
  uint32_t width;
  // Rows of a frame, 1 to 16384.
  uint32_t height;
  // Pixel format by its four-character code, such as "GREY", "YUYV" or "RGB3".
  const char *format;
  // Bytes from row to row; 0 for rows without padding.
  uint32_t bytes_per_row;
  // Frames a second, numerator; 0 and 0 are 30 a second. Above 45 a second frames are added up to about 30.
  uint32_t fps_numerator;
  // Frames a second, denominator.
  uint32_t fps_denominator;
  // Y Cb Cr are of ITU-R BT.709 instead of BT.601.
  bool bt709;
  // Y Cb Cr are of full range instead of limited.
  bool full_range;
} WstacFrames;

// A tactile event: what `wstac run --json` prints.
typedef struct WstacEvent {
  // Sliding speed in mm/s, to a tenth, as `wstac run` prints it; NAN where there is none.
  double speed_mm_s;
  // The speed is outside the range that the law was fitted on.
  bool speed_extrapolated;
  // Of a slide that is cut off: it was at most this fast, in mm/s; NAN otherwise.
  double speed_at_most_mm_s;
  // Lit frames, last less first: 0 to 69; -1 where no frame is lit.
  int32_t duration_frames;
  // Sliding direction in degrees: 0, 90, 180 or 270, counter-clockwise from +x; NAN where it is unclear.
  double direction_deg;
  // 0 to 1, to four decimals.
  double direction_confidence;
  // Frames of the sample that were filled: 0 to 70.
  uint32_t frames_filled;
  // The baseline was quiet, and at most a tenth of the sample was filled.
  bool reliable;
  // Why there is no speed; null where there is one.
  const char *why_no_speed;
  // Why there is no direction; null where there is one.
  const char *why_no_direction;
  // The sample: 70 frames of ten features each, natural logarithms in units of 1/2048.
  const int16_t (*sample)[10];
} WstacEvent;

// What texture models say. Texts are UTF-8, null where no model tells.
typedef struct WstacTexture {
  // The specimen, such as Saw3.
  const char *specimen;
  // The pattern, such as Saw.
  const char *pattern;
  // The depth of the pattern in mm; NAN where no model tells.
  double depth_mm;
  // The class of a model that tells something else apart.
  const char *other;
} WstacTexture;

// How a stream ended.
typedef struct WstacEnd {
  // Camera frames that were lost or unusable.
  uint64_t dropped;
  // The stream was long enough for the baseline.
  bool baseline_complete;
  // Number of the first frame of the sample that was under way.
  uint64_t incomplete_frame;
  // Frames of it that had arrived; 0 where none was under way.
  uint32_t incomplete_frames;
} WstacEnd;

// What wstac_next gives. Which parts mean something is said at its kind; the others are as of an event without answers, and null.
typedef struct WstacRecord {
  // What it is.
  WstacKind kind;
  // Number of a feature frame, from 0: of an event the first of its sample, of a fault the one that comes next.
  uint64_t frame;
  // Natural logarithms in units of 1/2048.
  int16_t features[10];
  // Of an event.
  struct WstacEvent event;
  // Of an event with models, or a texture.
  struct WstacTexture texture;
  // Frames of an interrupted sample that had arrived, or that a model looked at.
  uint32_t frames;
  // Kind of a fault in a word, such as disconnected.
  const char *fault;
  // What happened, for a person.
  const char *message;
  // Of the end.
  struct WstacEnd end;
} WstacRecord;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Opens a source, as `wstac run SOURCE` does: "/dev/videoN", "scene:Saw3@150,90deg", a Y4M file, a folder of PNGs, a recording (.mcap), or
// "-". `source` is UTF-8; `options` may be null. Where it fails, the handle is null, and wstac_error_message(NULL) says why.
//
// # Safety
// `source` is null or text that ends in 0; `options` is null or options; `handle` is null or memory for a pointer.
WstacStatus wstac_open(const char *source,
                       const struct WstacOptions *options,
                       struct Wstac **handle);

// Opens a sensor whose frames the program pushes. Of `options`, which may be null, those that choose a source are refused.
//
// # Safety
// `frames` is null or a description; `options` is null or options; `handle` is null or memory for a pointer.
WstacStatus wstac_open_frames(const struct WstacFrames *frames,
                              const struct WstacOptions *options,
                              struct Wstac **handle);

// The next record. Of a source it reads until there is one; a camera gives WSTAC_KIND_WAITING at least once a second where there is none.
// Of frames that are pushed it gives WSTAC_KIND_WAITING where all records are out: push more. After WSTAC_KIND_END there is no more.
// A source that cannot be read any further comes back with WSTAC_STATUS_SOURCE, and the record is the end record. Otherwise the record is
// written only with WSTAC_STATUS_OK. What a record points to stays until the next call of wstac_next or wstac_close.
//
// # Safety
// `handle` is null or an open handle; `record` is null or memory for one.
WstacStatus wstac_next(struct Wstac *handle,
                       struct WstacRecord *record);

// Takes the bytes of a frame, laid out as wstac_open_frames was told. wstac_next gives what follows. A frame with too few bytes is refused,
// and has not been taken: wstac_push_lost keeps its place in time.
//
// # Safety
// `handle` is null or an open handle; `bytes` is null or `length` bytes.
WstacStatus wstac_push_frame(struct Wstac *handle,
                             const uint8_t *bytes,
                             size_t length);

// Keeps the place of lost frames in time: a short gap is filled, a long one ends what was under way.
//
// # Safety
// `handle` is null or an open handle.
WstacStatus wstac_push_lost(struct Wstac *handle, uint64_t frames);

// Ends a stream of frames that are pushed, or stops a source early: wstac_next gives what is pending, then the end record.
//
// # Safety
// `handle` is null or an open handle.
WstacStatus wstac_finish(struct Wstac *handle);

// Closes a handle and frees all that belongs to it, records' texts included. Null is allowed, as in free.
//
// # Safety
// `handle` is null or an open handle, which is not used again.
void wstac_close(struct Wstac *handle);

// What the last call on this handle that failed said: what, what was found and what was expected. Of null, what the last call of this thread
// said that failed without a handle. UTF-8; it stays until the next call on the handle (of null: of this thread). Never null.
//
// # Safety
// `handle` is null or an open handle.
const char *wstac_error_message(const struct Wstac *handle);

// A status in words: text in English that ends in 0 and stays. Of a number that is no status it says so.
const char *wstac_error_text(int32_t status);

// The version of the library, such as "0.1.0".
const char *wstac_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* WSTAC_H */
