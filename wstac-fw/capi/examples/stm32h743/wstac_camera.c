/*
 * Stripes of a camera's frames, from the interrupts of a circular DMA into the pipeline, and messages to a host.
 *
 * Interrupts only count stripes and move bytes of the line. All else is in wstac_camera_poll, so that the library has
 * one user. A frame that was not whole is lost: the host is told, and the capture starts again at the next frame.
 */
#include "wstac_camera.h"

#include <stdbool.h>
#include <string.h>

#include "wstac_fw.h"

#define ROW_BYTES (WSTAC_CAMERA_WIDTH * WSTAC_CAMERA_PIXEL_BYTES)
#define STRIPE_BYTES (WSTAC_CAMERA_STRIPE_ROWS * ROW_BYTES)
#define BUFFER_WORDS (2 * STRIPE_BYTES / 4)
#define STRIPES (WSTAC_CAMERA_HEIGHT / WSTAC_CAMERA_STRIPE_ROWS)
#define STATUS_MS 1000u

#if WSTAC_CAMERA_HEIGHT % (2 * WSTAC_CAMERA_STRIPE_ROWS) != 0
#error "a frame has to be an even number of stripes, so that each frame begins where the DMA's buffer does"
#endif
#if 2 * WSTAC_CAMERA_STRIPE_ROWS * WSTAC_CAMERA_WIDTH * WSTAC_CAMERA_PIXEL_BYTES / 4 > 65535
#error "the DMA counts at most 65535 words: take fewer rows per stripe"
#endif
#if WSTAC_CAMERA_STRIPE_ROWS * WSTAC_CAMERA_WIDTH * WSTAC_CAMERA_PIXEL_BYTES % 32 != 0
#error "a stripe has to be whole lines of the cache, which have 32 bytes"
#endif
#if WSTAC_FW_VERSION < 0x000300
#error "wstac_fw.h has no link: version 0.3.0 or later is expected"
#endif

/*
 * The DMA's buffer. DMA1 and DMA2 of an STM32H7 do not reach the DTCM at 0x20000000. If the linker script puts .bss there,
 * it has to put .bss.dma_buffer into the SRAM at 0x24000000 or 0x30000000.
 */
static uint8_t dma_buffer[2 * STRIPE_BYTES] __attribute__((section(".bss.dma_buffer"), aligned(32)));
/* The stripe that is read, while the DMA may already write to its place. */
static uint8_t stripe[STRIPE_BYTES];

static DCMI_HandleTypeDef *camera;
/* The stripes that have arrived since the capture started, and those of whole frames. Interrupts count both. */
static volatile uint32_t arrived, framed;
/* The capture has to start again. */
static volatile bool broken;
/* The stripes that were taken, and those of the frame that has begun. */
static uint32_t taken, in_frame;
/* The last frame that has begun did so at this time. */
static bool has_frame;
static uint32_t frame_ms;
static uint32_t overruns;

static WstacFwPipeline pipeline;
static WstacFwModel texture_model;
static bool has_model;
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];

static WstacFwLink line;
static WstacFwWanted wanted;
static WstacFwBoard board;
static uint32_t chip[3];
static uint32_t status_ms;

/* The line: bytes between wstac_camera_poll, which is behind one end, and the interrupt, which is behind the other. */
static UART_HandleTypeDef *serial;
static uint8_t to_host[2048], from_host[64], received;
static volatile uint32_t to_host_head, to_host_tail, from_host_head, from_host_tail;
static volatile uint32_t sending;
static volatile bool deaf;

/* ---- Interrupts ---- */

static void stripe_arrived(DMA_HandleTypeDef *dma)
{
    (void)dma;
    arrived++;
}

/*
 * A frame has ended. Its last stripe has arrived if the DMA's interrupt has at least the priority of the DCMI's. Bytes
 * too few or too many would shift all frames behind it.
 */
void HAL_DCMI_FrameEventCallback(DCMI_HandleTypeDef *dcmi)
{
    if (arrived - framed != STRIPES || __HAL_DMA_GET_COUNTER(dcmi->DMA_Handle) != BUFFER_WORDS)
        broken = true;
    framed = arrived;
    /* The HAL switches it off with each frame. */
    __HAL_DCMI_ENABLE_IT(dcmi, DCMI_IT_FRAME);
}

/* Pixels came faster than the DMA took them, or out of order. The HAL has stopped the DMA. */
void HAL_DCMI_ErrorCallback(DCMI_HandleTypeDef *dcmi)
{
    (void)dcmi;
    overruns++;
    broken = true;
}

