/**
 * @file
 * WSTac for firmware: frames or stripes of a camera in, tactile events out, in memory that the program gives.
 *
 * The library is libwstac_fw.a; docs/C.md says how to build and to use it. The header for hosts is wstac.h.
 * Made of wstac-fw/capi/src by cbindgen: change it there.
 */

#ifndef WSTAC_FW_H
#define WSTAC_FW_H

#include "wstac_types.h"

/// The version of the header as text.
#define WSTAC_FW_VERSION_TEXT WSTAC_VERSION_TEXT

/// The major version of the header.
#define WSTAC_FW_VERSION_MAJOR WSTAC_VERSION_MAJOR

/// The minor version of the header.
#define WSTAC_FW_VERSION_MINOR WSTAC_VERSION_MINOR

/// The patch of the header's version.
#define WSTAC_FW_VERSION_PATCH WSTAC_VERSION_PATCH

/// The version of the header in one number: 65536 · major + 256 · minor + patch.
#define WSTAC_FW_VERSION WSTAC_VERSION

/// The number of features of a frame: five rows, then five columns.
#define WSTAC_FW_FEATURES WSTAC_FEATURES

/// The number of frames of a sample.
#define WSTAC_FW_SAMPLE_FRAMES WSTAC_SAMPLE_FRAMES

/// A choice of a program: 0 or 1, `false` or `true`. Any other byte is refused.
typedef WstacBool WstacFwBool;

/// The number of numbers of a sample, frame by frame: feature k of frame t is number 10 t + k.
#define WSTAC_FW_SAMPLE_NUMBERS 700

/// The number of bytes of the longest message.
#define WSTAC_FW_LINK_BYTES 314

/// The number of messages that carry a sample.
#define WSTAC_FW_SAMPLE_PARTS 7

/// The number of bytes of a link.
#define WSTAC_FW_LINK_SIZE 696

/// The number of bytes of a model.
#define WSTAC_FW_MODEL_SIZE 136

/// The number of bytes of a class's name, with the 0 behind it.
#define WSTAC_FW_LABEL_BYTES 64

/// Bytes of a pipeline.
#define WSTAC_FW_PIPELINE_SIZE 2528

/// The alignment of a pipeline in memory, in bytes.
#define WSTAC_FW_PIPELINE_ALIGN 8

/// The result of a call. Errors are below 0; then nothing has changed, and nothing was written.
enum WstacFwStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// Done.
  WSTAC_FW_STATUS_OK = 0,
  /// Done, and an event is complete. Ask for it before the next push.
  WSTAC_FW_STATUS_EVENT = 1,
  /// Done, but the requested value does not exist.
  WSTAC_FW_STATUS_NONE = 2,
  /// A pointer is null.
  WSTAC_FW_STATUS_NULL = -1,
  /// The memory is too small, or not aligned.
  WSTAC_FW_STATUS_MEMORY = -2,
  /// The pipeline or model has not been set up, or the call does not fit what it has done.
  WSTAC_FW_STATUS_STATE = -3,
  /// The format is not one of this library's.
  WSTAC_FW_STATUS_FORMAT = -4,
  /// Width or height is out of range.
  WSTAC_FW_STATUS_FRAME_SIZE = -5,
  /// A taxel holds no pixel.
  WSTAC_FW_STATUS_EMPTY_TAXEL = -6,
  /// A taxel reaches outside the frame.
  WSTAC_FW_STATUS_TAXEL_OUTSIDE = -7,
  /// Sums do not fit 32 bits, because taxels are too large.
  WSTAC_FW_STATUS_SUM_TOO_LARGE = -8,
  /// The stride is unknown.
  WSTAC_FW_STATUS_STRIDE = -9,
  /// Bytes per row are too few.
  WSTAC_FW_STATUS_BYTES_PER_ROW = -10,
  /// The frame rate is zero.
  WSTAC_FW_STATUS_FRAME_RATE = -11,
  /// A frame has too few bytes.
  WSTAC_FW_STATUS_FRAME_TOO_SHORT = -12,
  /// A stripe is not whole rows.
  WSTAC_FW_STATUS_STRIPE_NOT_WHOLE_ROWS = -13,
  /// A stripe has more rows than the frame has left.
  WSTAC_FW_STATUS_STRIPE_TOO_LONG = -14,
  /// A stripe has a planar format.
  WSTAC_FW_STATUS_STRIPE_OF_PLANAR = -15,
  /// A whole frame arrived while one is under way in stripes.
  WSTAC_FW_STATUS_FRAME_UNDER_WAY = -16,
  /// The window is out of range.
  WSTAC_FW_STATUS_WINDOW = -17,
  /// The backtrack is too long.
  WSTAC_FW_STATUS_BACKTRACK = -18,
  /// The multiplier is out of range.
  WSTAC_FW_STATUS_MULTIPLIER = -19,
  /// The margin is out of range.
  WSTAC_FW_STATUS_MARGIN = -20,
  /// The time constant of a tracking baseline is out of range.
  WSTAC_FW_STATUS_FOLLOW = -21,
  /// Floor levels are out of range.
  WSTAC_FW_STATUS_FLOOR_LEVELS = -22,
  /// The speed threshold is out of range.
  WSTAC_FW_STATUS_SPEED_THRESHOLD = -23,
  /// The fitted speeds are not a range.
  WSTAC_FW_STATUS_FITTED_RANGE = -24,
  /// A parameter of the speed law is out of range.
  WSTAC_FW_STATUS_SPEED_LAW = -25,
  /// The bytes are not a model file.
  WSTAC_FW_STATUS_MODEL_MAGIC = -26,
  /// The model file is of another version.
  WSTAC_FW_STATUS_MODEL_VERSION = -27,
  /// The model file is cut off, or has too many bytes.
  WSTAC_FW_STATUS_MODEL_LENGTH = -28,
  /// The model file is damaged.
  WSTAC_FW_STATUS_MODEL_CHECKSUM = -29,
  /// The model file's bytes are not aligned to four.
  WSTAC_FW_STATUS_MODEL_ALIGNMENT = -30,
  /// The model file has impossible content.
  WSTAC_FW_STATUS_MODEL_CONTENT = -31,
  /// The parameters have another fault.
  WSTAC_FW_STATUS_OTHER = -32,
  /// The distance between neighboring whiskers is out of range.
  WSTAC_FW_STATUS_PITCH = -33,
  /// A choice is neither 0 nor 1.
  WSTAC_FW_STATUS_CHOICE = -34,
  /// The model takes another sample than that over time.
  WSTAC_FW_STATUS_MODEL_INPUT = -35,
  /// A text is not UTF-8, or has no 0 at its end.
  WSTAC_FW_STATUS_TEXT = -36,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwStatus WstacFwStatus;
