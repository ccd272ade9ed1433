/**
 * @file
 * WSTac for hosts: tactile events from cameras, recordings and scenes, or from frames that a program pushes.
 *
 * The library is libwstac.so, which ci/build libwstac builds and installs. docs/C.md describes its use.
 * The header for firmware is wstac_fw.h.
 * cbindgen makes this file from wstac-c/src: change it there.
 */

#ifndef WSTAC_H
#define WSTAC_H

#include "wstac_types.h"

/// Most records of pushed frames that wait for wstac_next.
#define WSTAC_MOST_RECORDS 1024

/// Status of a call.
enum WstacStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// Done.
  WSTAC_STATUS_OK = 0,
  /// A pointer is null.
  WSTAC_STATUS_NULL = 1,
  /// A string is not UTF-8.
  WSTAC_STATUS_TEXT = 2,
  /// An option or a description of frames is wrong, or does not apply to what is opened.
  WSTAC_STATUS_OPTION = 3,
  /// The configuration cannot be read, or does not fit the source.
  WSTAC_STATUS_CONFIG = 4,
  /// A model cannot be used.
  WSTAC_STATUS_MODEL = 5,
  /// The source cannot be opened, or cannot be read any further.
  WSTAC_STATUS_SOURCE = 6,
  /// A frame has too few bytes, or too many for its size.
  WSTAC_STATUS_FRAME = 7,
  /// The call does not fit the handle or its state.
  WSTAC_STATUS_STATE = 8,
  /// Something inside has failed: the handle can only be closed.
  WSTAC_STATUS_PANIC = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacStatus WstacStatus;
#else
typedef int32_t WstacStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// Kind of a record.
enum WstacKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// No record yet: call again, or push more frames.
  WSTAC_KIND_WAITING = 0,
  /// The features of a frame, if the options request them. Has frame and features.
  WSTAC_KIND_FEATURES = 1,
  /// A tactile event. Has frame, event and texture.
  WSTAC_KIND_EVENT = 2,
  /// The answer of a model that needs fewer than 70 frames. The event follows with the same texture. Has frame,
  /// frames and texture.
  WSTAC_KIND_TEXTURE = 3,
  /// A sample that a long gap interrupted. It has no event. Has frame and frames.
  WSTAC_KIND_INCOMPLETE = 4,
  /// A fault of the source, which goes on. Has frame, fault and message.
  WSTAC_KIND_FAULT = 5,
  /// The end of the stream. Has frame, the number of feature frames, end, and message if frames were lost.
  WSTAC_KIND_END = 6,
  /// The end of the touch of an event: its light has left. Has frame, the first dark frame, event_frame and time_s.
  /// A law of durations gives none.
  WSTAC_KIND_CONTACT_END = 7,
  /// Speed and direction of a frame while something slides, if the options request them. Has frame and time_s, and of
  /// event the contact, and speed and direction with their standard deviations.
  WSTAC_KIND_MOTION = 8,
  /// A held part begins to slip. Has frame, onset_frame, held_since_frame and strength. Only the estimator `wave`
  /// gives it.
  WSTAC_KIND_SLIP = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacKind WstacKind;
#else
typedef int32_t WstacKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// A sensor, opened by wstac_open or wstac_open_frames. It belongs to the thread that opened it. Sensors share nothing.
typedef struct Wstac Wstac;

/// Options of a sensor. Zeros are the defaults: `WstacOptions options = {0};`.
typedef struct WstacOptions {
  /// Path of a configuration file (TOML). Null: the source's own configuration, or else the default.
  const char *config;
  /// Texture models: paths of .wsm files, or names such as "builtin". The last one is null. Null: no model.
  const char *const *models;
  /// Frames per second, numerator: requested from a camera, and assumed of a file. 0 and 0: no request.
  uint32_t fps_numerator;
  /// Frames per second, denominator.
  uint32_t fps_denominator;
  /// Four-character code of the pixel format requested from a camera, such as "YUYV". Null: no request.
  const char *format;
  /// Width in pixels requested from a camera. 0 and 0: no request.
  uint32_t width;
  /// Height in pixels requested from a camera.
  uint32_t height;
  /// Give the features of every frame as a record.
  WstacBool features;
  /// Take every frame of a camera, the oldest first, as long as the driver has buffers. Otherwise a slow program
  /// gets the newest frame.
  WstacBool every_frame;
  /// Leave the controls of a camera as they are instead of locking them.
  WstacBool keep_controls;
  /// Give speed and direction of every frame as a record while something slides.
  WstacBool motion;
  /// Give an event as soon as its answers are certain, without a sample, instead of after 70 frames.
  WstacBool at_once;
  /// The sensor to read of a recording of several. Null: the recording has one.
  const char *sensor;
  /// Content of a configuration file, in UTF-8, instead of `config`. Null: none.
  const char *config_text;
} WstacOptions;

