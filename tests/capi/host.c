/*
 * Tests the host library at its edges, and compares pushed frames with the same frames read from a recording.
 *
 *     host FILE.mcap FRAMES WIDTH HEIGHT FORMAT      FRAMES: the recording's, as wstac run --save-raw writes them
 *
 * Prints how many expectations were met and how many records were equal.
 */
#include <math.h>
#include <pthread.h>
#include <wstac.h>

#include "expect.h"

static const WstacFrames gray = {.width = 40, .height = 30, .format = "GREY"};
static uint8_t dark[40 * 30], bright[40 * 30];

static bool says(const Wstac *handle, const char *part)
{
    const char *message = wstac_error_message(handle);
    if (strstr(message, part) != NULL)
        return true;
    fprintf(stderr, "message is \"%s\"\n", message);
    return false;
}

static WstacStatus open_source(const char *source, const WstacOptions *options)
{
    Wstac *handle = (Wstac *)(void *)dark;
    WstacStatus status = wstac_open(source, options, &handle);
    EXPECT((handle == NULL) == (status != WSTAC_STATUS_OK));
    wstac_close(handle);
    return status;
}

static void opening_is_checked(void)
{
    Wstac *handle;
    WstacOptions options = {0};
    EXPECT(wstac_open("scene:Saw3@150", NULL, NULL) == WSTAC_STATUS_NULL);
    EXPECT(open_source(NULL, NULL) == WSTAC_STATUS_NULL && says(NULL, "source is null"));
    // A name need not be UTF-8.
    EXPECT(open_source("\xff", NULL) == WSTAC_STATUS_SOURCE);
    EXPECT(open_source("no.mcap", NULL) == WSTAC_STATUS_SOURCE && says(NULL, "no.mcap"));
    EXPECT(open_source("/dev/null", NULL) == WSTAC_STATUS_SOURCE && says(NULL, "/dev/null"));
    EXPECT(open_source("scene:Saw3@150", NULL) == WSTAC_STATUS_OK);
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_OK);
    options.config = "no.toml";
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_CONFIG && says(NULL, "no.toml"));
    options = (WstacOptions){.models = (const char *[]){"builtin:none", NULL}};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_MODEL && says(NULL, "builtin:svm"));
    options.models = (const char *[]){"builtin:svm", "builtin:forest", NULL};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_MODEL && says(NULL, "one model of each"));
    options.models = (const char *[]){NULL};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_OK);
    options = (WstacOptions){.width = 400};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_OPTION && says(NULL, "400x0"));
    options = (WstacOptions){.format = "H264"};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_OPTION && says(NULL, "H264"));
    // One sensor of a recording of several.
    options = (WstacOptions){.sensor = "right"};
    EXPECT(open_source("both.mcap", &options) == WSTAC_STATUS_OK);
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_SOURCE && says(NULL, "expected only with a recording"));
    EXPECT(open_source("both.mcap", NULL) == WSTAC_STATUS_SOURCE && says(NULL, "has the sensors left, right"));
    options.sensor = "top";
    EXPECT(open_source("both.mcap", &options) == WSTAC_STATUS_SOURCE && says(NULL, "has no sensor \"top\""));
    options.sensor = "\xff";
    EXPECT(open_source("both.mcap", &options) == WSTAC_STATUS_TEXT && says(NULL, "sensor"));
    options = (WstacOptions){.fps_numerator = 30};
    EXPECT(open_source("scene:Saw3@150", &options) == WSTAC_STATUS_OPTION && says(NULL, "30:0"));
    /* Frames that are pushed. */
    EXPECT(wstac_open_frames(&gray, NULL, NULL) == WSTAC_STATUS_NULL);
    EXPECT(wstac_open_frames(NULL, NULL, &handle) == WSTAC_STATUS_NULL && handle == NULL);
    WstacFrames frames = gray;
    frames.format = NULL;
    EXPECT(wstac_open_frames(&frames, NULL, &handle) == WSTAC_STATUS_NULL && says(NULL, "format is null"));
    frames.format = "MJPG";
    EXPECT(wstac_open_frames(&frames, NULL, &handle) == WSTAC_STATUS_OPTION && says(NULL, "MJPG"));
    frames = gray, frames.height = 0;
    EXPECT(wstac_open_frames(&frames, NULL, &handle) == WSTAC_STATUS_OPTION && says(NULL, "40x0"));
    frames = gray, frames.bytes_per_row = 39;
    EXPECT(wstac_open_frames(&frames, NULL, &handle) == WSTAC_STATUS_OPTION && says(NULL, "39"));
    frames = gray, frames.fps_denominator = 1;
    EXPECT(wstac_open_frames(&frames, NULL, &handle) == WSTAC_STATUS_OPTION && says(NULL, "0:1"));
    const WstacOptions refused[] = {{.fps_numerator = 30, .fps_denominator = 1}, {.format = "GREY"}, {.width = 40, .height = 30},
                                    {.every_frame = true}, {.keep_controls = true}, {.sensor = "left"}};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++)
        EXPECT(wstac_open_frames(&gray, &refused[i], &handle) == WSTAC_STATUS_OPTION && says(NULL, "only with wstac_open"));
}