#else
typedef int32_t WstacFwStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// The task of a model: what it tells apart.
enum WstacFwTask
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// A task that is not stated.
  WSTAC_FW_TASK_OTHER = 0,
  /// Specimens: pattern and depth.
  WSTAC_FW_TASK_SPECIMEN = 1,
  /// Patterns.
  WSTAC_FW_TASK_PATTERN = 2,
  /// Depths in mm.
  WSTAC_FW_TASK_DEPTH = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwTask WstacFwTask;
#else
typedef int32_t WstacFwTask;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// The reason why an answer is missing or not reliable.
enum WstacFwWhy
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// The answer is there, and nothing is known against it.
  WSTAC_FW_WHY_THERE = 0,
  /// The baseline itself is above the speed threshold.
  WSTAC_FW_WHY_BASELINE_ABOVE = 1,
  /// No frame of the sample is above the speed threshold.
  WSTAC_FW_WHY_NEVER_LIT = 2,
  /// The sample starts or ends above the speed threshold, so the slide lasted longer.
  WSTAC_FW_WHY_CUT_OFF = 3,
  /// The speed law has no finite speed for this duration.
  WSTAC_FW_WHY_OUTSIDE_LAW = 4,
  /// Neither rows nor columns light up in order.
  WSTAC_FW_WHY_NO_ORDER = 5,
  /// Another reason, which this library has no number for.
  WSTAC_FW_WHY_OTHER = 6,
  /// Not reliable: too many frames of the touch were lost.
  WSTAC_FW_WHY_LOST_FRAMES = 7,
  /// Not reliable: the frames of the touch came unevenly, as the caller knows.
  WSTAC_FW_WHY_UNEVEN = 8,
  /// Not reliable: the baseline was not quiet, or frames of it were lost.
  WSTAC_FW_WHY_BASELINE = 9,
  /// Unclear: too few whiskers are lit.
  WSTAC_FW_WHY_FEW_WHISKERS = 10,
  /// Unclear: the sample ends during the touch.
  WSTAC_FW_WHY_NOT_OVER = 11,
  /// Unclear: the sample does not show all whiskers.
  WSTAC_FW_WHY_TOO_SLOW = 12,
  /// Unclear: too fast to tell a slide from a press.
  WSTAC_FW_WHY_TOO_FAST = 13,
  /// Unclear or not reliable: the whiskers do not light up alike.
  WSTAC_FW_WHY_NOT_ALIKE = 14,
  /// Not reliable: the speed seems to change during the touch.
  WSTAC_FW_WHY_SPEED_CHANGES = 15,
  /// Not reliable: the touch starts on the sensor, or does not cross all of it.
  WSTAC_FW_WHY_NOT_CROSSED = 16,
  /// Not reliable: a row or a column lights up too early or too late.
  WSTAC_FW_WHY_OUT_OF_LINE = 17,
  /// Not reliable: the standard deviation of the speed is too large.
  WSTAC_FW_WHY_UNCERTAIN = 18,
  /// Unclear or not reliable: it depends on the readout, which is not known.
  WSTAC_FW_WHY_READOUT_UNKNOWN = 19,
  /// Not reliable: what slides seems to turn.
  WSTAC_FW_WHY_TURNING = 20,
  /// Not reliable: two objects seem to touch the sensor, and their velocity is not certain.
  WSTAC_FW_WHY_TWO_OBJECTS = 21,
  /// Not reliable: the camera takes more frames than were agreed on, as the caller knows.
  WSTAC_FW_WHY_FASTER_CAMERA = 22,
  /// Unclear: a held part seems to have slipped during the touch.
  WSTAC_FW_WHY_SLIPS = 23,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwWhy WstacFwWhy;