/* Sends what waits, as far as it lies in one piece. */
static void send_next(void)
{
    uint32_t at = to_host_tail % sizeof to_host;
    uint32_t count = to_host_head - to_host_tail;
    if (count > sizeof to_host - at)
        count = sizeof to_host - at;
    sending = count;
    if (count != 0 && HAL_UART_Transmit_IT(serial, to_host + at, (uint16_t)count) != HAL_OK)
        sending = 0; /* wstac_camera_poll tries again. */
}

void HAL_UART_TxCpltCallback(UART_HandleTypeDef *uart)
{
    (void)uart;
    to_host_tail += sending;
    send_next();
}

static void listen(void)
{
    deaf = HAL_UART_Receive_IT(serial, &received, 1) != HAL_OK;
}

void HAL_UART_RxCpltCallback(UART_HandleTypeDef *uart)
{
    (void)uart;
    /* A byte without a place is lost. The host sends requests again. */
    if (from_host_head - from_host_tail < sizeof from_host) {
        from_host[from_host_head % sizeof from_host] = received;
        from_host_head++;
    }
    listen();
}

/* The HAL has stopped to receive: noise, or a byte too many. */
void HAL_UART_ErrorCallback(UART_HandleTypeDef *uart)
{
    (void)uart;
    deaf = true;
}

/* ---- The line ---- */

static uint8_t message[WSTAC_FW_LINK_BYTES];
static size_t length;

/* Sends the message that a call has written. One without room is left out: the host sees that, and events come again. */
static void send_message(WstacFwStatus status)
{
    if (status != WSTAC_FW_STATUS_OK || sizeof to_host - (to_host_head - to_host_tail) < length)
        return;
    for (size_t i = 0; i < length; i++)
        to_host[(to_host_head + i) % sizeof to_host] = message[i];
    to_host_head += (uint32_t)length;
}

static void send_state(void)
{
    WstacFwTelemetry state = {HAL_GetTick(), -1, (int64_t)overruns, -1, -1};
    send_message(wstac_fw_link_status(&line, &pipeline, message, &length));
    send_message(wstac_fw_link_telemetry(&line, &state, message, &length));
    status_ms = HAL_GetTick();
}

static void read_requests(void)
{
    if (deaf)
        listen();
    while (from_host_tail != from_host_head) {
        uint8_t byte = from_host[from_host_tail % sizeof from_host];
        from_host_tail++;
        if (wstac_fw_link_receive(&line, &byte, 1, &wanted) == WSTAC_FW_STATUS_OK && wanted.hello)
            send_message(wstac_fw_link_hello(&line, &pipeline, &board, message, &length));
    }
}

static void send_event(void)
{
    WstacFwMotion motion;
    WstacFwTexture texture;
    WstacFwAnswers answers = {&motion, NULL, NULL, NULL};
    if (wstac_fw_motion(&pipeline, &motion) != WSTAC_FW_STATUS_OK)
        return;
    /* Only a slide has a texture. */
    if (has_model && motion.contact == WSTAC_FW_CONTACT_SLIDE &&
        wstac_fw_sample(&pipeline, sample) == WSTAC_FW_STATUS_OK &&
        wstac_fw_classify(&texture_model, sample, &motion, &texture) == WSTAC_FW_STATUS_OK)
        answers.texture = &texture;
    for (uint32_t part = 0; wanted.samples && part < WSTAC_FW_SAMPLE_PARTS; part++)
        send_message(wstac_fw_link_sample(&line, &pipeline, part, message, &length));
    send_message(wstac_fw_link_event(&line, &pipeline, &answers, message, &length));
}

/* Sends what a push has found. The event comes before the end of its touch. */
static void send_results(WstacFwStatus status)
{
    WstacFwContactEnd end;
    WstacFwIncomplete incomplete;
    if (wanted.features)
        send_message(wstac_fw_link_features(&line, &pipeline, message, &length));
    if (wstac_fw_take_interrupted(&pipeline, &incomplete) == WSTAC_FW_STATUS_OK)
        send_message(wstac_fw_link_interrupted(&line, &incomplete, message, &length));
    if (status == WSTAC_FW_STATUS_EVENT)
        send_event();
    if (wstac_fw_take_contact_end(&pipeline, &end) == WSTAC_FW_STATUS_OK)
        send_message(wstac_fw_link_contact_end(&line, &end, message, &length));
}

/* ---- Frames ---- */