static void calls_are_checked(void)
{
    Wstac *handle;
    WstacRecord record;
    EXPECT(wstac_next(NULL, &record) == WSTAC_STATUS_NULL && says(NULL, "handle is null"));
    EXPECT(wstac_push_frame(NULL, dark, sizeof dark) == WSTAC_STATUS_NULL);
    EXPECT(wstac_push_lost(NULL, 1) == WSTAC_STATUS_NULL);
    EXPECT(wstac_finish(NULL) == WSTAC_STATUS_NULL);
    wstac_close(NULL);
    EXPECT(wstac_open("scene:Saw3@150", NULL, &handle) == WSTAC_STATUS_OK);
    EXPECT(wstac_next(handle, NULL) == WSTAC_STATUS_NULL && says(handle, "record is null"));
    EXPECT(wstac_push_frame(handle, dark, sizeof dark) == WSTAC_STATUS_STATE && says(handle, "reads a source"));
    EXPECT(wstac_push_lost(handle, 1) == WSTAC_STATUS_STATE);
    /* Ends the stream before its first frame. */
    EXPECT(wstac_finish(handle) == WSTAC_STATUS_OK && wstac_finish(handle) == WSTAC_STATUS_STATE);
    EXPECT(wstac_next(handle, &record) == WSTAC_STATUS_OK && record.kind == WSTAC_KIND_END);
    EXPECT(record.frame == 0 && !record.end.baseline_complete && record.event.sample == NULL && isnan(record.event.speed_mm_s));
    EXPECT(wstac_next(handle, &record) == WSTAC_STATUS_STATE && says(handle, "has ended"));
    wstac_close(handle);
}

static WstacRecord next(Wstac *handle, WstacKind kind)
{
    WstacRecord record;
    EXPECT(wstac_next(handle, &record) == WSTAC_STATUS_OK);
    EXPECT(record.kind == kind);
    return record;
}

static void push(Wstac *handle, const uint8_t *frame, int count)
{
    for (int i = 0; i < count; i++)
        EXPECT(wstac_push_frame(handle, frame, sizeof dark) == WSTAC_STATUS_OK);
}

static void pushed_frames_are_checked(void)
{
    Wstac *handle;
    WstacRecord record;
    EXPECT(wstac_open_frames(&gray, NULL, &handle) == WSTAC_STATUS_OK);
    next(handle, WSTAC_KIND_WAITING);
    EXPECT(wstac_push_frame(handle, NULL, sizeof dark) == WSTAC_STATUS_NULL);
    EXPECT(wstac_push_frame(handle, dark, SIZE_MAX) == WSTAC_STATUS_FRAME);
    EXPECT(wstac_push_frame(handle, dark, sizeof dark - 1) == WSTAC_STATUS_FRAME && says(handle, "1199 bytes, expected at least 1200"));
    push(handle, dark, 40);
    push(handle, bright, 20);
    /* More than seven lost frames end the sample. */
    EXPECT(wstac_push_lost(handle, 8) == WSTAC_STATUS_OK);
    push(handle, dark, 1);
    record = next(handle, WSTAC_KIND_INCOMPLETE);
    EXPECT(record.frame == 30 && record.frames == 30);
    push(handle, dark, 11);
    push(handle, bright, 20);
    EXPECT(wstac_push_lost(handle, 7) == WSTAC_STATUS_OK);
    push(handle, dark, 60);
    record = next(handle, WSTAC_KIND_EVENT);
    EXPECT(record.event.frames_filled == 7 && record.event.reliable && record.event.sample[0][0] < record.event.sample[15][0]);
    EXPECT(isnan(record.event.speed_mm_s) == (record.event.why_no_speed != NULL));
    EXPECT(isnan(record.event.direction_deg) && strstr(record.event.why_no_direction, "press") != NULL);
    /* The lost frames are filled from bright to dark: frame 107 is the first dark one. */
    EXPECT(strcmp(record.event.contact, "press") == 0 && record.event.stamp == NULL);
    EXPECT(record.event.touch_frame == 80 && fabs(record.event.touch_s - 80 / 30.0) < 1e-4);
    EXPECT(record.event.end_frame == 107 && fabs(record.event.completed_s - (record.frame + 69) / 30.0) < 1e-4);
    EXPECT(isnan(record.event.speed_sd_mm_s) && isnan(record.event.direction_sd_deg) && isnan(record.event.direction_confidence));
    EXPECT(record.texture.specimen == NULL && isnan(record.texture.depth_mm));
    EXPECT(isnan(record.texture.confidence) && record.texture.known == -1);
    uint64_t event_frame = record.frame;
    record = next(handle, WSTAC_KIND_CONTACT_END);
    EXPECT(record.frame == 107 && record.event_frame == event_frame && fabs(record.time_s - 107 / 30.0) < 1e-4);
    next(handle, WSTAC_KIND_WAITING);
    EXPECT(wstac_finish(handle) == WSTAC_STATUS_OK);
    EXPECT(wstac_push_frame(handle, dark, sizeof dark) == WSTAC_STATUS_STATE && says(handle, "has ended"));
    record = next(handle, WSTAC_KIND_END);
    EXPECT(record.frame == 167 && record.end.dropped == 15 && record.end.baseline_complete && record.end.incomplete_frames == 0);
    EXPECT(record.message != NULL && strcmp(record.message, "15 reported lost") == 0);
    EXPECT(wstac_next(handle, &record) == WSTAC_STATUS_STATE);
    wstac_close(handle);
    /* A handle may be closed although it has more records. */
    EXPECT(wstac_open_frames(&gray, &(WstacOptions){.features = true}, &handle) == WSTAC_STATUS_OK);
    push(handle, dark, 40);
    wstac_close(handle);
}