#else
typedef int32_t WstacFwWhy;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// The kind of a touch.
enum WstacFwContact
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /// None of the others, or none for certain.
  WSTAC_FW_CONTACT_UNCLEAR = 0,
  /// Something slides: it arrives at one side and leaves at the other.
  WSTAC_FW_CONTACT_SLIDE = 1,
  /// Something is pressed on all whiskers at once, or leaves them at once.
  WSTAC_FW_CONTACT_PRESS = 2,
  /// One or two whiskers of a row and of a column are touched.
  WSTAC_FW_CONTACT_POKE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwContact WstacFwContact;
#else
typedef int32_t WstacFwContact;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/// A pixel format: one of the WSTAC_FW_ constants below. A program links the code of those that it names.
typedef struct WstacFwFormat WstacFwFormat;

/// A pipeline, in memory that the program provides: `static WstacFwPipeline pipeline;`.
///
/// wstac_fw_init sets it up. A copied or moved pipeline is another one in the same state. Nothing has to be freed.
typedef struct WstacFwPipeline {
  /// The library's own.
  uint64_t opaque[316];
} WstacFwPipeline;

/// A tactile event.
typedef struct WstacFwEvent {
  /// The number of the first frame of its sample. Feature frames are counted from 0.
  uint64_t frame;
  /// The number of the first lit frame of the touch; -1 if the trigger gives more than one event per touch.
  int64_t touch_frame;
  /// The number of the first dark frame behind the touch; -1 if the light has not left, or if the trigger gives more
  /// than one event per touch.
  int64_t end_frame;
  /// The number of frames of the sample that were lost, in whole or in part, and filled: 0 to 70.
  uint8_t frames_filled;
  /// Whether the event is reliable: the baseline was quiet and without a long gap, and at most a tenth of the sample
  /// was filled.
  bool reliable;
} WstacFwEvent;

/// The motion of a touch by arrival times, and its kind.
typedef struct WstacFwMotion {
  /// The kind of the touch: a WstacFwContact. Only a slide has a speed, a direction and a texture.
  int32_t contact;
  /// Whether speed and direction mostly hold within their deviations; for a press or a poke, whether the event is
  /// reliable. wstac_fw_link_event refuses any other byte than 0 and 1.
  WstacFwBool reliable;
  /// The speed in mm/s; 0 unless it slides.
  float mm_s;
  /// The standard deviation of the speed in mm/s; 0 unless it slides.
  float mm_s_sd;
  /// The direction in degrees, counterclockwise from +x: 0 to below 360; -1 unless it slides.
  float degrees;
  /// The standard deviation of the direction in degrees; 0 unless it slides.
  float degrees_sd;
  /// Why the touch is unclear, or why it is not reliable: a WstacFwWhy.
  int32_t why;
} WstacFwMotion;

/// A sliding speed by a law of durations.
typedef struct WstacFwSpeed {
  /// Whether there is one, or the reason why not: a WstacFwWhy.
  int32_t why;
  /// The speed in mm/s; 0 if there is none.
  float mm_s;
  /// The upper bound of the speed of a slide that is cut off, in mm/s, as far as the law is good there; 0 otherwise.
  float at_most_mm_s;
  /// The duration in frames from the first lit frame to the last: 0 to 69; -1 if no frame is lit.
  int16_t duration_frames;
  /// Whether the speed is outside the range that the law was fitted on. wstac_fw_link_event refuses any other byte
  /// than 0 and 1.
  WstacFwBool extrapolated;
} WstacFwSpeed;

/// A sliding direction by centroids.
typedef struct WstacFwDirection {
  /// Whether there is one, or the reason why not: a WstacFwWhy.
  int32_t why;
  /// The direction in degrees: 0, 90, 180 or 270, counterclockwise from +x; -1 if there is none.
  int16_t degrees;
  /// The confidence, 0 to 32768: 0 to 1 in units of 2^-15.
  uint16_t confidence;
} WstacFwDirection;

