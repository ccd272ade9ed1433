/*
 * Prints the tactile events of a camera on an ESP32-S3 or ESP32, such as:
 *
 *     frame=35 contact=slide speed=150.1 direction=90.0
 *
 * The pins are those of the XIAO ESP32S3 Sense. Nothing may touch the sensor for the first second.
 *
 * The package has no library for Xtensa, which these chips are: docs/C.md#on-an-esp32 says how to build one.
 */
#include <stdio.h>

#include "wstac_esp32_camera.h"

/* Set it to what your camera sends. Another rate loses frames, or has surplus ones: a line says so. */
#define FRAMES_PER_SECOND 30

static WstacEsp32 sensor;

static const camera_config_t camera = {
    .pin_pwdn = -1,
    .pin_reset = -1,
    .pin_xclk = 10,
    .pin_sccb_sda = 40,
    .pin_sccb_scl = 39,
    .pin_d7 = 48,
    .pin_d6 = 11,
    .pin_d5 = 12,
    .pin_d4 = 14,
    .pin_d3 = 16,
    .pin_d2 = 18,
    .pin_d1 = 17,
    .pin_d0 = 15,
    .pin_vsync = 38,
    .pin_href = 47,
    .pin_pclk = 13,
    .xclk_freq_hz = 20000000,
    .ledc_timer = LEDC_TIMER_0,
    .ledc_channel = LEDC_CHANNEL_0,
    .pixel_format = PIXFORMAT_GRAYSCALE,
    .frame_size = FRAMESIZE_QVGA,
    .fb_count = 2,
    .fb_location = CAMERA_FB_IN_PSRAM,
    .grab_mode = CAMERA_GRAB_LATEST,
};

/* Light that a camera regulates is no touch. Returns false if the camera refuses a part of it. */
static bool lock_controls(void)
{
    sensor_t *chip = esp_camera_sensor_get();
    return chip != NULL && (chip->set_exposure_ctrl(chip, 0) | chip->set_aec2(chip, 0) | chip->set_gain_ctrl(chip, 0) |
                            chip->set_whitebal(chip, 0) | chip->set_awb_gain(chip, 0)) == 0;
}

static void report(WstacFwPipeline *pipeline, WstacFwStatus status)
{
    static const char *const contacts[] = {"unclear", "slide", "press", "poke"};
    WstacFwContactEnd end;
    WstacFwEvent event;
    WstacFwMotion motion;
    if (status == WSTAC_FW_STATUS_EVENT && wstac_fw_event(pipeline, &event) == WSTAC_FW_STATUS_OK &&
        wstac_fw_motion(pipeline, &motion) == WSTAC_FW_STATUS_OK) {
        printf("frame=%llu contact=%s", (unsigned long long)event.frame, contacts[motion.contact]);
        if (motion.contact == WSTAC_FW_CONTACT_SLIDE)
            printf(" speed=%.1f direction=%.1f", (double)motion.mm_s, (double)motion.degrees);
        printf("%s\n", motion.reliable ? "" : " not reliable");
    }
    if (wstac_fw_take_contact_end(pipeline, &end) == WSTAC_FW_STATUS_OK) {
        printf("frame=%llu end of the touch", (unsigned long long)end.frame);
        printf(" of event %llu\n", (unsigned long long)end.event_frame);
    }
}

void app_main(void)
{
    static const WstacFwOptions options = {
        .format = &WSTAC_FW_GREY,
        .width = 320,
        .height = 240,
        .fps_numerator = FRAMES_PER_SECOND,
        .fps_denominator = 1,
    };
    const char *last = NULL;
    uint32_t lost = 0, surplus = 0;
    esp_err_t error = esp_camera_init(&camera);
    WstacFwStatus status = wstac_esp32_init(&sensor, &options, report);
    if (error != ESP_OK || status < 0) {
        printf("no camera: esp_camera_init returns 0x%x; %s\n", (unsigned)error, wstac_fw_status_text(status));
        return;
    }
    if (!lock_controls())
        printf("the camera does not hold exposure, gain and white: slow changes of light may be events\n");
    for (;;) {
        const char *wrong = wstac_esp32_take_camera(&sensor);
        /* The texts are constants: the same fault again is the same address. */
        if (wrong != NULL && wrong != last)
            printf("%s\n", wrong);
        last = wrong;
        if (sensor.used % FRAMES_PER_SECOND == 0 && (sensor.lost != lost || sensor.surplus != surplus)) {
            lost = sensor.lost;
            surplus = sensor.surplus;
            printf("lost frames: %lu, surplus frames: %lu\n", (unsigned long)lost, (unsigned long)surplus);
        }
    }
}
