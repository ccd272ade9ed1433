/*
 * Prints the tactile events of frames that arrive in stripes, as a camera's DMA delivers them. Here they come from a file:
 *
 *     events FRAMES WIDTH HEIGHT [MODEL.wsm]      8 bits of gray, frames back to back, as wstac run --save-raw writes them
 *
 * On a board, the loop is in an interrupt or a task, FRAMES is the camera, and the model is in flash.
 */
#include <stdio.h>
#include <stdlib.h>

#include "wstac_fw.h"

#define STRIPE_ROWS 8
#define MOST_WIDTH 2048

/* All memory that the library uses. Each sensor needs one of these. */
static WstacFwPipeline pipeline;
static WstacFwModel model;
static uint8_t rows[STRIPE_ROWS * MOST_WIDTH];
static uint32_t model_words[24 * 1024];
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];

_Static_assert(sizeof(WstacFwPipeline) == WSTAC_FW_PIPELINE_SIZE, "header and library");
_Static_assert(_Alignof(WstacFwPipeline) == WSTAC_FW_PIPELINE_ALIGN, "header and library");

/* A status below 0 is an error: nothing has changed, and the text tells the reason. */
static void check(WstacFwStatus status, const char *what)
{
    if (status < 0) {
        fprintf(stderr, "%s: %s\n", what, wstac_fw_status_text(status));
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

static void print_event(bool with_model)
{
    static const char *const contacts[] = {"unclear", "slide", "press", "poke"};
    WstacFwEvent event;
    WstacFwMotion motion;
    WstacFwTexture texture;
    check(wstac_fw_event(&pipeline, &event), "event");
    check(wstac_fw_motion(&pipeline, &motion), "motion");
    printf("frame=%llu contact=%s", (unsigned long long)event.frame, contacts[motion.contact]);
    /* Only a slide has a speed, a direction and a texture. */
    if (motion.contact != WSTAC_FW_CONTACT_SLIDE) {
        printf(" speed=- direction=- texture=-\n");
        return;
    }
    printf(" speed=%.2f direction=%.1f", (double)motion.mm_s, (double)motion.degrees);
    if (with_model) {
        check(wstac_fw_sample(&pipeline, sample), "sample");
        check(wstac_fw_classify(&model, sample, &motion, &texture), "texture");
    }
    printf(" texture=%s\n", with_model && texture.known != 0 ? texture.label : "-");
}

/* Prints that the touch of an event has ended, if the last call has found out. */
static void print_contact_end(void)
{
    WstacFwContactEnd end;
    WstacFwStatus status = wstac_fw_take_contact_end(&pipeline, &end);
    check(status, "contact end");
    if (status == WSTAC_FW_STATUS_OK)
        printf("frame=%llu end of the touch of event %llu\n", (unsigned long long)end.frame, (unsigned long long)end.event_frame);
}

int main(int argc, char **argv)
{
    if (argc < 4 || argc > 5) {
        fputs("arguments are FRAMES WIDTH HEIGHT [MODEL.wsm]\n", stderr);
        return 2;
    }
    WstacFwOptions options = {
        .format = &WSTAC_FW_GREY,
        .width = (uint32_t)strtoul(argv[2], NULL, 10),
        .height = (uint32_t)strtoul(argv[3], NULL, 10),
        .readout_known = 1, /* and readout_ms = 0: a global shutter */
    };
    check(wstac_fw_init(&pipeline, sizeof pipeline, &options), "options");
    if (options.width > MOST_WIDTH) {
        fprintf(stderr, "width is %s, expected at most %d\n", argv[2], MOST_WIDTH);
        return 1;
    }
    if (argc == 5) {
        FILE *file = open_file(argv[4]);
        size_t bytes = fread(model_words, 1, sizeof model_words, file);
        fclose(file);
        check(wstac_fw_model_init(&model, sizeof model, (const uint8_t *)model_words, bytes), argv[4]);
    }
    FILE *frames = open_file(argv[1]);
    uint32_t row = 0;
    for (;;) {
        uint32_t count = options.height - row < STRIPE_ROWS ? options.height - row : STRIPE_ROWS;
        size_t bytes = (size_t)count * options.width;
        if (fread(rows, 1, bytes, frames) != bytes)
            break;
        row = row + count == options.height ? 0 : row + count;
        WstacFwStatus status = wstac_fw_push_stripe(&pipeline, rows, bytes);
        check(status, argv[1]);
        if (status == WSTAC_FW_STATUS_EVENT)
            print_event(argc == 5);
        print_contact_end();
    }
    fclose(frames);
    WstacFwStatus status = wstac_fw_finish(&pipeline);
    check(status, "finish");
    if (status == WSTAC_FW_STATUS_EVENT)
        print_event(argc == 5);
    print_contact_end();
    return 0;
}