/// A sample that a long gap has interrupted.
typedef struct WstacFwIncomplete {
  /// The number of its first frame.
  uint64_t frame;
  /// The number of its frames that had arrived: 1 to 69.
  uint8_t frames;
} WstacFwIncomplete;

/// The end of the touch of an event: its light has left.
typedef struct WstacFwContactEnd {
  /// The number of the first dark frame behind the touch.
  uint64_t frame;
  /// The number of the first frame of the event's sample.
  uint64_t event_frame;
} WstacFwContactEnd;

/// The state of a stream, or how it ended.
typedef struct WstacFwEnd {
  /// The number of feature frames on the time line, lost ones included.
  uint64_t frames;
  /// The number of the first frame of the sample that is under way.
  uint64_t incomplete_frame;
  /// The number of its frames that have arrived: 1 to 69; 0 if none is under way.
  uint8_t incomplete_frames;
  /// Whether the baseline is complete.
  bool baseline_complete;
  /// Whether the baseline was quiet and without a long gap.
  bool baseline_quiet;
} WstacFwEnd;

/// A link to a host, in memory that the program provides: `static WstacFwLink link;`. A serial line needs one.
///
/// wstac_fw_link_init sets it up. It counts messages, events and lost frames, and keeps the last two events until the
/// host has them. Nothing has to be freed.
typedef struct WstacFwLink {
  /// Private to the library.
  uint64_t opaque[87];
} WstacFwLink;

/// A texture model, in memory that the program provides.
///
/// wstac_fw_model_init sets it up. It reads the file's bytes where they lie. Nothing has to be freed.
typedef struct WstacFwModel {
  /// Private to the library.
  uint64_t opaque[17];
} WstacFwModel;

/// The description of a board. Texts are UTF-8 with a 0 at the end; longer ones than stated are cut.
typedef struct WstacFwBoard {
  /// The name of the firmware, of at most 31 bytes.
  const char *firmware;
  /// The version of the firmware, of at most 31 bytes.
  const char *version;
  /// The revision of the firmware's source, of at most 15 bytes; null if it is not known.
  const char *revision;
  /// The pixel format: the one that the pipeline was set up with.
  const struct WstacFwFormat *format;
  /// The texture model; null without one.
  const struct WstacFwModel *model;
  /// The unique number of the chip in three words, its lowest word first; null if it has none.
  const uint32_t *id;
} WstacFwBoard;

/// The answer of a model for a sample.
typedef struct WstacFwTexture {
  /// The task of the model: what it tells apart.
  WstacFwTask task;
  /// The number of the class, from 0.
  uint8_t class_number;
  /// The name of the class in UTF-8, such as Saw3, with a 0 at its end.
  char label[WSTAC_FW_LABEL_BYTES];
  /// The probability that the class is right, in units of 2^-15; -1 for a model without a calibration.
  int32_t confidence;
  /// 1 if the sample is like those of the training, and 0 if it is not: then the class is probably wrong. -1 if the
  /// model does not tell.
  int8_t known;
} WstacFwTexture;

/// The answers of an event: a motion, or a speed and a direction as published. The others are null.
typedef struct WstacFwAnswers {
  /// The motion, from wstac_fw_motion or wstac_fw_motion_by_edges; null by the published law.
  const struct WstacFwMotion *motion;
  /// The speed, from wstac_fw_speed; null with a motion.
  const struct WstacFwSpeed *speed;
  /// The direction, from wstac_fw_direction; null with a motion.
  const struct WstacFwDirection *direction;
  /// The texture, from wstac_fw_classify; null without one. Only a slide has one.
  const struct WstacFwTexture *texture;
} WstacFwAnswers;

/// The requests of a host.
typedef struct WstacFwWanted {
  /// Whether the host has asked for wstac_fw_link_hello since the last call.
  bool hello;
  /// Whether it wants wstac_fw_link_features of every frame.
  bool features;
  /// Whether it wants wstac_fw_link_sample before every event.
  bool samples;
  /// Whether it acknowledges events. Then the link keeps them until it has.
  bool events_kept;
} WstacFwWanted;

/// The state of a board. -1 means that a number is not known.
typedef struct WstacFwTelemetry {
  /// The milliseconds since the start.
  uint64_t uptime_ms;
  /// The measured frame rate in frames per 1000 seconds.
  int64_t millihertz;
  /// The number of frames that were lost because pixels came faster than they were taken.
  int64_t overruns;
  /// The number of starts since power was on, without the first.
  int64_t restarts;
  /// The greatest depth of the stack in bytes.
  int64_t stack;
} WstacFwTelemetry;

/// A taxel's corner in a frame, in pixels.
typedef struct WstacFwCorner {
  /// The first column.
  uint16_t left;
  /// The first row.
  uint16_t top;
} WstacFwCorner;

