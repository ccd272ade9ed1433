/*
 * Measures the stack and the instructions of each call of the firmware library on a board, as the maximum over a whole stream. The memory
 * below the stack pointer is painted before each call. Instructions are those that RISC-V's own counter counts; on Arm they are 0.
 *
 *     stack FRAMES WIDTH HEIGHT MODEL.wsm
 */
#include <stdint.h>

#include "expect.h"
#include "wstac_fw.h"

#define PAINTED 16384
#define PAINT 0xA5A5A5A5u

static WstacFwPipeline pipeline;
static WstacFwLink line;
static WstacFwModel model;
static uint32_t model_words[24 * 1024];
static uint8_t frame[512 * 1024];
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];
static WstacFwOptions options = {.format = &WSTAC_FW_GREY};
static size_t model_bytes, frame_bytes;
static WstacFwStatus status;

static void call_init(void) { status = wstac_fw_init(&pipeline, sizeof pipeline, &options); }
static void call_model_init(void) { status = wstac_fw_model_init(&model, sizeof model, (uint8_t *)model_words, model_bytes); }
static void call_push(void) { status = wstac_fw_push_stripe(&pipeline, frame, frame_bytes); }
static void call_sample(void) { status = wstac_fw_sample(&pipeline, sample); }

static void call_speed(void)
{
    WstacFwSpeed speed;
    status = wstac_fw_speed(&pipeline, &speed);
}

static void call_direction(void)
{
    WstacFwDirection direction;
    status = wstac_fw_direction(&pipeline, &direction);
}

static void call_motion(void)
{
    WstacFwMotion motion;
    status = wstac_fw_motion(&pipeline, &motion);
}

static void call_motion_by_edges(void)
{
    WstacFwMotion motion;
    status = wstac_fw_motion_by_edges(&pipeline, &motion);
}

static void call_link_event(void)
{
    static WstacFwMotion motion;
    static uint8_t bytes[WSTAC_FW_LINK_BYTES];
    static size_t length;
    const WstacFwAnswers answers = {.motion = &motion};
    status = wstac_fw_link_event(&line, &pipeline, &answers, bytes, &length);
}

static void call_link_receive(void)
{
    /* A request for a description of the board. */
    static const uint8_t request[] = {0, 0x03, 0x04, 0x01, 0x05, 0x8F, 0x40, 0x53, 0xE1, 0};
    WstacFwWanted wanted;
    status = wstac_fw_link_receive(&line, request, sizeof request, &wanted);
    status = status == WSTAC_FW_STATUS_OK && !wanted.hello ? WSTAC_FW_STATUS_STATE : status;
}

static void call_classify(void)
{
    WstacFwTexture texture;
    status = wstac_fw_classify(&model, sample, NULL, &texture);
}

#ifdef __riscv
#define READ_SP "mv %0, sp"
#else
#define READ_SP "mov %0, sp"
#endif

static uint32_t instructions(void)
{
    uint32_t count = 0;
#ifdef __riscv
    __asm__ volatile(".option push\n.option arch, +zicsr\ncsrr %0, minstret\n.option pop" : "=r"(count));
#endif
    return count;
}

/* What a call takes. */
typedef struct {
    uint32_t stack, instructions;
} Taken;

/* Returns what a call takes, its stack below this function's own frame. */
static __attribute__((noinline)) Taken taken(void (*call)(void))
{
    uint32_t top, before;
    __asm__ volatile(READ_SP : "=r"(top));
    volatile uint32_t *bottom = (volatile uint32_t *)(uintptr_t)(top - PAINTED);
    for (uint32_t i = 0; i < PAINTED / 4; i++)
        bottom[i] = PAINT;
    before = instructions();
    call();
    before = instructions() - before;
    uint32_t unused = 0;
    while (unused < PAINTED / 4 && bottom[unused] == PAINT)
        unused++;
    EXPECT(unused > 0);
    return (Taken){PAINTED - 4 * unused, before};
}

static void keep(Taken *most, void (*call)(void))
{
    Taken now = taken(call);
    EXPECT(status >= 0);
    most->stack = now.stack > most->stack ? now.stack : most->stack;
    most->instructions = now.instructions > most->instructions ? now.instructions : most->instructions;
}

static void print(const char *call, const Taken *most)
{
    printf("%s %lu %lu\n", call, (unsigned long)most->stack, (unsigned long)most->instructions);
}

int main(int argc, char **argv)
{
    Taken init = {0, 0}, push = init, speed = init, direction = init, motion = init, by_edges = init, take_sample = init;
    Taken model_init = init, classify = init, link_event = init, link_receive = init;
    EXPECT(argc == 5);
    FILE *file = fopen(argv[4], "rb");
    EXPECT(file != NULL);
    model_bytes = fread(model_words, 1, sizeof model_words, file);
    fclose(file);
    options.width = (uint32_t)atoi(argv[2]), options.height = (uint32_t)atoi(argv[3]);
    frame_bytes = (size_t)options.width * options.height;
    EXPECT(frame_bytes <= sizeof frame);
    keep(&init, call_init);
    keep(&model_init, call_model_init);
    EXPECT(wstac_fw_link_init(&line, sizeof line) == WSTAC_FW_STATUS_OK);
    keep(&link_receive, call_link_receive);
    file = fopen(argv[1], "rb");
    EXPECT(file != NULL);
    while (fread(frame, 1, frame_bytes, file) == frame_bytes) {
        keep(&push, call_push);
        if (status == WSTAC_FW_STATUS_EVENT) {
            keep(&speed, call_speed);
            keep(&direction, call_direction);
            keep(&motion, call_motion);
            keep(&by_edges, call_motion_by_edges);
            keep(&take_sample, call_sample);
            keep(&classify, call_classify);
            keep(&link_event, call_link_event);
        }
    }
    fclose(file);
    print("init", &init), print("push", &push), print("motion", &motion), print("motion_by_edges", &by_edges);
    print("speed", &speed), print("direction", &direction), print("sample", &take_sample);
    print("model_init", &model_init), print("classify", &classify);
    print("link_event", &link_event), print("link_receive", &link_receive);
    return 0;
}
