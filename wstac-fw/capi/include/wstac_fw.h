/*
 * WSTac for firmware: frames or stripes of a camera in, tactile events out, in memory that the program gives.
 *
 * The library is libwstac_fw.a; docs/C.md says how to build and to use it. The header for hosts is wstac.h.
 * Made of wstac-fw/capi/src by cbindgen: change it there.
 */

#ifndef WSTAC_FW_H
#define WSTAC_FW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Features of a frame: five rows, then five columns.
#define WSTAC_FW_FEATURES 10

// Frames of a sample.
#define WSTAC_FW_SAMPLE_FRAMES 70

// Numbers of a sample, frame by frame: feature k of frame t is number 10 t + k.
#define WSTAC_FW_SAMPLE_NUMBERS 700

// Bytes of a model.
#define WSTAC_FW_MODEL_SIZE 112

// Bytes of a class's name, with the 0 behind it.
#define WSTAC_FW_LABEL_BYTES 64

// Bytes of a pipeline.
#define WSTAC_PIPELINE_SIZE 2384

// What a pipeline's address is a multiple of.
#define WSTAC_PIPELINE_ALIGN 8

// What a call comes back with. Errors are below 0: nothing has changed then, and nothing was written.
enum WstacFwStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  WSTAC_FW_STATUS_OK = 0,
  // Done, and an event is complete: ask for it before the next push.
  WSTAC_FW_STATUS_EVENT = 1,
  // Done, and there is nothing to give.
  WSTAC_FW_STATUS_NONE = 2,
  // A pointer is null.
  WSTAC_FW_STATUS_NULL = -1,
  // The memory is too small, or not aligned.
  WSTAC_FW_STATUS_MEMORY = -2,
  // The pipeline or model has not been set up, or the call does not fit what it has done.
  WSTAC_FW_STATUS_STATE = -3,
  // The format is none of this library's.
  WSTAC_FW_STATUS_FORMAT = -4,
  // Width or height is out of range.
  WSTAC_FW_STATUS_FRAME_SIZE = -5,
  // A taxel holds no pixel.
  WSTAC_FW_STATUS_EMPTY_TAXEL = -6,
  // A taxel reaches outside the frame.
  WSTAC_FW_STATUS_TAXEL_OUTSIDE = -7,
  // Sums do not fit 32 bits: taxels are too large.
  WSTAC_FW_STATUS_SUM_TOO_LARGE = -8,
  // The stride is unknown.
  WSTAC_FW_STATUS_STRIDE = -9,
  // Bytes per row are too few.
  WSTAC_FW_STATUS_BYTES_PER_ROW = -10,
  // The frame rate is zero.
  WSTAC_FW_STATUS_FRAME_RATE = -11,
  // A frame has too few bytes.
  WSTAC_FW_STATUS_FRAME_TOO_SHORT = -12,
  // A stripe is not whole rows.
  WSTAC_FW_STATUS_STRIPE_NOT_WHOLE_ROWS = -13,
  // A stripe has more rows than the frame has left.
  WSTAC_FW_STATUS_STRIPE_TOO_LONG = -14,
  // A stripe of a planar format.
  WSTAC_FW_STATUS_STRIPE_OF_PLANAR = -15,
  // A whole frame while one is under way in stripes.
  WSTAC_FW_STATUS_FRAME_UNDER_WAY = -16,
  // The window is out of range.
  WSTAC_FW_STATUS_WINDOW = -17,
  // The backtrack is too long.
  WSTAC_FW_STATUS_BACKTRACK = -18,
  // The multiplier is out of range.
  WSTAC_FW_STATUS_MULTIPLIER = -19,
  // The margin is out of range.
  WSTAC_FW_STATUS_MARGIN = -20,
  // The time constant of a baseline that follows is out of range.
  WSTAC_FW_STATUS_FOLLOW = -21,
  // Floor levels are out of range.
  WSTAC_FW_STATUS_FLOOR_LEVELS = -22,
  // The speed threshold is out of range.
  WSTAC_FW_STATUS_SPEED_THRESHOLD = -23,
  // The range of speeds is none.
  WSTAC_FW_STATUS_FITTED_RANGE = -24,
  // A parameter of the speed law is out of range.
  WSTAC_FW_STATUS_SPEED_LAW = -25,
  // The bytes are no model file.
  WSTAC_FW_STATUS_MODEL_MAGIC = -26,
  // The model file is of another version.
  WSTAC_FW_STATUS_MODEL_VERSION = -27,
  // The model file is cut off, or has bytes too many.
  WSTAC_FW_STATUS_MODEL_LENGTH = -28,
  // The model file is damaged.
  WSTAC_FW_STATUS_MODEL_CHECKSUM = -29,
  // The model file's bytes are not aligned to four.
  WSTAC_FW_STATUS_MODEL_ALIGNMENT = -30,
  // The model file says something impossible.
  WSTAC_FW_STATUS_MODEL_CONTENT = -31,
  // Something else is wrong with the parameters.
  WSTAC_FW_STATUS_OTHER = -32,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwStatus WstacFwStatus;