/// The description of a camera's frames. Zeros in all fields except format, width and height are the defaults.
typedef struct WstacFwOptions {
  /// The pixel format, such as &WSTAC_FW_GREY.
  const struct WstacFwFormat *format;
  /// The number of pixels of a row, 1 to 16384.
  uint32_t width;
  /// The number of rows of a frame, 1 to 16384.
  uint32_t height;
  /// The number of bytes from row to row; 0 for rows without padding.
  uint32_t bytes_per_row;
  /// The numerator of the frames per second. If it and the denominator are 0, the rate is 30 per second. Above 45 per
  /// second, frames are added up to about 30.
  uint32_t fps_numerator;
  /// The denominator of the frames per second.
  uint32_t fps_denominator;
  /// The stride: one of so many pixels of a taxel is counted, in both directions. It is 1, 2, 3 or 5; 0 means 1.
  uint32_t stride;
  /// Whether Y Cb Cr are of ITU-R BT.709 instead of BT.601.
  WstacFwBool bt709;
  /// Whether Y Cb Cr are of full range instead of limited.
  WstacFwBool full_range;
  /// The width and height of every taxel in pixels. They count only with corners.
  uint16_t taxel[2];
  /// The corners of 25 taxels, row by row; null for the paper's layout in the centered largest square.
  const struct WstacFwCorner *corners;
  /// The distance between neighboring whiskers in mm: `[sensor] pitch_mm`, above 0 and at most 1000; 0 means 4.
  float pitch_mm;
  /// Whether `readout_ms` is known. Otherwise standard deviations cover a rolling shutter, and fast slides are not
  /// reliable.
  WstacFwBool readout_known;
  /// The time in ms from the first to the last row of the picture: 0 for a global shutter, below 0 if the last row
  /// comes first. Beyond 1000 it counts as unknown.
  float readout_ms;
} WstacFwOptions;

/// The parameters of the trigger: `[trigger]` of a configuration file.
typedef struct WstacFwTrigger {
  /// The number of frames of a window, m: 1 to 70.
  uint32_t window;
  /// The multiplier b: 0 (with the signed rule 1) to below 65536.
  double multiplier;
  /// The number of frames of a sample before the window that fired, c: at most 5 m, and 70 - m.
  uint32_t backtrack;
  /// Whether the paper's rule, b times the baseline, is used instead of the signed one.
  WstacFwBool literal;
  /// The least distance of the signed rule's threshold from the baseline, in units of a feature's natural logarithm
  /// per frame.
  double margin;
  /// The time constant of a tracking baseline, in windows: a power of two from 16 to 32768; 0 for a fixed baseline.
  uint32_t follow;
  /// Whether a touch is one event, however long it is, as with `law = "arrival"`. Otherwise it is another event after
  /// each 70 frames, as published.
  WstacFwBool one_event_per_touch;
} WstacFwTrigger;

/// The law from a duration D, in frames at 30 per second, to a speed v in mm/s: D = intercept - slope log10 v. It is
/// `[speed]` of a configuration file with `law = "published"`.
typedef struct WstacFwSpeedLaw {
  /// The intercept in frames.
  float intercept;
  /// The slope in frames per decade, above 0.
  float slope;
  /// The threshold: a frame is lit if a row or column is brighter than this fraction of full scale. It is above 0 and
  /// at most 5.
  double threshold;
  /// Whether the threshold is compared with the light above the baseline instead of all light.
  WstacFwBool above_baseline;
  /// The slowest speed that the law was fitted on, in mm/s.
  float slowest_mm_s;
  /// The fastest speed that the law was fitted on, in mm/s.
  float fastest_mm_s;
} WstacFwSpeedLaw;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/// 8 bits of gray.
extern const struct WstacFwFormat WSTAC_FW_GREY;

/// 10 bits of gray in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_Y10;

/// 12 bits of gray in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_Y12;

/// 16 bits of gray, little-endian.
extern const struct WstacFwFormat WSTAC_FW_Y16;

/// Three bytes, green in the middle: R G B and B G R.
extern const struct WstacFwFormat WSTAC_FW_RGB24;

/// Four bytes, green second: R G B X and B G R X.
extern const struct WstacFwFormat WSTAC_FW_RGBX32;

/// Four bytes, green third: X R G B and X B G R.
extern const struct WstacFwFormat WSTAC_FW_XRGB32;

/// RGB of 5, 6 and 5 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_RGB565;

/// Bayer mosaic of 8 bits whose even rows have green second: RGGB and BGGR.
extern const struct WstacFwFormat WSTAC_FW_RGGB8;

/// Bayer mosaic of 8 bits whose even rows have green first: GRBG and GBRG.
extern const struct WstacFwFormat WSTAC_FW_GRBG8;

/// Bayer mosaic of 10 bits in 16-bit little-endian words whose even rows have green second: RGGB and BGGR.
extern const struct WstacFwFormat WSTAC_FW_RGGB10;

