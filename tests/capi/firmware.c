/*
 * Tests the firmware library at its edges, then prints every number that it computes for a stream.
 *
 *     firmware FORMAT FRAMES WIDTH HEIGHT MODEL.wsm STRIPE_ROWS FRAME_BYTES
 *
 * Frames are pushed in stripes of STRIPE_ROWS rows, or as a whole if it is 0. Prints a line of ten features per frame. For an event, prints
 * its frame, speed and direction by either law, texture and 700 numbers.
 */
#include <math.h>
#include <stdint.h>

#include "expect.h"
#include "wstac_fw.h"

static const struct {
    const char *name;
    const WstacFwFormat *format;
} formats[] = {
    {"GREY", &WSTAC_FW_GREY}, {"Y10", &WSTAC_FW_Y10}, {"Y12", &WSTAC_FW_Y12}, {"Y16", &WSTAC_FW_Y16},
    {"RGB3", &WSTAC_FW_RGB24}, {"BGR3", &WSTAC_FW_RGB24}, {"XB24", &WSTAC_FW_RGBX32}, {"RX24", &WSTAC_FW_XRGB32},
    {"RGBP", &WSTAC_FW_RGB565}, {"RGGB", &WSTAC_FW_RGGB8}, {"GRBG", &WSTAC_FW_GRBG8}, {"RG10", &WSTAC_FW_RGGB10},
    {"BA10", &WSTAC_FW_GRBG10}, {"RG12", &WSTAC_FW_RGGB12}, {"BA12", &WSTAC_FW_GRBG12}, {"YUYV", &WSTAC_FW_YUYV},
    {"YUYV-linear", &WSTAC_FW_YUYV_LINEAR}, {"UYVY", &WSTAC_FW_UYVY}, {"UYVY-linear", &WSTAC_FW_UYVY_LINEAR},
    {"NV12", &WSTAC_FW_NV12}, {"YU12", &WSTAC_FW_YU12},
};

static WstacFwPipeline pipeline;
static WstacFwModel model;
static uint32_t model_words[24 * 1024];
static uint8_t frame[512 * 1024];
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];

static const WstacFwOptions tiny = {.format = &WSTAC_FW_GREY, .width = 10, .height = 10, .readout_known = 1};
static uint8_t dark[100], bright[100];

static WstacFwStatus init(const WstacFwOptions *options)
{
    return wstac_fw_init(&pipeline, sizeof pipeline, options);
}