#else
typedef int32_t WstacFwStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why an answer is missing.
enum WstacFwWhy
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It is there.
  WSTAC_FW_WHY_THERE = 0,
  // The baseline itself is above the speed threshold.
  WSTAC_FW_WHY_BASELINE_ABOVE = 1,
  // No frame of the sample is above the speed threshold.
  WSTAC_FW_WHY_NEVER_LIT = 2,
  // The sample starts or ends above the speed threshold: the slide lasted longer.
  WSTAC_FW_WHY_CUT_OFF = 3,
  // The speed law has no finite speed for this duration.
  WSTAC_FW_WHY_OUTSIDE_LAW = 4,
  // Neither rows nor columns light up in order.
  WSTAC_FW_WHY_NO_ORDER = 5,
  // Another reason, which this library has no number for.
  WSTAC_FW_WHY_OTHER = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwWhy WstacFwWhy;
#else
typedef int32_t WstacFwWhy;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a model tells apart.
enum WstacFwTask
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Unstated.
  WSTAC_FW_TASK_OTHER = 0,
  // Specimens: pattern and depth.
  WSTAC_FW_TASK_SPECIMEN = 1,
  // Patterns.
  WSTAC_FW_TASK_PATTERN = 2,
  // Depths in mm.
  WSTAC_FW_TASK_DEPTH = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum WstacFwTask WstacFwTask;
#else
typedef int32_t WstacFwTask;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A pixel format: one of the WSTAC_FW_ constants below. A program links the code of those that it names.
typedef struct WstacFwFormat WstacFwFormat;

// A pipeline, in memory that the program gives: `static WstacFwPipeline pipeline;`. Set up by wstac_fw_init; copied or moved it is another
// pipeline in the same state. Nothing has to be freed.
typedef struct WstacFwPipeline {
  // The library's own.
  uint64_t opaque[298];
} WstacFwPipeline;

// A tactile event.
typedef struct WstacFwEvent {
  // Number of the first frame of its sample: feature frames are counted from 0.
  uint64_t frame;
  // Frames of the sample that were lost, in whole or in part, and filled: 0 to 70.
  uint8_t frames_filled;
  // The baseline was quiet and without a long gap, and at most a tenth of the sample was filled.
  bool reliable;
} WstacFwEvent;

// A sliding speed.
typedef struct WstacFwSpeed {
  // Whether there is one, or why not.
  WstacFwWhy why;
  // mm/s; 0 where there is none.
  float mm_s;
  // Of a slide that is cut off: it was at most this fast, in mm/s, as far as the law is good there; 0 otherwise.
  float at_most_mm_s;
  // Lit frames, last less first: 0 to 69; -1 where no frame is lit.
  int16_t duration_frames;
  // The speed is outside the range that the law was fitted on.
  bool extrapolated;
} WstacFwSpeed;

// A sliding direction.
typedef struct WstacFwDirection {
  // Whether there is one, or why not.
  WstacFwWhy why;
  // 0, 90, 180 or 270, counter-clockwise from +x; -1 where there is none.
  int16_t degrees;
  // 0 to 32768: 0 to 1 in units of 2^-15.
  uint16_t confidence;
} WstacFwDirection;

// A sample that a long gap has interrupted.
typedef struct WstacFwIncomplete {
  // Number of its first frame.
  uint64_t frame;
  // Frames of it that had arrived: 1 to 69.
  uint8_t frames;
} WstacFwIncomplete;