/// Describes frames that a program pushes.
typedef struct WstacFrames {
  /// Width in pixels, 1 to 16384.
  uint32_t width;
  /// Height in pixels, 1 to 16384.
  uint32_t height;
  /// Four-character code of the pixel format, such as "GREY", "YUYV" or "RGB3".
  const char *format;
  /// Bytes from row to row. 0: rows without padding.
  uint32_t bytes_per_row;
  /// Frames per second, numerator. 0 and 0: 30 per second. Above 45 per second, frames are added up to about 30 per
  /// second.
  uint32_t fps_numerator;
  /// Frames per second, denominator.
  uint32_t fps_denominator;
  /// YCbCr is encoded as ITU-R BT.709 instead of BT.601.
  WstacBool bt709;
  /// YCbCr has full range instead of limited range.
  WstacBool full_range;
} WstacFrames;

/// A tactile event, with the numbers that `wstac run --json` prints.
typedef struct WstacEvent {
  /// Sliding speed in mm/s: one decimal, or four significant digits if that is finer. NAN if there is none.
  double speed_mm_s;
  /// The speed is outside the range that the law of durations was fitted on; false by arrival times.
  bool speed_extrapolated;
  /// Upper bound in mm/s of the speed of an event that is cut off, by a law of durations; NAN otherwise.
  double speed_at_most_mm_s;
  /// Lit frames from the first to the last, less one: 0 to 69; -1 if no frame is lit, or if the
  /// sample does not show the touch's begin and end.
  int32_t duration_frames;
  /// Sliding direction in degrees, counterclockwise from +x: 0 to below 360, two decimals; NAN if there is none. By a
  /// law of durations it is 0, 90, 180 or 270.
  double direction_deg;
  /// Confidence of the direction by a law of durations: 0 to 1, four decimals; NAN by arrival times.
  double direction_confidence;
  /// Frames of the sample that were lost and filled: 0 to 70.
  uint32_t frames_filled;
  /// The baseline was quiet, and at most a tenth of the sample was filled. By arrival times also: speed and direction
  /// mostly hold within their standard deviations, and the kind of the touch is clear.
  bool reliable;
  /// Why there is no speed; null if there is one.
  const char *why_no_speed;
  /// Why there is no direction; null if there is one.
  const char *why_no_direction;
  /// The sample: 70 frames of ten features each, natural logarithms in units of 1/2048. Null with the option at_once,
  /// and of a board whose sample has not arrived.
  const int16_t (*sample)[10];
  /// Kind of the touch: "slide", "press", "poke" or "unclear"; null by a law of durations.
  const char *contact;
  /// Standard deviation of the speed in mm/s; NAN if there is none.
  double speed_sd_mm_s;
  /// Standard deviation of the direction in degrees; NAN if there is none.
  double direction_sd_deg;
  /// Number of the first lit frame of the touch; -1 by a law of durations.
  int64_t touch_frame;
  /// Number of the first dark frame behind the touch; -1 if the light has not left, or by a law of durations.
  int64_t end_frame;
  /// Time of the first lit frame in seconds from the first frame; NAN by a law of durations.
  double touch_s;
  /// Time of the frame with which the answer was complete in seconds from the first frame; NAN by a law of durations.
  double completed_s;
  /// Wall-clock time of the first lit frame, as RFC 3339 in UTC; null where the source knows none. The record has it,
  /// too.
  const char *stamp;
  /// Time of the frame with which the answer was complete in nanoseconds, by the clock of time_ns; -1 if it is not
  /// known.
  int64_t completed_ns;
  /// Why the touch is unclear or the answers are not reliable; null if they are, by a law of durations, and if a
  /// board does not say.
  const char *why_not_reliable;
  /// Why there is no texture, or which speeds the model knows if that of the slide is none; null otherwise.
  const char *why_texture;
  /// What speed and direction are known by: "edge" (an edge that covers the sensor: only the motion across it is
  /// known) or "outline" (an object that is narrower than the sensor, or a corner); null unless 25 taxels were asked.
  const char *basis;
  /// Middle of the touch to the left of its motion, from the sensor's middle, in mm; NaN if it is unknown.
  double place_mm;
  /// Standard deviation of the place in mm; NaN without one.
  double place_sd_mm;
  /// Width of the touch across its motion in mm; NaN if it is unknown.
  double width_mm;
  /// Standard deviation of the width in mm; NaN without one.
  double width_sd_mm;
  /// Objects side by side, as far as 25 taxels tell them apart; -1 if it is unknown.
  int32_t contacts;
  /// Mean acceleration while an edge passes the sensor, in mm/s^2, below 0 if it slows down; NaN if it is unknown,
  /// and from boards.
  double acceleration_mm_s2;
  /// Standard deviation of the acceleration in mm/s^2; NaN without one.
  double acceleration_sd_mm_s2;
  /// Period of the texture along the motion in mm; NaN if it is unknown, and from boards.
  double period_mm;
  /// Standard deviation of the period in mm; NaN without one.
  double period_sd_mm;
} WstacEvent;