static void memory_is_checked(void)
{
    /* Memory that is larger than both, at an address with wrong alignment for both. */
    static uint64_t memory[WSTAC_FW_PIPELINE_SIZE / 8 + 1];
    WstacFwPipeline *odd = (WstacFwPipeline *)(void *)((char *)memory + 4);
    WstacFwEvent event;
    WstacFwSpeed speed;
    WstacFwDirection direction;
    WstacFwMotion motion;
    WstacFwContactEnd contact_end;
    WstacFwEnd end;
    WstacFwIncomplete incomplete;
    WstacFwTexture texture;
    int16_t features[WSTAC_FW_FEATURES];
    EXPECT(wstac_fw_init(NULL, sizeof pipeline, &tiny) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_init(&pipeline, sizeof pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_init(&pipeline, sizeof pipeline - 1, &tiny) == WSTAC_FW_STATUS_MEMORY);
    EXPECT(wstac_fw_init(odd, sizeof pipeline, &tiny) == WSTAC_FW_STATUS_MEMORY);
    EXPECT(wstac_fw_model_init(NULL, sizeof model, frame, 4) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_model_init(&model, sizeof model, NULL, 4) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_model_init(&model, sizeof model - 1, frame, 4) == WSTAC_FW_STATUS_MEMORY);
    /* Calls before wstac_fw_init. */
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_push_lost(&pipeline, 1) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_abandon_frame(&pipeline) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_finish(&pipeline) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_features(&pipeline, features, NULL) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_end(&pipeline, &end) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_classify(&model, sample, NULL, &texture) == WSTAC_FW_STATUS_STATE);
    /* Null instead of memory. */
    EXPECT(wstac_fw_push_frame(NULL, dark, sizeof dark) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_push_stripe(NULL, dark, sizeof dark) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_push_lost(NULL, 1) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_abandon_frame(NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_finish(NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_take_interrupted(NULL, &incomplete) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_take_contact_end(NULL, &contact_end) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_classify(NULL, sample, NULL, &texture) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_trigger_defaults(NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_speed_law_defaults(NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_set_trigger(NULL, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_set_speed_law(NULL, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_set_floor(NULL, 0.5) == WSTAC_FW_STATUS_NULL);
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_push_frame(&pipeline, NULL, 100) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_push_stripe(&pipeline, NULL, 100) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, SIZE_MAX) == WSTAC_FW_STATUS_MEMORY);
    EXPECT(wstac_fw_set_trigger(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_set_speed_law(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_features(&pipeline, NULL, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_event(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_sample(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_speed(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_direction(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_end(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_take_interrupted(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_take_contact_end(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_motion(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_motion_by_edges(&pipeline, NULL) == WSTAC_FW_STATUS_NULL);
    /* There is no event yet, and there are no features. */
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_speed(&pipeline, &speed) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_direction(&pipeline, &direction) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_motion(&pipeline, &motion) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_motion_by_edges(&pipeline, &motion) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_sample(&pipeline, sample) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_features(&pipeline, features, NULL) == WSTAC_FW_STATUS_NONE);
}

static void options_are_checked(void)
{
    static const WstacFwCorner corners[25];
    WstacFwOptions options = tiny;
    options.format = NULL;
    EXPECT(init(&options) == WSTAC_FW_STATUS_NULL);
    options.format = (const WstacFwFormat *)(const void *)model_words;
    EXPECT(init(&options) == WSTAC_FW_STATUS_FORMAT);
    options = tiny, options.width = 0;
    EXPECT(init(&options) == WSTAC_FW_STATUS_FRAME_SIZE);
    options = tiny, options.height = 16385;
    EXPECT(init(&options) == WSTAC_FW_STATUS_FRAME_SIZE);
    options = tiny, options.width = 3;
    EXPECT(init(&options) == WSTAC_FW_STATUS_EMPTY_TAXEL);
    options = tiny, options.corners = corners;
    EXPECT(init(&options) == WSTAC_FW_STATUS_EMPTY_TAXEL);
    options.taxel[0] = options.taxel[1] = 11;
    EXPECT(init(&options) == WSTAC_FW_STATUS_TAXEL_OUTSIDE);
    options.taxel[0] = options.taxel[1] = 10;
    EXPECT(init(&options) == WSTAC_FW_STATUS_OK);
    options = tiny, options.format = &WSTAC_FW_Y16, options.width = options.height = 4000;
    EXPECT(init(&options) == WSTAC_FW_STATUS_SUM_TOO_LARGE);
    options = tiny, options.stride = 4;
    EXPECT(init(&options) == WSTAC_FW_STATUS_STRIDE);
    options = tiny, options.bytes_per_row = 9;
    EXPECT(init(&options) == WSTAC_FW_STATUS_BYTES_PER_ROW);
    options = tiny, options.fps_numerator = 30;
    EXPECT(init(&options) == WSTAC_FW_STATUS_FRAME_RATE);
    static const float wrong_pitches[] = {-1, 1001, NAN, INFINITY};
    for (size_t i = 0; i < sizeof wrong_pitches / sizeof *wrong_pitches; i++) {
        options = tiny, options.pitch_mm = wrong_pitches[i];
        EXPECT(init(&options) == WSTAC_FW_STATUS_PITCH);
    }
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++) {
        options = tiny, options.width = options.height = 40;
        options.format = formats[i].format, options.bt709 = options.full_range = true;
        EXPECT(init(&options) == WSTAC_FW_STATUS_OK);
    }
}

static void settings_are_checked(void)
{
    WstacFwTrigger trigger;
    WstacFwSpeedLaw law;
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_trigger_defaults(&trigger) == WSTAC_FW_STATUS_OK && trigger.window == 5 && trigger.one_event_per_touch);
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_OK);
    trigger.follow = 17;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_FOLLOW);
    trigger.follow = 64;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_OK);
    trigger.margin = -1;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_MARGIN);
    trigger.multiplier = NAN;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_MULTIPLIER);
    trigger.backtrack = 26;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_BACKTRACK);
    trigger.window = 71;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_WINDOW);
    EXPECT(wstac_fw_speed_law_defaults(&law) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == WSTAC_FW_STATUS_OK);
    law.slowest_mm_s = 300;
    EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == WSTAC_FW_STATUS_FITTED_RANGE);
    law.intercept = INFINITY;
    EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == WSTAC_FW_STATUS_SPEED_LAW);
    law.threshold = 0;
    EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == WSTAC_FW_STATUS_SPEED_THRESHOLD);
    EXPECT(wstac_fw_set_floor(&pipeline, 256) == WSTAC_FW_STATUS_FLOOR_LEVELS);
    EXPECT(wstac_fw_set_floor(&pipeline, 2) == WSTAC_FW_STATUS_OK);
    /* A refused frame does not start the stream. */
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark - 1) == WSTAC_FW_STATUS_FRAME_TOO_SHORT);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 1) == WSTAC_FW_STATUS_STRIPE_NOT_WHOLE_ROWS);
    EXPECT(wstac_fw_set_floor(&pipeline, 2) == WSTAC_FW_STATUS_OK);
    /* Parameters cannot be changed after the stream has started. */
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_trigger_defaults(&trigger) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_set_floor(&pipeline, 2) == WSTAC_FW_STATUS_STATE);
}