// How a stream stands, or has ended.
typedef struct WstacFwEnd {
  // Feature frames on the time line, lost ones included.
  uint64_t frames;
  // Number of the first frame of the sample that is under way.
  uint64_t incomplete_frame;
  // Frames of it that have arrived: 1 to 69; 0 where none is under way.
  uint8_t incomplete_frames;
  // The baseline is complete.
  bool baseline_complete;
  // It was quiet, and without a long gap.
  bool baseline_quiet;
} WstacFwEnd;

// A texture model, in memory that the program gives. Set up by wstac_fw_model_init; it reads the file's bytes where they lie. Nothing has to
// be freed.
typedef struct WstacFwModel {
  // The library's own.
  uint64_t opaque[14];
} WstacFwModel;

// What a model says of a sample.
typedef struct WstacFwTexture {
  // What the model tells apart.
  WstacFwTask task;
  // Number of the class, from 0.
  uint8_t class_number;
  // Its name in UTF-8, such as Saw3, that ends in 0.
  char label[WSTAC_FW_LABEL_BYTES];
} WstacFwTexture;

// A taxel's corner in a frame, in pixels.
typedef struct WstacFwCorner {
  // Its first column.
  uint16_t left;
  // Its first row.
  uint16_t top;
} WstacFwCorner;

// A camera's frames. All zeros but format, width and height are the defaults.
typedef struct WstacFwOptions {
  // Pixel format, such as &WSTAC_FW_GREY.
  const struct WstacFwFormat *format;
  // Pixels of a row, 1 to 16384.
  uint32_t width;
  // Rows of a frame, 1 to 16384.
  uint32_t height;
  // Bytes from row to row; 0 for rows without padding.
  uint32_t bytes_per_row;
  // Frames a second, numerator; with a denominator of 0, too, 30 a second. Above 45 a second frames are added up to about 30.
  uint32_t fps_numerator;
  // Frames a second, denominator.
  uint32_t fps_denominator;
  // Every such pixel of a taxel, either way, is counted: 1, 2, 3 or 5; 0 is 1.
  uint32_t stride;
  // Y Cb Cr are of ITU-R BT.709 instead of BT.601.
  bool bt709;
  // Y Cb Cr are of full range instead of limited.
  bool full_range;
  // Width and height of every taxel in pixels; with corners only.
  uint16_t taxel[2];
  // Corners of 25 taxels, row by row; null for the paper's layout in the centred largest square.
  const struct WstacFwCorner *corners;
} WstacFwOptions;

// When an event starts: `[trigger]` of a configuration file.
typedef struct WstacFwTrigger {
  // Frames of a window, m: 1 to 70.
  uint32_t window;
  // Multiplier b: 0 (with the signed rule 1) to below 65536.
  double multiplier;
  // Frames of a sample before the window that fired, c: at most 5 m, and 70 - m.
  uint32_t backtrack;
  // The paper's rule, b times the baseline, instead of the signed one.
  bool literal;
  // Least distance of the signed rule's threshold from the baseline, in units of a feature's natural logarithm a frame.
  double margin;
  // Time constant of a baseline that follows drift, in windows: a power of two from 16 to 32768; 0 for one that is kept.
  uint32_t follow;
} WstacFwTrigger;

// The law that makes a speed of a duration: `[speed]` of a configuration file.
typedef struct WstacFwSpeedLaw {
  // D = 30 track / v + afterglow instead of D = intercept - slope log10 v, in frames at 30 a second.
  bool physical;
  // Intercept in frames; with `physical` the track in mm.
  float intercept_or_track;
  // Slope in frames a decade; with `physical` the afterglow in frames.
  float slope_or_afterglow;
  // A frame is lit where a row or column is brighter than this share of full scale: above 0, at most 5.
  double threshold;
  // The threshold is compared with the light above the baseline instead of all light.
  bool above_baseline;
  // Slowest speed that the law was fitted on, in mm/s.
  float slowest_mm_s;
  // Fastest speed that the law was fitted on, in mm/s.
  float fastest_mm_s;
} WstacFwSpeedLaw;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// 8 bits of gray.
extern const struct WstacFwFormat WSTAC_FW_GREY;