/// Bayer mosaic of 10 bits in 16-bit little-endian words whose even rows have green first: GRBG and GBRG.
extern const struct WstacFwFormat WSTAC_FW_GRBG10;

/// Bayer mosaic of 12 bits in 16-bit little-endian words whose even rows have green second: RGGB and BGGR.
extern const struct WstacFwFormat WSTAC_FW_RGGB12;

/// Bayer mosaic of 12 bits in 16-bit little-endian words whose even rows have green first: GRBG and GBRG.
extern const struct WstacFwFormat WSTAC_FW_GRBG12;

/// Y Cb Y Cr, green exact to the pixel.
extern const struct WstacFwFormat WSTAC_FW_YUYV;

/// Y Cb Y Cr, green once per taxel, as with `[green] yuv = "linear"`. It takes fewer instructions.
extern const struct WstacFwFormat WSTAC_FW_YUYV_LINEAR;

/// Cb Y Cr Y, green exact to the pixel.
extern const struct WstacFwFormat WSTAC_FW_UYVY;

/// Cb Y Cr Y, green once per taxel, as with `[green] yuv = "linear"`. It takes fewer instructions.
extern const struct WstacFwFormat WSTAC_FW_UYVY_LINEAR;

/// A plane of Y, then rows of Cb Cr for every 2 x 2 pixels. Whole frames only.
extern const struct WstacFwFormat WSTAC_FW_NV12;

/// Planes of Y, of Cb and of Cr, the latter two for every 2 x 2 pixels. Whole frames only.
extern const struct WstacFwFormat WSTAC_FW_YU12;

/// Writes the ten features of the feature frame that the last call completed, as natural logarithms in units of 1/2048.
///
/// Returns WSTAC_FW_STATUS_NONE if the last call completed none. `frame`, which may be null, receives the frame's
/// number.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `features` is null or memory for 10 numbers; `frame` is null or memory
/// for one.
WstacFwStatus wstac_fw_features(const struct WstacFwPipeline *pipeline, int16_t *features, uint64_t *frame);

/// Writes the event that the last call completed.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `event` is null or memory for one.
WstacFwStatus wstac_fw_event(const struct WstacFwPipeline *pipeline, struct WstacFwEvent *event);

/// Copies the event's sample to 700 numbers: features in units of 1/2048, frame by frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `sample` is null or memory for 700 numbers.
WstacFwStatus wstac_fw_sample(const struct WstacFwPipeline *pipeline, int16_t *sample);

/// Writes the event's motion by the coherence of arrival times: the law of `estimator = "coherence"`.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `motion` is null or memory for one.
WstacFwStatus wstac_fw_motion(const struct WstacFwPipeline *pipeline, struct WstacFwMotion *motion);

/// Writes the event's motion by rising edges: the law of `estimator = "edges"`. It takes fewer instructions and less
/// stack than wstac_fw_motion, and is less accurate.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `motion` is null or memory for one.
WstacFwStatus wstac_fw_motion_by_edges(const struct WstacFwPipeline *pipeline, struct WstacFwMotion *motion);

/// Writes the event's sliding speed by a law of durations: the published one, or that of wstac_fw_set_speed_law. It
/// holds for specimens of one length only.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `speed` is null or memory for one.
WstacFwStatus wstac_fw_speed(const struct WstacFwPipeline *pipeline, struct WstacFwSpeed *speed);

/// Writes the event's sliding direction by centroids, as published: one of four.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for one.
WstacFwStatus wstac_fw_direction(const struct WstacFwPipeline *pipeline, struct WstacFwDirection *to);

/// Writes the sample that a long gap has interrupted, once.
///
/// Returns WSTAC_FW_STATUS_NONE if there is none. A gap is known to be long when the frame behind it arrives.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `incomplete` is null or memory for one.
WstacFwStatus wstac_fw_take_interrupted(struct WstacFwPipeline *pipeline, struct WstacFwIncomplete *incomplete);

/// Writes the end of the touch of an event, once.
///
/// Returns WSTAC_FW_STATUS_NONE if there is none. The end of a short touch is known with its event, that of a long one
/// later. Until then no other event starts. A trigger with more than one event per touch gives none.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `to` is null or memory for one.
WstacFwStatus wstac_fw_take_contact_end(struct WstacFwPipeline *pipeline, struct WstacFwContactEnd *to);

/// Writes the state of the stream; after wstac_fw_finish, how it ended.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `end` is null or memory for one.
WstacFwStatus wstac_fw_end(const struct WstacFwPipeline *pipeline, struct WstacFwEnd *end);

/// Sets a link up in `size` bytes of memory: sizeof(WstacFwLink).
///
/// # Safety
/// `link` is null or that memory.
WstacFwStatus wstac_fw_link_init(struct WstacFwLink *link, size_t size);