/* A choice is 0 or 1. Any other byte, which no bool has, is refused, and nothing is set up. */
static void choices_are_checked(void)
{
    WstacFwTrigger trigger;
    WstacFwSpeedLaw law;
    EXPECT(strlen(wstac_fw_status_text(WSTAC_FW_STATUS_CHOICE)) > 20);
    for (int byte = 0; byte < 256; byte++) {
        const WstacFwStatus expected = byte < 2 ? WSTAC_FW_STATUS_OK : WSTAC_FW_STATUS_CHOICE;
        WstacFwOptions options = tiny;
        options.bt709 = (WstacFwBool)byte;
        EXPECT(init(&options) == expected);
        options = tiny, options.full_range = (WstacFwBool)byte;
        EXPECT(init(&options) == expected);
        EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK && wstac_fw_trigger_defaults(&trigger) == WSTAC_FW_STATUS_OK);
        trigger.literal = (WstacFwBool)byte;
        EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == expected);
        trigger.literal = 0, trigger.one_event_per_touch = (WstacFwBool)byte;
        EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == expected);
        EXPECT(wstac_fw_speed_law_defaults(&law) == WSTAC_FW_STATUS_OK);
        law.above_baseline = (WstacFwBool)byte;
        EXPECT(wstac_fw_set_speed_law(&pipeline, &law) == expected);
    }
}

static void streams_are_checked(void)
{
    WstacFwOptions planar = {.format = &WSTAC_FW_NV12, .width = 10, .height = 10};
    WstacFwEnd end;
    WstacFwIncomplete incomplete;
    WstacFwEvent event;
    WstacFwContactEnd contact_end;
    int16_t features[WSTAC_FW_FEATURES];
    uint64_t number = 99;
    EXPECT(init(&planar) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 10) == WSTAC_FW_STATUS_STRIPE_OF_PLANAR);
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, 99) == WSTAC_FW_STATUS_FRAME_TOO_SHORT);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 15) == WSTAC_FW_STATUS_STRIPE_NOT_WHOLE_ROWS);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 60) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_features(&pipeline, features, &number) == WSTAC_FW_STATUS_NONE && number == 99);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 60) == WSTAC_FW_STATUS_STRIPE_TOO_LONG);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, 100) == WSTAC_FW_STATUS_FRAME_UNDER_WAY);
    EXPECT(wstac_fw_push_stripe(&pipeline, dark, 40) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_features(&pipeline, features, &number) == WSTAC_FW_STATUS_OK && number == 0);
    EXPECT(wstac_fw_features(&pipeline, features, NULL) == WSTAC_FW_STATUS_OK);
    /* The second frame is abandoned and filled. Then come a baseline, a touch, and lost frames within its sample. */
    EXPECT(wstac_fw_push_stripe(&pipeline, bright, 50) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_abandon_frame(&pipeline) == WSTAC_FW_STATUS_OK);
    for (int i = 2; i < 40; i++)
        EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_OK);
    for (int i = 40; i < 60; i++)
        EXPECT(wstac_fw_push_frame(&pipeline, bright, sizeof bright) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_end(&pipeline, &end) == WSTAC_FW_STATUS_OK && end.baseline_complete && end.baseline_quiet);
    EXPECT(end.frames == 60 && end.incomplete_frame == 30 && end.incomplete_frames == 30);
    EXPECT(wstac_fw_push_lost(&pipeline, 5) == WSTAC_FW_STATUS_OK);
    for (int i = 65; i < 99; i++)
        EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_EVENT);
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_OK);
    EXPECT(event.frame == 30 && event.frames_filled == 5 && event.reliable);
    /* The last bright frame is repeated for the lost ones. */
    EXPECT(event.touch_frame == 40 && event.end_frame == 65);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_OK);
    EXPECT(contact_end.frame == 65 && contact_end.event_frame == 30);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_sample(&pipeline, sample) == WSTAC_FW_STATUS_OK && sample[0] < sample[100]);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_STATE);
    /* A gap of more than seven frames ends the next sample. */
    for (int i = 101; i < 115; i++)
        EXPECT(wstac_fw_push_frame(&pipeline, i < 110 ? dark : bright, sizeof dark) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_push_lost(&pipeline, 8) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_take_interrupted(&pipeline, &incomplete) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_take_interrupted(&pipeline, &incomplete) == WSTAC_FW_STATUS_OK);
    EXPECT(incomplete.frame == 100 && incomplete.frames == 15);
    EXPECT(wstac_fw_take_interrupted(&pipeline, &incomplete) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_finish(&pipeline) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_finish(&pipeline) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_push_frame(&pipeline, dark, sizeof dark) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_end(&pipeline, &end) == WSTAC_FW_STATUS_OK && end.frames == 124 && end.incomplete_frames == 0);
}

