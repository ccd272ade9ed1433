/*
 * Runs the example of the STM32H743 on a model of ST's HAL: a camera that sends frames of a file row by row, a circular
 * DMA with two halves, a line of 115200 bits per second, and interrupts between any two rows.
 *
 *     hal FRAMES WIDTH HEIGHT MODEL.wsm [SPEED] [FAULT=FRAME…]
 *
 * Bytes to the host go to standard output. With a SPEED, bytes of the host come from standard input, and the clock runs
 * so many times as fast as the machine's. Faults of a frame: `short` loses its last rows, `long` has its last rows twice,
 * `missing` never comes, `overrun` stops its DMA as the HAL does, `late` keeps the program from its loop, `noise` ends a
 * reception with an error.
 */
#include <stdbool.h>

#include "wstac_camera.h"

#include "../expect.h"

#if defined(__unix__)
#include <fcntl.h>
#include <time.h>
#include <unistd.h>
#endif

#define FRAME_US (1000000u / WSTAC_CAMERA_FPS)
#define TIME_BEHIND_US 5000000u
#define BYTE_US 87u
/* The rows of a frame that is too short or too long: more than a stripe. */
#define LAST_ROWS 12u

static DCMI_TypeDef dcmi_registers;
static DMA_Stream_TypeDef stream;
static DMA_HandleTypeDef dma = {&stream, NULL, NULL};
static DCMI_HandleTypeDef dcmi = {&dcmi_registers, &dma};
static UART_HandleTypeDef uart;

static uint64_t now_us;
static unsigned long speed;

/* The capture: it begins with the frame that follows the start. */
static enum { OFF, WAITING, ON } capture;
static uint8_t *buffer;
static uint32_t buffer_bytes, at;

/* The line. */
static const uint8_t *to_send;
static uint16_t to_send_bytes;
static uint64_t sent_us;
static uint8_t *place;

static uint8_t frame[512 * 1024];
static uint32_t model[24 * 1024];

static struct {
    const char *name;
    unsigned long frame;
} faults[8];
static int fault_count;

static bool has_fault(const char *name, unsigned long number)
{
    for (int i = 0; i < fault_count; i++)
        if (strcmp(faults[i].name, name) == 0 && faults[i].frame == number)
            return true;
    return false;
}

HAL_StatusTypeDef HAL_DCMI_Start_DMA(DCMI_HandleTypeDef *hdcmi, uint32_t DCMI_Mode, uint32_t pData, uint32_t Length)
{
    EXPECT(hdcmi == &dcmi && DCMI_Mode == DCMI_MODE_CONTINUOUS && capture == OFF);
    /* More words are two buffers of another kind. */
    EXPECT(Length > 0 && Length <= 0xFFFF && pData % 4 == 0);
    EXPECT(dma.XferHalfCpltCallback != NULL);
    buffer = (uint8_t *)(uintptr_t)pData;
    buffer_bytes = 4 * Length;
    at = 0;
    stream.NDTR = Length;
    dma.XferCpltCallback = NULL;
    capture = WAITING;
    return HAL_OK;
}