/// Writes the bytes of the message that describes the board: the first one after the start. Later ones do no harm.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory, and `board` is null or a board whose
/// pointers are as its comments say. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length` is null or
/// memory for a number.
WstacFwStatus wstac_fw_link_hello(struct WstacFwLink *link,
                                  const struct WstacFwPipeline *pipeline,
                                  const struct WstacFwBoard *board,
                                  uint8_t *bytes,
                                  size_t *length);

/// Writes the bytes of the message of the event that the last push completed, with its answers. Events are counted.
///
/// If the host acknowledges events, wstac_fw_link_due writes the message again until the host has it.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory, and `answers` is null or answers whose
/// pointers are null or what their comments say. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length`
/// is null or memory for a number.
WstacFwStatus wstac_fw_link_event(struct WstacFwLink *link,
                                  const struct WstacFwPipeline *pipeline,
                                  const struct WstacFwAnswers *answers,
                                  uint8_t *bytes,
                                  size_t *length);

/// Takes bytes that the host has sent, as they arrive: requests and acknowledgments. Writes what the host wants.
///
/// Damaged and unknown requests are ignored. A program that never calls it sends each event once.
///
/// # Safety
/// `link` is null or a link's memory, `bytes` is null or `length` bytes, and `wanted` is null or memory for it.
WstacFwStatus wstac_fw_link_receive(struct WstacFwLink *link,
                                    const uint8_t *bytes,
                                    size_t length,
                                    struct WstacFwWanted *wanted);

/// Writes the bytes of the message of an event that the host has not acknowledged in time.
///
/// Call it in every round of the program's loop, with the milliseconds of a clock, which may wrap.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if there is none. An event is sent again after 250 ms, for at most
/// 4 seconds.
///
/// # Safety
/// `link` is null or a link's memory. `bytes` is null or memory for WSTAC_FW_LINK_BYTES bytes, and `length` is null or
/// memory for a number.
WstacFwStatus wstac_fw_link_due(struct WstacFwLink *link, uint32_t now_ms, uint8_t *bytes, size_t *length);

/// Writes the bytes of the message of a part of the sample of the event that the last push completed.
///
/// All WSTAC_FW_SAMPLE_PARTS parts, from 0 on, come before the event.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if there is no such part.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_sample(struct WstacFwLink *link,
                                   const struct WstacFwPipeline *pipeline,
                                   uint32_t part,
                                   uint8_t *bytes,
                                   size_t *length);

/// Writes the bytes of the message of the features of the frame that the last call completed.
///
/// Returns WSTAC_FW_STATUS_NONE, and writes nothing, if the last call completed none.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_features(struct WstacFwLink *link,
                                     const struct WstacFwPipeline *pipeline,
                                     uint8_t *bytes,
                                     size_t *length);

/// Writes the bytes of the message that the touch of an event has ended, from wstac_fw_take_contact_end. It comes after
/// the event.
///
/// # Safety
/// `link` is null or a link's memory, `end` is null or an end. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_contact_end(struct WstacFwLink *link,
                                        const struct WstacFwContactEnd *end,
                                        uint8_t *bytes,
                                        size_t *length);

/// Writes the bytes of the message of a sample that a long gap has interrupted, from wstac_fw_take_interrupted.
///
/// # Safety
/// `link` is null or a link's memory, `sample` is null or a sample. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_interrupted(struct WstacFwLink *link,
                                        const struct WstacFwIncomplete *sample,
                                        uint8_t *bytes,
                                        size_t *length);

/// Writes the bytes of the message that camera frames were lost. Call it with every wstac_fw_push_lost.
///
/// # Safety
/// `link` is null or a link's memory, and no other code uses it meanwhile. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_lost(struct WstacFwLink *link, uint64_t frames, uint8_t *bytes, size_t *length);

/// Writes the bytes of the message of the stream's state. Send it about once per second, with and without frames: a
/// silent board is a lost board.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_status(struct WstacFwLink *link,
                                   const struct WstacFwPipeline *pipeline,
                                   uint8_t *bytes,
                                   size_t *length);

/// Writes the bytes of the message that the stream has ended, after wstac_fw_finish. It is the last one.
///
/// # Safety
/// `link` is null or a link's memory, `pipeline` is null or a pipeline's memory. `bytes` is null or memory for
/// WSTAC_FW_LINK_BYTES bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_end(struct WstacFwLink *link,
                                const struct WstacFwPipeline *pipeline,
                                uint8_t *bytes,
                                size_t *length);

/// Writes the bytes of the message of the board's own state.
///
/// # Safety
/// `link` is null or a link's memory, `telemetry` is null or a state. `bytes` is null or memory for WSTAC_FW_LINK_BYTES
/// bytes, and `length` is null or memory for a number.
WstacFwStatus wstac_fw_link_telemetry(struct WstacFwLink *link,
                                      const struct WstacFwTelemetry *telemetry,
                                      uint8_t *bytes,
                                      size_t *length);