/* Pushes frames until one completes an event, and returns its number. */
static int event_at(int from, int to, const uint8_t *bytes)
{
    int found = -1;
    for (int i = from; i < to; i++) {
        WstacFwStatus status = wstac_fw_push_frame(&pipeline, bytes, 100);
        EXPECT(status == WSTAC_FW_STATUS_OK || (status == WSTAC_FW_STATUS_EVENT && found < 0));
        if (status == WSTAC_FW_STATUS_EVENT)
            found = i;
    }
    return found;
}

/* A touch of 200 frames is one event, or, as published, one after each 70 frames. */
static void long_touches_are_one_event(void)
{
    WstacFwTrigger trigger;
    WstacFwEvent event;
    WstacFwMotion motion;
    WstacFwContactEnd contact_end;
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(event_at(0, 40, dark) < 0);
    EXPECT(event_at(40, 100, bright) == 99);
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_OK);
    EXPECT(event.frame == 30 && event.touch_frame == 40 && event.end_frame == -1);
    EXPECT(wstac_fw_motion(&pipeline, &motion) == WSTAC_FW_STATUS_OK && motion.contact == WSTAC_FW_CONTACT_PRESS);
    EXPECT(motion.mm_s == 0 && motion.mm_s_sd == 0 && motion.degrees == -1 && motion.degrees_sd == 0 && motion.reliable);
    EXPECT(wstac_fw_motion_by_edges(&pipeline, &motion) == WSTAC_FW_STATUS_OK && motion.contact == WSTAC_FW_CONTACT_PRESS);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_NONE);
    EXPECT(event_at(100, 240, bright) < 0 && event_at(240, 244, dark) < 0);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_NONE);
    EXPECT(event_at(244, 245, dark) < 0);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_OK);
    EXPECT(contact_end.frame == 240 && contact_end.event_frame == 30);

    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_trigger_defaults(&trigger) == WSTAC_FW_STATUS_OK);
    trigger.one_event_per_touch = false;
    EXPECT(wstac_fw_set_trigger(&pipeline, &trigger) == WSTAC_FW_STATUS_OK);
    EXPECT(event_at(0, 40, dark) < 0);
    EXPECT(event_at(40, 100, bright) == 99);
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_OK);
    EXPECT(event.frame == 30 && event.touch_frame == -1 && event.end_frame == -1);
    EXPECT(event_at(100, 170, bright) == 169);
    EXPECT(event_at(170, 240, dark) < 0);
    EXPECT(wstac_fw_take_contact_end(&pipeline, &contact_end) == WSTAC_FW_STATUS_NONE);
}

/* Checks that a call has written a message, and returns its length. */
static size_t written(WstacFwStatus status, const uint8_t *bytes, const size_t *length)
{
    EXPECT(status == WSTAC_FW_STATUS_OK && *length >= 9 && *length <= WSTAC_FW_LINK_BYTES);
    /* Only the first and the last byte are 0. */
    for (size_t at = 0; at < *length; at++)
        EXPECT((bytes[at] == 0) == (at == 0 || at == *length - 1));
    return *length;
}

