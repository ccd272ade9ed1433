/*
 * Prints the tactile events of a camera on an ESP32-S3 or ESP32. The pins are those of the XIAO ESP32S3 Sense; choose
 * its PSRAM in the settings of the board. Nothing may touch the sensor for the first second.
 *
 * The package has no library for Xtensa, which these chips are: docs/C.md#on-an-esp32 says how to build one.
 */
#include <wstac_esp32_camera.h>

/* Set it to what your camera sends. Another rate loses frames, or has surplus ones. */
static const uint32_t FRAMES_PER_SECOND = 30;

static WstacEsp32 sensor;
static const char *lastFault = NULL;

static void report(WstacFwPipeline *pipeline, WstacFwStatus status)
{
    static const char *const contacts[] = {"unclear", "slide", "press", "poke"};
    WstacFwContactEnd end;
    WstacFwEvent event;
    WstacFwMotion motion;
    if (status == WSTAC_FW_STATUS_EVENT && wstac_fw_event(pipeline, &event) == WSTAC_FW_STATUS_OK &&
        wstac_fw_motion(pipeline, &motion) == WSTAC_FW_STATUS_OK) {
        Serial.printf("frame=%llu contact=%s", (unsigned long long)event.frame, contacts[motion.contact]);
        if (motion.contact == WSTAC_FW_CONTACT_SLIDE)
            Serial.printf(" speed=%.1f direction=%.1f", (double)motion.mm_s, (double)motion.degrees);
        Serial.printf("%s\n", motion.reliable ? "" : " not reliable");
    }
    if (wstac_fw_take_contact_end(pipeline, &end) == WSTAC_FW_STATUS_OK) {
        Serial.printf("frame=%llu end of the touch", (unsigned long long)end.frame);
        Serial.printf(" of event %llu\n", (unsigned long long)end.event_frame);
    }
}

void setup()
{
    Serial.begin(115200);
    camera_config_t camera = camera_config_t();
    camera.pin_pwdn = camera.pin_reset = -1;
    camera.pin_xclk = 10, camera.pin_sccb_sda = 40, camera.pin_sccb_scl = 39;
    camera.pin_d7 = 48, camera.pin_d6 = 11, camera.pin_d5 = 12, camera.pin_d4 = 14;
    camera.pin_d3 = 16, camera.pin_d2 = 18, camera.pin_d1 = 17, camera.pin_d0 = 15;
    camera.pin_vsync = 38, camera.pin_href = 47, camera.pin_pclk = 13;
    camera.xclk_freq_hz = 20000000;
    camera.ledc_timer = LEDC_TIMER_0, camera.ledc_channel = LEDC_CHANNEL_0;
    camera.pixel_format = PIXFORMAT_GRAYSCALE;
    camera.frame_size = FRAMESIZE_QVGA;
    camera.fb_count = 2;
    camera.fb_location = CAMERA_FB_IN_PSRAM;
    camera.grab_mode = CAMERA_GRAB_LATEST;
    WstacFwOptions options = WstacFwOptions();
    options.format = &WSTAC_FW_GREY;
    options.width = 320, options.height = 240;
    options.fps_numerator = FRAMES_PER_SECOND, options.fps_denominator = 1;
    esp_err_t error = esp_camera_init(&camera);
    WstacFwStatus status = wstac_esp32_init(&sensor, &options, report);
    while (error != ESP_OK || status < 0) {
        Serial.printf("no camera: esp_camera_init returns 0x%x; %s\n", (unsigned)error, wstac_fw_status_text(status));
        delay(1000);
    }
    /* Light that a camera regulates is no touch. */
    sensor_t *chip = esp_camera_sensor_get();
    if (chip == NULL || (chip->set_exposure_ctrl(chip, 0) | chip->set_aec2(chip, 0) | chip->set_gain_ctrl(chip, 0) |
                         chip->set_whitebal(chip, 0) | chip->set_awb_gain(chip, 0)) != 0)
        Serial.printf("the camera does not hold exposure, gain and white: slow changes of light may be events\n");
}

void loop()
{
    const char *fault = wstac_esp32_take_camera(&sensor);
    if (fault != NULL && fault != lastFault)
        Serial.printf("%s\n", fault);
    lastFault = fault;
}