static void start_capture(void)
{
    broken = false;
    arrived = framed = 0;
    taken = in_frame = 0;
    /* The HAL's DCMI has no half of a buffer; its DMA has. The callback has to be there before the start. */
    camera->DMA_Handle->XferHalfCpltCallback = stripe_arrived;
    if (HAL_DCMI_Start_DMA(camera, DCMI_MODE_CONTINUOUS, (uint32_t)(uintptr_t)dma_buffer, BUFFER_WORDS) != HAL_OK)
        broken = true;
    /* In place of the HAL's own callback, which is for a frame in one piece. */
    camera->DMA_Handle->XferCpltCallback = stripe_arrived;
    __HAL_DCMI_ENABLE_IT(camera, DCMI_IT_FRAME);
}

/* The HAL waits here for the end of the frame. */
static void start_again(void)
{
    HAL_DCMI_Stop(camera);
    if (in_frame != 0) {
        send_message(wstac_fw_link_lost(&line, 1, message, &length));
        send_results(wstac_fw_abandon_frame(&pipeline));
    }
    start_capture();
}

/* A frame begins. Keeps the places in time of those that have not come since the last one. */
static void begin_frame(void)
{
    uint32_t now = HAL_GetTick();
    /* In 64 bits, for a camera that has been silent for weeks. */
    uint64_t periods = ((uint64_t)(now - frame_ms) * WSTAC_CAMERA_FPS + 500u) / 1000u;
    if (has_frame && periods > 1) {
        uint32_t missing = (uint32_t)(periods - 1);
        send_message(wstac_fw_link_lost(&line, missing, message, &length));
        send_results(wstac_fw_push_lost(&pipeline, missing));
    }
    has_frame = true;
    frame_ms = now;
}

static void take_stripe(void)
{
    uint8_t *from = dma_buffer + taken % 2 * STRIPE_BYTES;
    WstacFwStatus status;
    SCB_InvalidateDCache_by_Addr(from, (int32_t)STRIPE_BYTES);
    memcpy(stripe, from, STRIPE_BYTES);
    if (arrived - taken > 1) {
        /* The DMA has begun to write there again: this program was too late. */
        overruns++;
        broken = true;
        return;
    }
    if (in_frame == 0)
        begin_frame();
    taken++;
    in_frame++;
    status = wstac_fw_push_stripe(&pipeline, stripe, STRIPE_BYTES);
    if (status < 0)
        broken = true;
    if (in_frame == STRIPES) {
        in_frame = 0;
        send_results(status);
    }
}

void wstac_camera_start(DCMI_HandleTypeDef *dcmi, UART_HandleTypeDef *uart, const uint8_t *model, size_t model_bytes)
{
    WstacFwOptions options; /* zeros are the defaults */
    memset(&options, 0, sizeof options);
    options.format = &WSTAC_CAMERA_FORMAT;
    options.width = WSTAC_CAMERA_WIDTH;
    options.height = WSTAC_CAMERA_HEIGHT;
    options.fps_numerator = WSTAC_CAMERA_FPS;
    options.fps_denominator = 1;
#ifdef WSTAC_CAMERA_READOUT_MS
    options.readout_known = 1;
    options.readout_ms = WSTAC_CAMERA_READOUT_MS;
#endif
    camera = dcmi;
    serial = uart;
    has_model = model != NULL && wstac_fw_model_init(&texture_model, sizeof texture_model, model, model_bytes) >= 0;
    if (wstac_fw_init(&pipeline, sizeof pipeline, &options) < 0 || wstac_fw_link_init(&line, sizeof line) < 0)
        return;
    chip[0] = HAL_GetUIDw0();
    chip[1] = HAL_GetUIDw1();
    chip[2] = HAL_GetUIDw2();
    board.firmware = "stm32h743 with HAL";
    board.version = "1.0";
    board.format = options.format;
    board.model = has_model ? &texture_model : NULL;
    board.id = chip;
    send_message(wstac_fw_link_hello(&line, &pipeline, &board, message, &length));
    status_ms = HAL_GetTick();
    listen();
    start_capture();
}

void wstac_camera_poll(void)
{
    read_requests();
    /* The first stripe of a frame is taken behind the end of the frame before it, or else it may be a row too many of it. */
    while (!broken && taken != arrived && (in_frame != 0 || taken == framed))
        take_stripe();
    /* Neither half of the buffer has what comes next. */
    if (arrived - taken > 2)
        broken = true;
    if (broken)
        start_again();
    send_message(wstac_fw_link_due(&line, HAL_GetTick(), message, &length));
    /* With and without frames: a silent board is a lost board. */
    if (HAL_GetTick() - status_ms >= STATUS_MS)
        send_state();
    if (sending == 0)
        send_next();
}
