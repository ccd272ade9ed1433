/*
 * The smallest programs with the library, whose sizes docs/C.md has: frames in stripes, and one law. -D chooses FORMAT, LAW,
 * and whether there are a TRIGGER and a MODEL. They are linked and never run.
 */
#include "wstac_fw.h"

static WstacFwPipeline pipeline;
static const WstacFwOptions options = {.format = &FORMAT, .width = 400, .height = 400};
static volatile uintptr_t camera, file;
static WstacFwMotion motion;
static WstacFwSpeed speed;
static WstacFwDirection direction;
#ifdef MODEL
static WstacFwModel model;
static WstacFwTexture texture;
static int16_t sample[WSTAC_FW_SAMPLE_NUMBERS];
#endif

static inline void motion_by_coherence(void) { wstac_fw_motion(&pipeline, &motion); }
static inline void motion_by_edges(void) { wstac_fw_motion_by_edges(&pipeline, &motion); }
static inline void as_published(void)
{
    wstac_fw_speed(&pipeline, &speed);
    wstac_fw_direction(&pipeline, &direction);
}

int main(void)
{
    wstac_fw_init(&pipeline, sizeof pipeline, &options);
#ifdef TRIGGER
    WstacFwTrigger trigger;
    wstac_fw_trigger_defaults(&trigger);
    trigger.margin = 2;
    wstac_fw_set_trigger(&pipeline, &trigger);
#endif
#ifdef MODEL
    wstac_fw_model_init(&model, sizeof model, (const uint8_t *)file, 4096);
#endif
    for (;;) {
        if (wstac_fw_push_stripe(&pipeline, (const uint8_t *)camera, 3200) != WSTAC_FW_STATUS_EVENT)
            continue;
        LAW();
#ifdef MODEL
        wstac_fw_sample(&pipeline, sample);
        wstac_fw_classify(&model, sample, NULL, &texture);
#endif
    }
}
