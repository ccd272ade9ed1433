/*
 * Whole frames of a camera, with the times at which they were taken, on a time line without gaps. It is for any chip and
 * any source of frames; wstac_esp32_camera.h takes those of Espressif's esp32-camera.
 */
#ifndef WSTAC_ESP32_H
#define WSTAC_ESP32_H

#include "wstac_fw.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Gets the status of each step of the pipeline: WSTAC_FW_STATUS_EVENT if it has completed an event. */
typedef void WstacEsp32Report(WstacFwPipeline *pipeline, WstacFwStatus status);

/* A sensor, in memory that the program provides. A program reads the counters, and changes nothing. */
typedef struct {
    WstacFwPipeline pipeline;
    WstacFwOptions options;
    WstacEsp32Report *report;
    /* The frames that were used, that were lost or refused, and that came faster than the rate of the options. */
    uint32_t used, lost, surplus;
    /*
     * Whether there is a time of a last frame, and whether a frame since was not behind it; this time, and how far the
     * time line is behind it, in microseconds x fps_numerator, negative if it is ahead.
     */
    bool has_time, is_back;
    int64_t time_us, behind;
} WstacEsp32;

/*
 * Sets a sensor up. The options need a rate: fps_numerator and fps_denominator, at most 1,000,000 each. A camera with
 * another rate keeps the time right, but loses frames, or has surplus ones.
 */
WstacFwStatus wstac_esp32_init(WstacEsp32 *sensor, const WstacFwOptions *options, WstacEsp32Report *report);

/*
 * Takes a whole frame that was taken at a time. The time line gets the frames that are missing before it.
 *
 * Returns WSTAC_FW_STATUS_OK, WSTAC_FW_STATUS_NONE for a surplus frame, which is not used, or an error:
 * WSTAC_FW_STATUS_OTHER if its time is not behind that of the frame before it. A frame that is refused counts as lost.
 */
WstacFwStatus wstac_esp32_take(WstacEsp32 *sensor, const uint8_t *bytes, size_t length, int64_t time_us);

#ifdef __cplusplus
}
#endif

#endif
