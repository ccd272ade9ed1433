/*
 * Frames of Espressif's esp32-camera, which is for the ESP32, ESP32-S2 and ESP32-S3. Programs of other chips, such as
 * the ESP32-P4, give their frames to wstac_esp32_take.
 */
#ifndef WSTAC_ESP32_CAMERA_H
#define WSTAC_ESP32_CAMERA_H

/* The first, because esp_camera.h takes types from what is included before it. */
#include "wstac_esp32.h"

#include "esp_camera.h"

/*
 * Returns the format of the camera's pixels; NULL if the library has none. RGB565 of esp32-camera has its bytes in the
 * other order.
 */
static inline const WstacFwFormat *wstac_esp32_format(pixformat_t format)
{
    return format == PIXFORMAT_GRAYSCALE ? &WSTAC_FW_GREY : format == PIXFORMAT_YUV422 ? &WSTAC_FW_YUYV : NULL;
}

/* Returns what is wrong with a frame; NULL if nothing is. */
static inline const char *wstac_esp32_wrong(const WstacEsp32 *sensor, const camera_fb_t *frame)
{
    const WstacFwFormat *format = wstac_esp32_format(frame->format);
    const WstacFwOptions *options = &sensor->options;
    if (format == NULL || format != options->format)
        return "a frame has another pixel format, expected PIXFORMAT_GRAYSCALE or PIXFORMAT_YUV422, as in the options";
    if (frame->width != options->width || frame->height != options->height)
        return "a frame has another width or height, expected those of the options";
    if (frame->len != frame->width * frame->height * (format == &WSTAC_FW_GREY ? 1u : 2u))
        return "a frame has too few or too many bytes, expected all of its rows";
    return NULL;
}

/*
 * Waits for the next frame of the camera, takes it, and gives its buffer back. Returns what is wrong with it in a
 * sentence; NULL if nothing is.
 */
static inline const char *wstac_esp32_take_camera(WstacEsp32 *sensor)
{
    camera_fb_t *frame = esp_camera_fb_get();
    const char *wrong;
    if (frame == NULL)
        return "the camera has sent no frame for 4 s: check its cable and the pins of esp_camera_init";
    wrong = wstac_esp32_wrong(sensor, frame);
    if (wrong == NULL) {
        int64_t time_us = (int64_t)frame->timestamp.tv_sec * 1000000 + frame->timestamp.tv_usec;
        WstacFwStatus status = wstac_esp32_take(sensor, frame->buf, frame->len, time_us);
        if (status == WSTAC_FW_STATUS_OTHER)
            wrong = "the time of a frame is not behind that of the frame before it";
        else if (status < 0)
            wrong = wstac_fw_status_text(status);
    }
    esp_camera_fb_return(frame);
    return wrong;
}

#endif