HAL_StatusTypeDef HAL_DCMI_Stop(DCMI_HandleTypeDef *hdcmi)
{
    EXPECT(hdcmi == &dcmi);
    capture = OFF;
    return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Transmit_IT(UART_HandleTypeDef *huart, const uint8_t *pData, uint16_t Size)
{
    EXPECT(huart == &uart && pData != NULL && Size > 0);
    if (to_send != NULL)
        return HAL_BUSY;
    to_send = pData;
    to_send_bytes = Size;
    sent_us = now_us + (uint64_t)BYTE_US * Size;
    return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Receive_IT(UART_HandleTypeDef *huart, uint8_t *pData, uint16_t Size)
{
    EXPECT(huart == &uart && pData != NULL && Size == 1);
    if (place != NULL)
        return HAL_BUSY;
    place = pData;
    return HAL_OK;
}

uint32_t HAL_GetTick(void) { return (uint32_t)(now_us / 1000); }
uint32_t HAL_GetUIDw0(void) { return 1; }
uint32_t HAL_GetUIDw1(void) { return 2; }
uint32_t HAL_GetUIDw2(void) { return 3; }

void SCB_InvalidateDCache_by_Addr(volatile void *addr, int32_t dsize)
{
    /* Other lines of the cache would lose what was written to them. */
    EXPECT((uintptr_t)addr % 32 == 0 && dsize % 32 == 0);
}

/* A byte of the host; -1 if there is none. */
static int next_byte(void)
{
#if defined(__unix__)
    uint8_t byte;
    if (speed != 0 && read(0, &byte, 1) == 1)
        return byte;
#endif
    return -1;
}

static void line_goes_on(void)
{
    int byte;
    if (to_send != NULL && now_us >= sent_us) {
        EXPECT(fwrite(to_send, 1, to_send_bytes, stdout) == to_send_bytes);
        fflush(stdout);
        to_send = NULL;
        HAL_UART_TxCpltCallback(&uart);
    }
    if (place != NULL && (byte = next_byte()) >= 0) {
        *place = (uint8_t)byte;
        place = NULL;
        HAL_UART_RxCpltCallback(&uart);
    }
}

static void wait_until(uint64_t us)
{
    now_us = us;
#if defined(__unix__)
    static uint64_t start;
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    uint64_t real = (uint64_t)time.tv_sec * 1000000u + (uint64_t)time.tv_nsec / 1000;
    if (start == 0)
        start = real;
    uint64_t due = speed == 0 ? 0 : start + us / speed;
    if (due > real)
        usleep((useconds_t)(due - real));
#endif
}

/* The DMA takes the bytes of a row, and interrupts at each half of its buffer. */
static void row_arrives(const uint8_t *row, uint32_t bytes)
{
    for (uint32_t i = 0; i < bytes && capture == ON; i++) {
        buffer[at++] = row[i];
        /* The count begins anew at its end. */
        stream.NDTR = (buffer_bytes - at % buffer_bytes) / 4;
        if (at == buffer_bytes / 2)
            dma.XferHalfCpltCallback(&dma);
        if (at == buffer_bytes) {
            at = 0;
            EXPECT(dma.XferCpltCallback != NULL);
            dma.XferCpltCallback(&dma);
        }
    }
}

static void frame_arrives(unsigned long number, uint32_t row_bytes, uint32_t rows)
{
    uint64_t start = (uint64_t)number * FRAME_US;
    if (capture == WAITING && !has_fault("missing", number))
        capture = ON;
    for (uint32_t row = 0; row < rows; row++) {
        /* The last fifth of a frame's time has no rows. */
        wait_until(start + (uint64_t)row * FRAME_US * 4 / 5 / rows);
        bool is_last = row + LAST_ROWS >= rows;
        if (!has_fault("missing", number) && !(has_fault("short", number) && is_last))
            row_arrives(frame + row * row_bytes, row_bytes);
        if (has_fault("long", number) && is_last)
            row_arrives(frame + row * row_bytes, row_bytes);
        if (has_fault("overrun", number) && row == rows / 2) {
            capture = OFF;
            HAL_DCMI_ErrorCallback(&dcmi);
        }
        if (has_fault("noise", number) && row == 0) {
            place = NULL;
            HAL_UART_ErrorCallback(&uart);
        }
        line_goes_on();
        if (!has_fault("late", number) || row < rows / 4 || row > rows / 2)
            wstac_camera_poll();
    }
    if (capture == ON && !has_fault("missing", number) && (dcmi_registers.IER & DCMI_IT_FRAME) != 0) {
        dcmi_registers.IER &= ~DCMI_IT_FRAME;
        HAL_DCMI_FrameEventCallback(&dcmi);
    }
    wait_until(start + (uint64_t)FRAME_US * 9 / 10);
    line_goes_on();
    wstac_camera_poll();
}

static FILE *open_file(const char *name)
{
    FILE *file = fopen(name, "rb");
    EXPECT(file != NULL);
    return file;
}

int main(int argc, char **argv)
{
    uint32_t row_bytes, rows;
    unsigned long number = 0;
    EXPECT(argc >= 5);
    row_bytes = (uint32_t)atoi(argv[2]) * WSTAC_CAMERA_PIXEL_BYTES;
    rows = (uint32_t)atoi(argv[3]);
    EXPECT(row_bytes == WSTAC_CAMERA_WIDTH * WSTAC_CAMERA_PIXEL_BYTES && rows == WSTAC_CAMERA_HEIGHT);
    EXPECT((size_t)row_bytes * rows <= sizeof frame);
    for (int i = 5; i < argc; i++) {
        char *equals = strchr(argv[i], '=');
        if (equals == NULL) {
            speed = strtoul(argv[i], NULL, 10);
            continue;
        }
        *equals = 0;
        faults[fault_count].name = argv[i];
        faults[fault_count++].frame = strtoul(equals + 1, NULL, 10);
    }
#if defined(__unix__)
    EXPECT(speed == 0 || fcntl(0, F_SETFL, O_NONBLOCK) == 0);
#endif
    FILE *file = open_file(argv[4]);
    size_t model_bytes = fread(model, 1, sizeof model, file);
    fclose(file);
    file = open_file(argv[1]);
    wstac_camera_start(&dcmi, &uart, (const uint8_t *)model, model_bytes);
    while (fread(frame, 1, (size_t)row_bytes * rows, file) == (size_t)row_bytes * rows)
        frame_arrives(number++, row_bytes, rows);
    fclose(file);
    /* The camera is silent, and what has not arrived at the host is sent again. */
    uint64_t end = now_us + TIME_BEHIND_US;
    while (now_us < end) {
        wait_until(now_us + 1000);
        line_goes_on();
        wstac_camera_poll();
    }
    return 0;
}
