/*
 * A stub of esp32-camera, whose frames come from a file:
 *
 *     camera FRAMES [PERIOD_US [FAULT=FRAME…]]
 *
 * FAULT is none (no frame in time), short or long (a byte), format, size, back (an earlier time), missing, or reset (the
 * clock begins again). The program ends with the file, and with an error if a buffer was not given back, or given back
 * twice.
 */
#include "esp_camera.h"

#include <fcntl.h>
#include <unistd.h>

#include "../expect.h"
#include "wstac_esp32.h"

void app_main(void);

static int file, argument_count;
static char **arguments;
static long period_us = 33333, number, reset;
static camera_config_t settings;
static uint8_t bytes[320 * 240];
static camera_fb_t frame;
static size_t out;
static int locked;

static int lock(sensor_t *sensor, int enable)
{
    (void)sensor;
    locked += enable == 0;
    return 0;
}

static sensor_t chip = {lock, lock, lock, lock, lock};

sensor_t *esp_camera_sensor_get(void)
{
    return &chip;
}

esp_err_t esp_camera_init(const camera_config_t *config)
{
    settings = *config;
    EXPECT(settings.frame_size == FRAMESIZE_QVGA && settings.pixel_format == PIXFORMAT_GRAYSCALE);
    EXPECT(settings.fb_count == 2 && settings.grab_mode == CAMERA_GRAB_LATEST && settings.xclk_freq_hz == 20000000);
    return ESP_OK;
}

/* Reads the next frame. Ends the program with the file. */
static void read_frame(void)
{
    size_t at = 0;
    while (at < sizeof bytes) {
        ssize_t count = read(file, bytes + at, sizeof bytes - at);
        if (count <= 0)
            exit(at == 0 ? 0 : 1);
        at += (size_t)count;
    }
    number++;
}

static bool has(const char *fault)
{
    size_t length = strlen(fault);
    for (int i = 3; i < argument_count; i++) {
        const char *at = arguments[i];
        if (strncmp(at, fault, length) == 0 && at[length] == '=' && atol(at + length + 1) == number)
            return true;
    }
    return false;
}

camera_fb_t *esp_camera_fb_get(void)
{
    int64_t time_us;
    EXPECT(out == 0 && locked == 5);
    do {
        read_frame();
    } while (has("missing"));
    if (has("none"))
        return NULL;
    if (has("reset"))
        reset = number;
    time_us = 5000000 + (int64_t)period_us * (has("back") ? number - 2 : number - reset);
    frame.buf = bytes;
    frame.len = sizeof bytes - has("short") + has("long");
    frame.width = has("size") ? 240 : 320;
    frame.height = has("size") ? 320 : 240;
    frame.format = has("format") ? PIXFORMAT_JPEG : PIXFORMAT_GRAYSCALE;
    frame.timestamp.tv_sec = time_us / 1000000;
    frame.timestamp.tv_usec = time_us % 1000000;
    out++;
    return &frame;
}

void esp_camera_fb_return(camera_fb_t *fb)
{
    EXPECT(fb == &frame && out == 1);
    out--;
}

static unsigned reports;

static void count(WstacFwPipeline *pipeline, WstacFwStatus status)
{
    EXPECT(pipeline != NULL && status >= 0);
    reports++;
}

/* What the examples do not show: options and frames that are refused, and a gap of hours. */
static void edges_are_checked(void)
{
    static WstacEsp32 sensor;
    static const uint8_t dark[100];
    WstacFwOptions options = {.format = &WSTAC_FW_GREY, .width = 10, .height = 10, .fps_denominator = 1};
    EXPECT(wstac_esp32_init(&sensor, &options, count) == WSTAC_FW_STATUS_FRAME_RATE);
    options.fps_numerator = 1000001;
    EXPECT(wstac_esp32_init(&sensor, &options, count) == WSTAC_FW_STATUS_FRAME_RATE);
    options.fps_numerator = 30;
    EXPECT(wstac_esp32_init(NULL, &options, count) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_esp32_init(&sensor, NULL, count) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_esp32_init(&sensor, &options, NULL) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_esp32_init(&sensor, &options, count) == WSTAC_FW_STATUS_OK);
    EXPECT(wstac_esp32_take(NULL, dark, sizeof dark, 0) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_esp32_take(&sensor, NULL, sizeof dark, 0) == WSTAC_FW_STATUS_NULL);
    EXPECT(wstac_esp32_take(&sensor, dark, sizeof dark, INT64_MIN) == WSTAC_FW_STATUS_OK);
    EXPECT(sensor.used == 1 && reports == 1);
    EXPECT(wstac_esp32_take(&sensor, dark, 99, INT64_MIN + 33333) == WSTAC_FW_STATUS_FRAME_TOO_SHORT);
    EXPECT(sensor.used == 1 && sensor.lost == 1 && reports == 2);
    EXPECT(wstac_esp32_take(&sensor, dark, sizeof dark, INT64_MAX) == WSTAC_FW_STATUS_OK);
    EXPECT(sensor.used == 2 && sensor.lost == 108000 && reports == 4);
}

int main(int argc, char **argv)
{
    EXPECT(argc >= 2);
    edges_are_checked();
    argument_count = argc, arguments = argv;
    if (argc > 2)
        period_us = atol(argv[2]);
    file = open(argv[1], O_RDONLY);
    EXPECT(file >= 0);
    app_main();
    return 1;
}
