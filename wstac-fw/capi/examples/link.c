/*
 * Sends what a sensor feels as a board does: messages that `wstac monitor` reads. Here frames come from a file, and the
 * messages go to standard output:
 *
 *     link FRAMES WIDTH HEIGHT [MODEL.wsm] | wstac monitor -
 *
 * FRAMES are 8 bits of gray, frames back to back, as wstac run --save-raw writes them. On a board, send_bytes writes to
 * the serial line, and the loop is in an interrupt or a task.
 */
#include <stdio.h>
#include <stdlib.h>

#include "wstac_fw.h"

#if WSTAC_FW_VERSION < 0x000300
#error "wstac_fw.h has no link: version 0.3.0 or later is expected"
#endif

#define STRIPE_ROWS 8
#define MOST_WIDTH 2048
#define STATUS_EVERY 30

/* All memory that the library uses. */
static WstacFwPipeline pipeline;
static WstacFwLink line;
static WstacFwModel model;
static uint8_t bytes[WSTAC_FW_LINK_BYTES];
static size_t length;

static uint8_t rows[STRIPE_ROWS * MOST_WIDTH];
static uint32_t model_words[24 * 1024];
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];

/* A status below 0 is an error: nothing has changed, and the text tells the reason. */
static void check(WstacFwStatus status, const char *what)
{
    if (status < 0) {
        fprintf(stderr, "%s: %s\n", what, wstac_fw_status_text(status));
        exit(1);
    }
}

/* Sends the message that a call has written. */
static void send_bytes(WstacFwStatus status, const char *what)
{
    check(status, what);
    if (status != WSTAC_FW_STATUS_OK)
        return;
    if (fwrite(bytes, 1, length, stdout) != length) {
        perror("standard output");
        exit(1);
    }
}

static FILE *open_file(const char *name)
{
    FILE *file = fopen(name, "rb");
    if (file == NULL) {
        perror(name);
        exit(1);
    }
    return file;
}

static void send_event(bool with_model)
{
    WstacFwMotion motion;
    WstacFwTexture texture;
    WstacFwAnswers answers = {&motion, NULL, NULL, NULL};
    check(wstac_fw_motion(&pipeline, &motion), "motion");
    /* Only a slide has a texture. */
    if (with_model && motion.contact == WSTAC_FW_CONTACT_SLIDE) {
        check(wstac_fw_sample(&pipeline, sample), "sample");
        check(wstac_fw_classify(&model, sample, &motion, &texture), "texture");
        answers.texture = &texture;
    }
    send_bytes(wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length), "event");
}

/* Sends what every push may have found. The event comes first. */
static void send_results(WstacFwStatus status, bool with_model)
{
    WstacFwContactEnd end;
    WstacFwIncomplete incomplete;
    if (wstac_fw_take_interrupted(&pipeline, &incomplete) == WSTAC_FW_STATUS_OK)
        send_bytes(wstac_fw_link_interrupted(&line, &incomplete, bytes, &length), "interrupted sample");
    if (status == WSTAC_FW_STATUS_EVENT)
        send_event(with_model);
    if (wstac_fw_take_contact_end(&pipeline, &end) == WSTAC_FW_STATUS_OK)
        send_bytes(wstac_fw_link_contact_end(&line, &end, bytes, &length), "contact end");
}

int main(int argc, char **argv)
{
    static const uint32_t id[3] = {0x00000001, 0x00000002, 0x00000003};
    WstacFwBoard board = {"link.c", "1.0", NULL, &WSTAC_FW_GREY, NULL, id};
    static WstacFwOptions options; /* zeros are the defaults */
    FILE *frames;
    WstacFwStatus status;
    uint32_t row = 0, count;
    uint64_t number = 0;
    size_t stripe;
    if (argc < 4 || argc > 5) {
        fputs("arguments are FRAMES WIDTH HEIGHT [MODEL.wsm]\n", stderr);
        return 2;
    }
    options.format = &WSTAC_FW_GREY;
    options.width = (uint32_t)strtoul(argv[2], NULL, 10);
    options.height = (uint32_t)strtoul(argv[3], NULL, 10);
    options.readout_known = 1; /* and readout_ms = 0: a global shutter */
    check(wstac_fw_init(&pipeline, sizeof pipeline, &options), "options");
    check(wstac_fw_link_init(&line, sizeof line), "link");
    if (options.width > MOST_WIDTH) {
        fprintf(stderr, "width is %s, expected at most %d\n", argv[2], MOST_WIDTH);
        return 1;
    }
    if (argc == 5) {
        FILE *file = open_file(argv[4]);
        size_t size = fread(model_words, 1, sizeof model_words, file);
        fclose(file);
        check(wstac_fw_model_init(&model, sizeof model, (const uint8_t *)model_words, size), argv[4]);
        board.model = &model;
    }
    /* The host has to know which board it is. */
    send_bytes(wstac_fw_link_hello(&line, &pipeline, &board, bytes, &length), "hello");
    frames = open_file(argv[1]);
    for (;;) {
        count = options.height - row < STRIPE_ROWS ? options.height - row : STRIPE_ROWS;
        stripe = (size_t)count * options.width;
        if (fread(rows, 1, stripe, frames) != stripe)
            break;
        row = row + count == options.height ? 0 : row + count;
        status = wstac_fw_push_stripe(&pipeline, rows, stripe);
        check(status, argv[1]);
        send_results(status, argc == 5);
        /* About once per second: a silent board is a lost board. */
        if (row == 0 && ++number % STATUS_EVERY == 0) {
            WstacFwTelemetry telemetry = {number * 1000 / 30, -1, 0, -1, -1};
            send_bytes(wstac_fw_link_status(&line, &pipeline, bytes, &length), "status");
            send_bytes(wstac_fw_link_telemetry(&line, &telemetry, bytes, &length), "telemetry");
        }
    }
    fclose(frames);
    status = wstac_fw_finish(&pipeline);
    check(status, "finish");
    send_results(status, argc == 5);
    send_bytes(wstac_fw_link_end(&line, &pipeline, bytes, &length), "end");
    return 0;
}