// 10 bits of gray in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_Y10;

// 12 bits of gray in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_Y12;

// 16 bits of gray, little-endian.
extern const struct WstacFwFormat WSTAC_FW_Y16;

// Three bytes, green in the middle: R G B and B G R.
extern const struct WstacFwFormat WSTAC_FW_RGB24;

// Four bytes, green second: R G B X and B G R X.
extern const struct WstacFwFormat WSTAC_FW_RGBX32;

// Four bytes, green third: X R G B and X B G R.
extern const struct WstacFwFormat WSTAC_FW_XRGB32;

// 5, 6 and 5 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_RGB565;

// Bayer mosaic of 8 bits whose even rows have green second: RGGB and BGGR.
extern const struct WstacFwFormat WSTAC_FW_RGGB8;

// Bayer mosaic of 8 bits whose even rows have green first: GRBG and GBRG.
extern const struct WstacFwFormat WSTAC_FW_GRBG8;

// The same as WSTAC_FW_RGGB8 of 10 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_RGGB10;

// The same as WSTAC_FW_GRBG8 of 10 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_GRBG10;

// The same as WSTAC_FW_RGGB8 of 12 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_RGGB12;

// The same as WSTAC_FW_GRBG8 of 12 bits in 16-bit little-endian words.
extern const struct WstacFwFormat WSTAC_FW_GRBG12;

// Y Cb Y Cr, green exact to the pixel.
extern const struct WstacFwFormat WSTAC_FW_YUYV;

// Y Cb Y Cr, green once a taxel: fewer instructions, as `[green] yuv = "linear"` has it.
extern const struct WstacFwFormat WSTAC_FW_YUYV_LINEAR;

// Cb Y Cr Y, green exact to the pixel.
extern const struct WstacFwFormat WSTAC_FW_UYVY;

// Cb Y Cr Y, green once a taxel: fewer instructions, as `[green] yuv = "linear"` has it.
extern const struct WstacFwFormat WSTAC_FW_UYVY_LINEAR;

// A plane of Y, then rows of Cb Cr for every 2 x 2 pixels. Whole frames only.
extern const struct WstacFwFormat WSTAC_FW_NV12;

// Planes of Y, of Cb and of Cr, these for every 2 x 2 pixels. Whole frames only.
extern const struct WstacFwFormat WSTAC_FW_YU12;

// The ten features of the feature frame that the last call completed: natural logarithms in units of 1/2048. WSTAC_FW_STATUS_NONE where it
// completed none. `frame`, which may be null, gets the frame's number.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `features` is null or memory for 10 numbers; `frame` is null or memory for one.
WstacFwStatus wstac_fw_features(const struct WstacFwPipeline *pipeline,
                                int16_t *features,
                                uint64_t *frame);

// The event that the last call completed.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `event` is null or memory for one.
WstacFwStatus wstac_fw_event(const struct WstacFwPipeline *pipeline, struct WstacFwEvent *event);

// Copies the event's sample to 700 numbers: features in units of 1/2048, frame by frame.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `sample` is null or memory for 700 numbers.
WstacFwStatus wstac_fw_sample(const struct WstacFwPipeline *pipeline, int16_t *sample);

// The event's sliding speed.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `speed` is null or memory for one.
WstacFwStatus wstac_fw_speed(const struct WstacFwPipeline *pipeline, struct WstacFwSpeed *speed);

// The event's sliding direction.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `to` is null or memory for one.
WstacFwStatus wstac_fw_direction(const struct WstacFwPipeline *pipeline, struct WstacFwDirection *to);

// The sample that a long gap has interrupted, once: WSTAC_FW_STATUS_NONE where there is none. A gap is known to be long by the frame behind it.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `incomplete` is null or memory for one.
WstacFwStatus wstac_fw_take_interrupted(struct WstacFwPipeline *pipeline,
                                        struct WstacFwIncomplete *incomplete);

// How the stream stands; after wstac_fw_finish, how it ended.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `end` is null or memory for one.
WstacFwStatus wstac_fw_end(const struct WstacFwPipeline *pipeline, struct WstacFwEnd *end);