/* Tests what a handle says of its source: pushed frames state neither a layout nor a readout, a scene states both. */
static void what_is_not_stated_is_told(void)
{
    Wstac *handle;
    WstacRecord record;
    EXPECT(wstac_open_frames(&gray, NULL, &handle) == WSTAC_STATUS_OK && isnan(wstac_readout_ms(handle)));
    const char *second = strchr(wstac_notes(handle), '\n');
    EXPECT(strncmp(wstac_notes(handle), "no [layout] is given", 20) == 0);
    EXPECT(second != NULL && strncmp(second + 1, "readout unknown", 15) == 0 && strchr(second + 1, '\n') == NULL);
    EXPECT(wstac_finish(handle) == WSTAC_STATUS_OK);
    /* Nothing was lost. */
    record = next(handle, WSTAC_KIND_END);
    EXPECT(record.message == NULL);
    wstac_close(handle);
    EXPECT(wstac_open("scene:Saw3@150", NULL, &handle) == WSTAC_STATUS_OK);
    EXPECT(wstac_notes(handle)[0] == 0 && fabs(wstac_readout_ms(handle)) < 1e-9);
    wstac_close(handle);
    EXPECT(wstac_notes(NULL)[0] == 0 && isnan(wstac_readout_ms(NULL)));
}

/* Tests a source that fails: its end record comes with the reason. */
static void a_failing_source_is_told(const char *name)
{
    Wstac *handle;
    WstacRecord record = {0};
    WstacStatus status;
    FILE *file = fopen(name, "wb");
    EXPECT(file != NULL);
    fputs("YUV4MPEG2 W40 H30 F30:1 Cmono\nFRAME\n", file);
    fwrite(dark, 1, sizeof dark, file);
    fputs("FRAME\nhalf", file);
    fclose(file);
    EXPECT(wstac_open(name, NULL, &handle) == WSTAC_STATUS_OK);
    while ((status = wstac_next(handle, &record)) == WSTAC_STATUS_OK && record.kind != WSTAC_KIND_END)
        ;
    EXPECT(status == WSTAC_STATUS_SOURCE && record.kind == WSTAC_KIND_END && record.frame == 1 && says(handle, name));
    EXPECT(wstac_next(handle, &record) == WSTAC_STATUS_STATE);
    wstac_close(handle);
    remove(name);
}

/* Tests that each thread has its own messages without a handle. */
static void *fails_otherwise(void *unused)
{
    (void)unused;
    EXPECT(wstac_error_message(NULL)[0] == 0);
    EXPECT(open_source("other.mcap", NULL) == WSTAC_STATUS_SOURCE && says(NULL, "other.mcap"));
    EXPECT(strcmp(wstac_error_kind(NULL), "not_found") == 0);
    return NULL;
}

static void threads_do_not_mix(void)
{
    pthread_t thread;
    EXPECT(open_source("mine.mcap", NULL) == WSTAC_STATUS_SOURCE);
    EXPECT(pthread_create(&thread, NULL, fails_otherwise, NULL) == 0 && pthread_join(thread, NULL) == 0);
    EXPECT(says(NULL, "mine.mcap"));
}

static void texts_are_there(void)
{
    for (WstacStatus status = WSTAC_STATUS_OK; status <= WSTAC_STATUS_PANIC; status++)
        EXPECT(strcmp(wstac_error_text(status), wstac_error_text(-1)) != 0);
    EXPECT(strcmp(wstac_version(), WSTAC_VERSION_TEXT) == 0);
}