/// Answer of the texture models. Strings are UTF-8, and null if no model tells.
typedef struct WstacTexture {
  /// The specimen, such as Saw3.
  const char *specimen;
  /// The pattern, such as Saw.
  const char *pattern;
  /// The depth of the pattern in mm; NAN if no model tells.
  double depth_mm;
  /// The class of a model of another task.
  const char *other;
  /// The probability that the names are right, 0 to below 1; NAN if a model has no calibration.
  double confidence;
  /// 1 if the touch is like those of the training, and 0 if it is not: then there are no names. -1 if no model tells.
  int8_t known;
} WstacTexture;

/// How a stream ended.
typedef struct WstacEnd {
  /// Camera frames that were lost or unusable.
  uint64_t dropped;
  /// Whether the stream was long enough for the baseline.
  bool baseline_complete;
  /// Number of the first frame of the sample that the end interrupted.
  uint64_t incomplete_frame;
  /// Frames of that sample that had arrived; 0 if there is none.
  uint32_t incomplete_frames;
  /// Clock of all times in nanoseconds. "driver": the monotonic clock, which all cameras of a machine share.
  /// "board": times of a board in that clock. "frames": the source states no times, so frames are counted from 0.
  /// Null in records of other kinds.
  const char *clock;
} WstacEnd;

/// A record of wstac_next. Its kind tells which fields it has. The others have no value: 0, -1, NAN or null.
typedef struct WstacRecord {
  /// Kind of the record.
  WstacKind kind;
  /// Number of a feature frame, from 0: the first frame of a sample, or the frame that comes after a fault.
  uint64_t frame;
  /// Features: natural logarithms in units of 1/2048.
  int16_t features[10];
  /// Answers of an event.
  struct WstacEvent event;
  /// Texture of an event, if there is a model, or a texture before its event.
  struct WstacTexture texture;
  /// Frames of an interrupted sample that had arrived, or frames that a model reads.
  uint32_t frames;
  /// Kind of a fault, such as "disconnected".
  const char *fault;
  /// Description of a fault for a person; of an end the lost frames by reason, such as "3 shorter than a frame, 1
  /// corrupt JPEG picture", null if none was lost.
  const char *message;
  /// Summary of a stream.
  struct WstacEnd end;
  /// Number of the first frame of the event whose touch has ended.
  uint64_t event_frame;
  /// Time of a touch's end in seconds from the first frame; NAN if it is not known.
  double time_s;
  /// Time of the record's frame in nanoseconds, of an event that of its first touch, and of the end that of the last
  /// frame; -1 if it is not known. Its clock is that of WstacEnd.
  int64_t time_ns;
  /// Wall-clock time of the same frame, as RFC 3339 in UTC; null where the source knows none.
  const char *stamp;
  /// The most by which the stamp may be wrong in milliseconds; NAN where there is none.
  double stamp_within_ms;
  /// Number of the first frame with light of a slip.
  uint64_t onset_frame;
  /// Number of the first frame with light of the press, or, after a slip, of the frame in which its rest was known.
  uint64_t held_since_frame;
  /// Most light of a frame since the onset of a slip, as a fraction of the press's brightest frame; NAN in records of
  /// other kinds.
  double strength;
  /// The 25 taxel sums that the features are made of, row by row; 0 if no camera frame of them arrived, of a
  /// board, and in records of other kinds.
  uint32_t taxel_sums[25];
} WstacRecord;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/// Opens a source, as `wstac run SOURCE` does.
///
/// A source is "/dev/videoN", "rpicam:", "scene:Saw3@150,90deg", a Y4M file, a folder of PNGs or JPEGs, a recording
/// (.mcap), a board such as "/dev/ttyACM0", or "-".
/// `source` need not be UTF-8; `options` may be null. If the call fails, the handle is null, and
/// wstac_error_message(NULL) returns the message.
///
/// # Safety
/// `source` is null or a string that ends in 0; `options` is null or options; `handle` is null or memory for a pointer.
WstacStatus wstac_open(const char *source, const struct WstacOptions *options, struct Wstac **handle);