// Checks all of a model file's bytes, which are aligned to four, and sets the model up in `size` bytes of memory: sizeof(WstacFwModel). The
// bytes are not copied: they stay where and as they are as long as the model is used, in flash as a rule.
//
// # Safety
// `model` is null or that memory; `bytes` is null or `length` bytes.
WstacFwStatus wstac_fw_model_init(struct WstacFwModel *model,
                                  size_t size,
                                  const uint8_t *bytes,
                                  size_t length);

// What a model says of a sample, as wstac_fw_sample gives it: 700 numbers.
//
// # Safety
// `model` is null or a model's memory, `sample` null or 700 numbers, `to` null or memory for a texture.
WstacFwStatus wstac_fw_classify(const struct WstacFwModel *model, const int16_t *sample, struct WstacFwTexture *to);

// Sets a pipeline up, with the default trigger and speed law, in `size` bytes of memory: sizeof(WstacFwPipeline). It may have been in use
// before. The baseline is the first 25 feature frames: nothing may touch the sensor then.
//
// # Safety
// `pipeline` is null or that memory; `options` is null or options, whose format is null or one of the WSTAC_FW_ constants, and whose corners
// are null or 25.
WstacFwStatus wstac_fw_init(struct WstacFwPipeline *pipeline,
                            size_t size,
                            const struct WstacFwOptions *options);

// Takes a whole frame. WSTAC_FW_STATUS_EVENT if it completes an event. A frame that is refused has not been taken: wstac_fw_push_lost keeps
// its place in time.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `frame` is null or `length` bytes.
WstacFwStatus wstac_fw_push_frame(struct WstacFwPipeline *pipeline,
                                  const uint8_t *frame,
                                  size_t length);

// Takes the next rows of a frame, as a DMA delivers them. WSTAC_FW_STATUS_EVENT if they complete an event, which is that of the whole frame
// bit for bit. A stripe that is refused has not been taken.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `rows` is null or `length` bytes.
WstacFwStatus wstac_fw_push_stripe(struct WstacFwPipeline *pipeline,
                                   const uint8_t *rows,
                                   size_t length);

// Forgets the rows of a frame whose rest will not arrive, and counts it as lost: one frame, whether or not any of its rows had arrived.
//
// # Safety
// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_abandon_frame(struct WstacFwPipeline *pipeline);

// Keeps the place of lost camera frames in time: a short gap is filled, one of more than 7 feature frames ends what was under way. A frame
// that is under way in stripes stays so.
//
// # Safety
// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_push_lost(struct WstacFwPipeline *pipeline,
                                 uint64_t frames);

// Ends the stream. WSTAC_FW_STATUS_EVENT if frames that were lost at its very end complete an event. Nothing can be pushed after it until
// wstac_fw_init.
//
// # Safety
// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_finish(struct WstacFwPipeline *pipeline);

// The default trigger, to change some of it.
//
// # Safety
// `trigger` is null or memory for it.
WstacFwStatus wstac_fw_trigger_defaults(struct WstacFwTrigger *trigger);

// Sets the trigger of a pipeline that has not had a frame.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `trigger` is null or a trigger.
WstacFwStatus wstac_fw_set_trigger(struct WstacFwPipeline *pipeline, const struct WstacFwTrigger *trigger);

// The default speed law, the paper's, or with `physical` the physical one, to change some of it.
//
// # Safety
// `law` is null or memory for it.
WstacFwStatus wstac_fw_speed_law_defaults(struct WstacFwSpeedLaw *law, bool physical);

// Sets the speed law of a pipeline that has not had a frame.
//
// # Safety
// `pipeline` is null or a pipeline's memory; `law` is null or a law.
WstacFwStatus wstac_fw_set_speed_law(struct WstacFwPipeline *pipeline, const struct WstacFwSpeedLaw *law);

// Sets the darkness floor of a pipeline that has not had a frame: gray levels of a taxel, 0 to full scale; 0.5 where it is not set.
//
// # Safety
// `pipeline` is null or a pipeline's memory.
WstacFwStatus wstac_fw_set_floor(struct WstacFwPipeline *pipeline,
                                 double levels);

// A status in words: text in English that ends in 0 and stays. Of a number that is no status it says so.
const char *wstac_fw_status_text(int32_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* WSTAC_FW_H */