static bool same_text(const char *a, const char *b)
{
    return (a == NULL) == (b == NULL) && (a == NULL || strcmp(a, b) == 0);
}

static bool same_number(double a, double b)
{
    return a == b || (isnan(a) && isnan(b));
}

static void same_record(const WstacRecord *a, const WstacRecord *b)
{
    const WstacEvent *x = &a->event, *y = &b->event;
    EXPECT(a->kind == b->kind && a->frame == b->frame && a->frames == b->frames);
    EXPECT(memcmp(a->features, b->features, sizeof a->features) == 0);
    EXPECT(same_number(x->speed_mm_s, y->speed_mm_s) && same_number(x->speed_at_most_mm_s, y->speed_at_most_mm_s));
    EXPECT(same_number(x->direction_deg, y->direction_deg) && same_number(x->direction_confidence, y->direction_confidence));
    EXPECT(same_number(x->speed_sd_mm_s, y->speed_sd_mm_s) && same_number(x->direction_sd_deg, y->direction_sd_deg));
    EXPECT(same_text(x->contact, y->contact) && x->touch_frame == y->touch_frame && x->end_frame == y->end_frame);
    EXPECT(same_number(x->touch_s, y->touch_s) && same_number(x->completed_s, y->completed_s) && same_text(x->stamp, y->stamp));
    EXPECT(a->event_frame == b->event_frame && same_number(a->time_s, b->time_s));
    EXPECT(x->duration_frames == y->duration_frames && x->speed_extrapolated == y->speed_extrapolated);
    EXPECT(same_text(x->why_no_speed, y->why_no_speed) && same_text(x->why_no_direction, y->why_no_direction));
    EXPECT(same_text(x->why_not_reliable, y->why_not_reliable) && same_text(x->why_texture, y->why_texture));
    EXPECT(same_text(a->texture.specimen, b->texture.specimen) && same_text(a->texture.pattern, b->texture.pattern));
    EXPECT(same_number(a->texture.depth_mm, b->texture.depth_mm) && same_text(a->texture.other, b->texture.other));
    EXPECT(same_number(a->texture.confidence, b->texture.confidence) && a->texture.known == b->texture.known);
    EXPECT((a->kind == WSTAC_KIND_EVENT) == (x->sample != NULL) && (x->sample == NULL) == (y->sample == NULL));
    if (x->sample != NULL)
        EXPECT(memcmp(x->sample, y->sample, sizeof(int16_t[WSTAC_SAMPLE_FRAMES][WSTAC_FEATURES])) == 0);
}

/* Compares a recording that is read with its frames that are pushed: every record must be equal. */
static int pushed_is_read(char **argv)
{
    const char *models[] = {"builtin:svm", NULL};
    /* Frames that are pushed state no readout. */
    WstacOptions options = {.models = models, .features = true, .config = "global.toml"};
    WstacFrames frames = {.width = (uint32_t)atoi(argv[3]), .height = (uint32_t)atoi(argv[4]), .format = argv[5]};
    size_t length = (size_t)frames.width * frames.height;
    uint8_t *bytes = malloc(length);
    Wstac *read, *pushed;
    WstacRecord a, b;
    int records = 0;
    EXPECT(wstac_open(argv[1], &options, &read) == WSTAC_STATUS_OK);
    EXPECT(wstac_open_frames(&frames, &options, &pushed) == WSTAC_STATUS_OK);
    FILE *file = fopen(argv[2], "rb");
    EXPECT(bytes != NULL && file != NULL);
    do {
        EXPECT(wstac_next(read, &a) == WSTAC_STATUS_OK);
        while (EXPECT(wstac_next(pushed, &b) == WSTAC_STATUS_OK), b.kind == WSTAC_KIND_WAITING) {
            bool more = fread(bytes, 1, length, file) == length;
            EXPECT((more ? wstac_push_frame(pushed, bytes, length) : wstac_finish(pushed)) == WSTAC_STATUS_OK);
        }
        same_record(&a, &b);
        records++;
    } while (a.kind != WSTAC_KIND_END);
    fclose(file);
    free(bytes);
    wstac_close(read);
    wstac_close(pushed);
    return records;
}

int main(int argc, char **argv)
{
    memset(dark, 3, sizeof dark);
    memset(bright, 200, sizeof bright);
    EXPECT(argc == 6);
    opening_is_checked();
    calls_are_checked();
    pushed_frames_are_checked();
    what_is_not_stated_is_told();
    a_failing_source_is_told("broken.y4m");
    threads_do_not_mix();
    texts_are_there();
    int records = pushed_is_read(argv);
    printf("%d expectations, %d records the same\n", expectations, records);
    return 0;
}