static void link_is_checked(void)
{
    static WstacFwLink line;
    uint8_t bytes[WSTAC_FW_LINK_BYTES];
    size_t length = 7;
    static const uint32_t id[3] = {1, 2, 3};
    WstacFwBoard board = {.firmware = "a", .version = "b", .revision = "c", .format = &WSTAC_FW_GREY, .id = id};
    WstacFwMotion motion;
    WstacFwSpeed speed;
    WstacFwDirection direction;
    WstacFwTexture texture = {.task = WSTAC_FW_TASK_PATTERN, .label = "Saw", .confidence = -1, .known = -1};
    WstacFwAnswers answers = {.motion = &motion};
    WstacFwContactEnd end = {.frame = 60, .event_frame = 30};
    WstacFwIncomplete incomplete = {.frame = 30, .frames = 69};
    WstacFwTelemetry telemetry = {.uptime_ms = 5, .millihertz = 29970, .overruns = -1, .restarts = 0, .stack = INT64_MAX};
    EXPECT(wstac_fw_version() == WSTAC_FW_VERSION && sizeof line == WSTAC_FW_LINK_SIZE);
    EXPECT(WSTAC_FW_VERSION == (WSTAC_FW_VERSION_MAJOR << 16 | WSTAC_FW_VERSION_MINOR << 8 | WSTAC_FW_VERSION_PATCH));
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_link_lost(&line, 1, bytes, &length) == WSTAC_FW_STATUS_STATE && length == 7);
    EXPECT(wstac_fw_link_init(NULL, sizeof line) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_init(&line, sizeof line - 1) == WSTAC_FW_STATUS_MEMORY);
    EXPECT(wstac_fw_link_init(&line, sizeof line) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_link_lost(NULL, 1, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_lost(&line, 1, NULL, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_lost(&line, 1, bytes, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_hello(&line, NULL, &board, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_hello(&line, &pipeline, NULL, bytes, &length) == WSTAC_FW_STATUS_NULL);
    size_t whole = written(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length), bytes, &length);
    board.revision = NULL, board.id = NULL;
    EXPECT(written(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length), bytes, &length) == whole - 4);
    board.firmware = "a name of thirty-one bytes, which is as long as it may be";
    EXPECT(written(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length), bytes, &length) == whole - 4 + 30);
    board.version = "\xFF";
    EXPECT(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length) == WSTAC_FW_STATUS_TEXT);
    board.version = NULL;
    EXPECT(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length) == WSTAC_FW_STATUS_NULL);
    board.version = "b", board.format = (const WstacFwFormat *)(const void *)model_words;
    EXPECT(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length) == WSTAC_FW_STATUS_FORMAT);
    EXPECT(wstac_fw_link_features(&line, &pipeline, bytes, &length) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_STATE);
    EXPECT(event_at(0, 40, dark) < 0);
    written(wstac_fw_link_features(&line, &pipeline, bytes, &length), bytes, &length);
    EXPECT(event_at(40, 60, bright) < 0 && event_at(60, 100, dark) == 99);
    EXPECT(wstac_fw_link_event(&line, &pipeline, NULL, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_motion(&pipeline, &motion) == WSTAC_FW_STATUS_OK);
    whole = written(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length), bytes, &length);
    motion.reliable = 2;
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_CHOICE);
    motion.reliable = true;
    /* A texture takes its task, its name with a length, and two bytes for what the model does not tell. */
    answers.texture = &texture;
    EXPECT(written(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length), bytes, &length) == whole + 7);
    memset(texture.label, 'a', sizeof texture.label);
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_TEXT);
    texture.label[1] = 0, texture.label[0] = (char)0xFF;
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_TEXT);
    answers.motion = NULL, answers.texture = NULL;
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_speed(&pipeline, &speed) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_direction(&pipeline, &direction) == WSTAC_FW_STATUS_OK);
    answers.speed = &speed, answers.direction = &direction;
    speed.extrapolated = 2;
    EXPECT(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length) == WSTAC_FW_STATUS_CHOICE);
    speed.extrapolated = false;
    written(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length), bytes, &length);
    written(wstac_fw_link_contact_end(&line, &end, bytes, &length), bytes, &length);
    written(wstac_fw_link_interrupted(&line, &incomplete, bytes, &length), bytes, &length);
    written(wstac_fw_link_lost(&line, 3, bytes, &length), bytes, &length);
    written(wstac_fw_link_status(&line, &pipeline, bytes, &length), bytes, &length);
    written(wstac_fw_link_telemetry(&line, &telemetry, bytes, &length), bytes, &length);
    written(wstac_fw_link_end(&line, &pipeline, bytes, &length), bytes, &length);
    EXPECT(wstac_fw_link_contact_end(&line, NULL, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_interrupted(&line, NULL, bytes, &length) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_telemetry(&line, NULL, bytes, &length) == WSTAC_FW_STATUS_NULL);
}

/* Puts the CRC-32 (IEEE) of bytes into four bytes, the lowest first. */
static void put_crc(uint8_t *to, const uint8_t *bytes, size_t length)
{
    uint32_t crc = ~0u;
    for (size_t at = 0; at < length; at++) {
        crc ^= bytes[at];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
    }
    for (int byte = 0; byte < 4; byte++)
        to[byte] = (uint8_t)(~crc >> 8 * byte);
}

/* The link, and what the last receive said. */
static WstacFwLink line;
static WstacFwWanted wanted;
static uint8_t message[WSTAC_FW_LINK_BYTES];
static size_t message_bytes;