/// Opens a sensor whose frames the program pushes.
///
/// `options` may be null. Options that choose a source are refused.
///
/// # Safety
/// `frames` is null or a description; `options` is null or options; `handle` is null or memory for a pointer.
WstacStatus wstac_open_frames(const struct WstacFrames *frames,
                              const struct WstacOptions *options,
                              struct Wstac **handle);

/// Writes the next record.
///
/// A source is read until there is a record. A camera without a frame gives WSTAC_KIND_WAITING within a second. With
/// frames that the program pushes, WSTAC_KIND_WAITING means: push more. WSTAC_KIND_END is the last record.
///
/// If a source cannot be read any further, the call returns WSTAC_STATUS_SOURCE, and the record is the end record.
/// Otherwise the record is written only with WSTAC_STATUS_OK. What a record points to is valid until the next
/// wstac_next or wstac_close of the handle.
///
/// # Safety
/// `handle` is null or an open handle; `record` is null or memory for one.
WstacStatus wstac_next(struct Wstac *handle, struct WstacRecord *record);

/// Takes a frame of `length` bytes, laid out as described to wstac_open_frames. wstac_next returns the records that
/// follow.
///
/// A frame with too few bytes is refused and not taken. Call wstac_push_lost to keep its place in time. So is a frame
/// with too many, which has another size than described: a row and 4096 bytes of padding at its end are allowed. At
/// most WSTAC_MOST_RECORDS records wait: then no frame is taken until wstac_next has returned some.
///
/// # Safety
/// `handle` is null or an open handle; `bytes` is null or `length` bytes.
WstacStatus wstac_push_frame(struct Wstac *handle, const uint8_t *bytes, size_t length);

/// Keeps the place of lost frames in time, unless WSTAC_MOST_RECORDS records wait. A short gap is filled; a long one
/// interrupts the sample.
///
/// # Safety
/// `handle` is null or an open handle.
WstacStatus wstac_push_lost(struct Wstac *handle, uint64_t frames);

/// Ends a stream of pushed frames, or a source before its end. wstac_next returns what is pending, then the end record.
///
/// # Safety
/// `handle` is null or an open handle.
WstacStatus wstac_finish(struct Wstac *handle);

/// Closes a handle and frees everything that belongs to it, strings of records included. Null is allowed, as in free.
///
/// # Safety
/// `handle` is null or an open handle, which is not used again.
void wstac_close(struct Wstac *handle);

/// Returns the message of the last call on this handle that failed: what was found and what was expected.
///
/// For null, it is the message of the last call of this thread that failed without a handle. The message is UTF-8,
/// never null, and valid until the next call on the handle (for null: of this thread).
///
/// # Safety
/// `handle` is null or an open handle.
const char *wstac_error_message(const struct Wstac *handle);

/// Returns the kind of the error whose message wstac_error_message returns for the same handle: not_found,
/// already_exists, busy, io, device, config, frame, format, data, unsupported or usage.
///
/// It is empty if the status says all. The string is never null, and valid as long as the message.
///
/// # Safety
/// `handle` is null or an open handle.
const char *wstac_error_kind(const struct Wstac *handle);

/// Returns what nothing states of a handle's source, such as where its taxels are, and what follows for the answers.
///
/// It is UTF-8 for a person, one sentence per line. It is empty if all is stated, if the handle is null, or after
/// WSTAC_STATUS_PANIC. The string is valid until wstac_close.
///
/// # Safety
/// `handle` is null or an open handle, which no other thread uses meanwhile.
const char *wstac_notes(const struct Wstac *handle);

/// Returns the milliseconds in which the camera reads its rows, as motion is computed with it.
///
/// It is negative if the bottom row comes first, and 0 for a global shutter. It is NAN if nothing states it, if the
/// handle is null, or after WSTAC_STATUS_PANIC.
///
/// # Safety
/// `handle` is null or an open handle, which no other thread uses meanwhile.
double wstac_readout_ms(const struct Wstac *handle);

/// Returns a status in words: a static string in English. A number that is no status has a string, too.
const char *wstac_error_text(int32_t status);

/// Returns the version of the library that is loaded, such as "0.3.0", as WSTAC_VERSION_TEXT has that of the header.
const char *wstac_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* WSTAC_H */