/// Checks all of a model file's bytes and sets the model up in `size` bytes of memory: sizeof(WstacFwModel).
///
/// The bytes must be aligned to four. They are not copied: they must stay where and as they are as long as the model is
/// used, usually in flash. A model of another input than frames is refused: wstac_fw_sample has ten features over time.
///
/// # Safety
/// `model` is null or that memory; `bytes` is null or `length` bytes.
WstacFwStatus wstac_fw_model_init(struct WstacFwModel *model, size_t size, const uint8_t *bytes, size_t length);

/// Writes a model's answer for a sample of 700 numbers, as wstac_fw_sample provides it, of a touch that moves so.
///
/// The motion is that of wstac_fw_motion. If the model's file states the speeds of its training, it knows no texture at
/// another speed. Null is for a speed that is not known.
///
/// # Safety
/// `model` is null or a model's memory, `sample` is null or 700 numbers, `motion` is null or a motion, and `to` is null
/// or memory for a texture.
WstacFwStatus wstac_fw_classify(const struct WstacFwModel *model,
                                const int16_t *sample,
                                const struct WstacFwMotion *motion,
                                struct WstacFwTexture *to);

/// Sets up a pipeline with the default trigger and laws, in `size` bytes of memory: sizeof(WstacFwPipeline).
///
/// The memory may have been in use before. The baseline is the first 25 feature frames, during which nothing may touch
/// the sensor.
///
/// # Safety
/// `pipeline` is null or that memory; `options` is null or options. Their format is null or one of the WSTAC_FW_
/// constants, and their corners are null or 25.
WstacFwStatus wstac_fw_init(struct WstacFwPipeline *pipeline, size_t size, const struct WstacFwOptions *options);

/// Takes a whole frame. Returns WSTAC_FW_STATUS_EVENT if it completes an event.
///
/// A frame that is refused has not been taken: wstac_fw_push_lost keeps its place in time.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `frame` is null or `length` bytes.
WstacFwStatus wstac_fw_push_frame(struct WstacFwPipeline *pipeline, const uint8_t *frame, size_t length);

/// Takes the next rows of a frame, as a DMA delivers them. Returns WSTAC_FW_STATUS_EVENT if they complete an event.
///
/// The event is bit-identical to that of the whole frame. A stripe that is refused has not been taken.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `rows` is null or `length` bytes.
WstacFwStatus wstac_fw_push_stripe(struct WstacFwPipeline *pipeline, const uint8_t *rows, size_t length);

/// Forgets the rows of a frame whose rest will not arrive, and counts it as lost.
///
/// It counts one frame, whether or not any of its rows had arrived.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_abandon_frame(struct WstacFwPipeline *pipeline);

/// Keeps the place of lost camera frames in time.
///
/// A short gap is filled. A gap of more than 7 feature frames ends what was under way. A frame that is under way in
/// stripes stays so.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_push_lost(struct WstacFwPipeline *pipeline, uint64_t frames);

/// Ends the stream. Returns WSTAC_FW_STATUS_EVENT if frames that were lost at its very end complete an event.
///
/// Nothing can be pushed after it until wstac_fw_init.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_finish(struct WstacFwPipeline *pipeline);

/// Writes the default trigger, so that a program can change parts of it.
///
/// # Safety
/// `trigger` is null or memory for it.
WstacFwStatus wstac_fw_trigger_defaults(struct WstacFwTrigger *trigger);

/// Sets the trigger of a pipeline that has not had a frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `trigger` is null or a trigger.
WstacFwStatus wstac_fw_set_trigger(struct WstacFwPipeline *pipeline, const struct WstacFwTrigger *trigger);

/// Writes the published law of durations, so that a program can change parts of it.
///
/// # Safety
/// `law` is null or memory for it.
WstacFwStatus wstac_fw_speed_law_defaults(struct WstacFwSpeedLaw *law);

/// Sets the law of durations, which wstac_fw_speed answers by, of a pipeline that has not had a frame.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory; `law` is null or a law.
WstacFwStatus wstac_fw_set_speed_law(struct WstacFwPipeline *pipeline, const struct WstacFwSpeedLaw *law);

/// Sets the darkness floor of a pipeline that has not had a frame.
///
/// It is in gray levels of a taxel, 0 to full scale; 0.5 if it is not set.
///
/// # Safety
/// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_set_floor(struct WstacFwPipeline *pipeline, double levels);

/// Returns the text of a status, in English, with a 0 at its end. The text stays valid. It says so if a number is not a
/// status.
const char *wstac_fw_status_text(int32_t status);

/// Returns the version of the library that is linked, as WSTAC_FW_VERSION has that of the header.
uint32_t wstac_fw_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* WSTAC_FW_H */