/* Takes a request of two bytes as a host sends it, in COBS: version 4 of the link, a sequence number, the request, its sum. */
static WstacFwStatus ask(uint8_t number, uint8_t value, int damaged_bit)
{
    uint8_t content[8] = {4, 9, number, value}, bytes[11] = {0};
    size_t code = 1, length = 2;
    put_crc(content + 4, content, 4);
    content[damaged_bit >= 0 ? damaged_bit / 8 : 0] ^= (uint8_t)(damaged_bit >= 0 ? 1 << damaged_bit % 8 : 0);
    bytes[code] = 1;
    for (size_t at = 0; at < sizeof content; at++) {
        if (content[at] == 0)
            code = length, bytes[length] = 1;
        else
            bytes[length] = content[at], bytes[code]++;
        length++;
    }
    EXPECT(length == 10);
    /* In two pieces. */
    EXPECT(wstac_fw_link_receive(&line, bytes, 5, &wanted) == WSTAC_FW_STATUS_OK && !wanted.hello);
    return wstac_fw_link_receive(&line, bytes + 5, 6, &wanted);
}

/* Sends the event again with a texture of this name. Returns the message's length. */
static size_t send_named(const char *name)
{
    WstacFwTexture texture = {.task = WSTAC_FW_TASK_PATTERN, .confidence = -1, .known = -1};
    WstacFwMotion motion;
    WstacFwAnswers answers = {.motion = &motion, .texture = &texture};
    EXPECT(wstac_fw_motion(&pipeline, &motion) == WSTAC_FW_STATUS_OK && strlen(name) < sizeof texture.label);
    memcpy(texture.label, name, strlen(name) + 1);
    return written(wstac_fw_link_event(&line, &pipeline, &answers, message, &message_bytes), message, &message_bytes);
}

static WstacFwStatus due(uint32_t now)
{
    return wstac_fw_link_due(&line, now, message, &message_bytes);
}

static void requests_are_read(void)
{
    memset(&line, 0, sizeof line);
    EXPECT(wstac_fw_link_receive(&line, message, 1, &wanted) == WSTAC_FW_STATUS_STATE && due(0) == WSTAC_FW_STATUS_STATE);
    EXPECT(init(&tiny) == WSTAC_FW_STATUS_OK && wstac_fw_link_init(&line, sizeof line) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_link_receive(NULL, message, 1, &wanted) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_receive(&line, NULL, 1, &wanted) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_receive(&line, message, 1, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_due(NULL, 0, message, &message_bytes) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_due(&line, 0, NULL, &message_bytes) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_link_due(&line, 0, message, NULL) == WSTAC_FW_STATUS_NULL);

    /* Hello is 0 and has no value: the byte behind it is ignored. */
    EXPECT(ask(0, 0, -1) == WSTAC_FW_STATUS_OK && wanted.hello && !wanted.features && !wanted.samples && !wanted.events_kept);
    EXPECT(ask(1, 1, -1) == WSTAC_FW_STATUS_OK && !wanted.hello && wanted.features);
    EXPECT(ask(2, 1, -1) == WSTAC_FW_STATUS_OK && wanted.features && wanted.samples);
    EXPECT(ask(1, 0, -1) == WSTAC_FW_STATUS_OK && !wanted.features && wanted.samples);
    /* Motion, a picture and requests that are not known change nothing. */
    for (uint8_t other = 6; other < 20; other++)
        EXPECT(ask(other, 1, -1) == WSTAC_FW_STATUS_OK && !wanted.hello && !wanted.features && !wanted.events_kept);
    for (int bit = 0; bit < 64; bit++)
        if (ask(4, 1, bit) != WSTAC_FW_STATUS_OK || wanted.events_kept)
            EXPECT(!"a damaged request is ignored");
    for (int at = 0; at < 1000; at++)
        EXPECT(wstac_fw_link_receive(&line, dark, sizeof dark, &wanted) == WSTAC_FW_STATUS_OK && !wanted.hello);
    EXPECT(wstac_fw_link_sample(&line, &pipeline, 0, message, &message_bytes) == WSTAC_FW_STATUS_STATE);

    /* Without a host that acknowledges, an event is sent once. */
    EXPECT(event_at(0, 40, dark) < 0 && event_at(40, 60, bright) < 0 && event_at(60, 100, dark) == 99);
    send_named("Saw");
    EXPECT(due(1000) == WSTAC_FW_STATUS_NONE && due(2000) == WSTAC_FW_STATUS_NONE);
    for (uint32_t part = 0; part < WSTAC_FW_SAMPLE_PARTS; part++)
        EXPECT(written(wstac_fw_link_sample(&line, &pipeline, part, message, &message_bytes), message, &message_bytes) > 200);
    EXPECT(wstac_fw_link_sample(&line, &pipeline, WSTAC_FW_SAMPLE_PARTS, message, &message_bytes) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_link_sample(&line, &pipeline, UINT32_MAX, message, &message_bytes) == WSTAC_FW_STATUS_NONE);

    /* The events 1 to 3. Each has a name of another length, and so have their messages. The first one gives way. */
    EXPECT(ask(4, 1, -1) == WSTAC_FW_STATUS_OK && wanted.events_kept);
    EXPECT(due(3000) == WSTAC_FW_STATUS_NONE);
    size_t first = send_named("Saw1"), second = send_named("Saw-22"), third = send_named("Saw--333");
    EXPECT(second == first + 2 && third == second + 2);
    EXPECT(due(3249) == WSTAC_FW_STATUS_NONE);
    EXPECT(due(3250) == WSTAC_FW_STATUS_OK && message_bytes == second);
    EXPECT(due(3250) == WSTAC_FW_STATUS_OK && message_bytes == third);
    EXPECT(due(3250) == WSTAC_FW_STATUS_NONE && due(3499) == WSTAC_FW_STATUS_NONE);
    /* Event 1 is not kept any more. */
    EXPECT(ask(5, 1, -1) == WSTAC_FW_STATUS_OK && ask(5, 3, -1) == WSTAC_FW_STATUS_OK);
    EXPECT(due(3500) == WSTAC_FW_STATUS_OK && message_bytes == second && due(3500) == WSTAC_FW_STATUS_NONE);
    EXPECT(ask(5, 2, -1) == WSTAC_FW_STATUS_OK && due(9000) == WSTAC_FW_STATUS_NONE);

    /* Events 4 to 6: the one between is acknowledged, so 4 keeps its name beside 6. */
    size_t fourth = send_named("Saw1");
    EXPECT(fourth == first && send_named("Saw-22") == second && ask(5, 5, -1) == WSTAC_FW_STATUS_OK);
    EXPECT(send_named("Saw--333") == third && due(9250) == WSTAC_FW_STATUS_OK && message_bytes == fourth);
    EXPECT(due(9250) == WSTAC_FW_STATUS_OK && message_bytes == third && due(9250) == WSTAC_FW_STATUS_NONE);
    EXPECT(ask(5, 4, -1) == WSTAC_FW_STATUS_OK && ask(5, 6, -1) == WSTAC_FW_STATUS_OK && due(9900) == WSTAC_FW_STATUS_NONE);

    /* Nobody acknowledges event 7: it is sent 16 times, the clock wraps, and the host counts as gone. */
    EXPECT(due(UINT32_MAX - 1000) == WSTAC_FW_STATUS_NONE);
    size_t last = send_named("");
    for (uint32_t times = 1; times < 16; times++)
        EXPECT(due(UINT32_MAX - 1000 + 250 * times) == WSTAC_FW_STATUS_OK && message_bytes == last);
    EXPECT(due(UINT32_MAX - 1000 + 250 * 16) == WSTAC_FW_STATUS_NONE);
    EXPECT(wstac_fw_link_receive(&line, dark, 0, &wanted) == WSTAC_FW_STATUS_OK && !wanted.events_kept && wanted.samples);
}

/* Puts the sum of a model file's bytes behind its checksum into its place. */
static void check_again(uint8_t *file, size_t bytes)
{
    put_crc(file + 4, file + 8, bytes - 8);
}

static void models_are_checked(size_t bytes)
{
    uint8_t *file = (uint8_t *)model_words;
    WstacFwTexture texture;
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, 0) == WSTAC_FW_STATUS_MODEL_MAGIC);
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes - 4) == WSTAC_FW_STATUS_MODEL_LENGTH);
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes - 1) == WSTAC_FW_STATUS_MODEL_ALIGNMENT);
    EXPECT(wstac_fw_model_init(&model, sizeof model, file + 1, bytes - 4) == WSTAC_FW_STATUS_MODEL_ALIGNMENT);
    file[3] = '2';
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes) == WSTAC_FW_STATUS_MODEL_VERSION);
    file[3] = '1', file[bytes / 2] ^= 1;
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes) == WSTAC_FW_STATUS_MODEL_CHECKSUM);
    file[bytes / 2] ^= 1;
    /* Half 15 is the input: a sample along the path. */
    for (uint8_t input = 1; input <= 2; input++) {
        file[30] = input;
        check_again(file, bytes);
        EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes) == WSTAC_FW_STATUS_MODEL_INPUT);
    }
    file[30] = 0;
    check_again(file, bytes);
    EXPECT(wstac_fw_classify(&model, sample, NULL, &texture) == WSTAC_FW_STATUS_STATE);
    EXPECT(wstac_fw_model_init(&model, sizeof model, file, bytes) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_classify(&model, NULL, NULL, &texture) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_fw_classify(&model, sample, NULL, NULL) == WSTAC_FW_STATUS_NULL);
}

static void texts_are_there(void)
{
    const char *unknown = wstac_fw_status_text(3);
    for (WstacFwStatus status = WSTAC_FW_STATUS_TEXT; status <= WSTAC_FW_STATUS_NONE; status++)
        EXPECT(strlen(wstac_fw_status_text(status)) > 3 && wstac_fw_status_text(status) != unknown);
    EXPECT(wstac_fw_status_text(WSTAC_FW_STATUS_TEXT - 1) == unknown && wstac_fw_status_text(INT32_MIN) == unknown);
}

static void print_motion(const WstacFwMotion *motion)
{
    static const char *const contacts[] = {"unclear", "slide", "press", "poke"};
    printf(" %s %.3f %.4f %.2f %.3f %d", contacts[motion->contact], (double)motion->mm_s, (double)motion->mm_s_sd,
           (double)motion->degrees, (double)motion->degrees_sd, motion->reliable);
}

static void print_event(void)
{
    WstacFwEvent event;
    WstacFwSpeed speed;
    WstacFwDirection direction;
    WstacFwMotion motion, by_edges;
    WstacFwTexture texture;
    EXPECT(wstac_fw_event(&pipeline, &event) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_speed(&pipeline, &speed) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_direction(&pipeline, &direction) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_motion(&pipeline, &motion) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_motion_by_edges(&pipeline, &by_edges) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_sample(&pipeline, sample) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_fw_classify(&model, sample, &motion, &texture) == WSTAC_FW_STATUS_OK && texture.task == WSTAC_FW_TASK_SPECIMEN);
    printf("event %lu %d %.3f %.3f %d %d %d %d %d %s", (unsigned long)event.frame, speed.duration_frames, (double)speed.mm_s,
           (double)speed.at_most_mm_s, speed.extrapolated, direction.degrees, direction.confidence, event.frames_filled,
           event.reliable, texture.label);
    for (int i = 0; i < WSTAC_FW_SAMPLE_NUMBERS; i++)
        printf(" %d", sample[i]);
    printf("\nmotion %ld %ld", (long)event.touch_frame, (long)event.end_frame);
    print_motion(&motion);
    print_motion(&by_edges);
    printf("\n");
}

static void push(const uint8_t *bytes, size_t length, bool whole)
{
    int16_t f[WSTAC_FW_FEATURES];
    WstacFwStatus (*take)(WstacFwPipeline *, const uint8_t *, size_t) = whole ? wstac_fw_push_frame : wstac_fw_push_stripe;
    WstacFwStatus status = take(&pipeline, bytes, length);
    EXPECT(status == WSTAC_FW_STATUS_OK || status == WSTAC_FW_STATUS_EVENT);
    if (wstac_fw_features(&pipeline, f, NULL) == WSTAC_FW_STATUS_OK)
        printf("features %d %d %d %d %d %d %d %d %d %d\n", f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9]);
    if (status == WSTAC_FW_STATUS_EVENT)
        print_event();
}

/* Pushes frames of the format until the file ends. The caller knows the bytes of a row and of a frame. */
static void stream(const WstacFwOptions *options, FILE *file, size_t row_bytes, size_t frame_bytes, size_t stripe_rows)
{
    EXPECT(frame_bytes <= sizeof frame);
    EXPECT(init(options) == WSTAC_FW_STATUS_OK);
    while (fread(frame, 1, frame_bytes, file) == frame_bytes) {
        if (stripe_rows == 0) {
            push(frame, frame_bytes, true);
            continue;
        }
        for (size_t at = 0; at < frame_bytes; at += stripe_rows * row_bytes) {
            size_t left = frame_bytes - at;
            push(frame + at, left < stripe_rows * row_bytes ? left : stripe_rows * row_bytes, false);
        }
    }
    if (wstac_fw_finish(&pipeline) == WSTAC_FW_STATUS_EVENT)
        print_event();
}

int main(int argc, char **argv)
{
    memset(dark, 3, sizeof dark);
    memset(bright, 200, sizeof bright);
    EXPECT(argc == 8);
    memory_is_checked();
    options_are_checked();
    settings_are_checked();
    choices_are_checked();
    streams_are_checked();
    long_touches_are_one_event();
    link_is_checked();
    requests_are_read();
    texts_are_there();
    FILE *file = fopen(argv[5], "rb");
    EXPECT(file != NULL);
    size_t bytes = fread(model_words, 1, sizeof model_words, file);
    fclose(file);
    models_are_checked(bytes);
    fprintf(stderr, "%d expectations\n", expectations);
    WstacFwOptions options = {
        .width = (uint32_t)atoi(argv[3]), .height = (uint32_t)atoi(argv[4]), .readout_known = 1};
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (strcmp(formats[i].name, argv[1]) == 0)
            options.format = formats[i].format;
    size_t frame_bytes = (size_t)atoi(argv[7]);
    file = fopen(argv[2], "rb");
    EXPECT(file != NULL);
    stream(&options, file, frame_bytes / options.height, frame_bytes, (size_t)atoi(argv[6]));
    fclose(file);
    return 0;
}
