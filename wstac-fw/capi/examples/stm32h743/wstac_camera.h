/*
 * A WSTac sensor on an STM32H7 with ST's HAL: a camera on DCMI and DMA, and a serial line to a host with wstac monitor.
 *
 * In the program that CubeMX has made, after its MX_…_Init calls:
 *
 *     wstac_camera_start(&hdcmi, &huart3, NULL, 0);
 *     while (1)
 *         wstac_camera_poll();
 *
 * docs/C.md has the settings of CubeMX. The macros below are those of the camera; a compiler's -D changes them.
 */
#ifndef WSTAC_CAMERA_H
#define WSTAC_CAMERA_H

#include <stddef.h>
#include <stdint.h>

#include "stm32h7xx_hal.h"

#ifndef WSTAC_CAMERA_WIDTH
#define WSTAC_CAMERA_WIDTH 640u
#endif
#ifndef WSTAC_CAMERA_HEIGHT
#define WSTAC_CAMERA_HEIGHT 480u
#endif
#ifndef WSTAC_CAMERA_FORMAT
#define WSTAC_CAMERA_FORMAT WSTAC_FW_YUYV
#define WSTAC_CAMERA_PIXEL_BYTES 2u
#endif
#ifndef WSTAC_CAMERA_FPS
#define WSTAC_CAMERA_FPS 30u
#endif
/* WSTAC_CAMERA_READOUT_MS is the time from the camera's first to its last row: 0.0f for a global shutter. Without it, fast
 * slides are not reliable. */
/* The rows that arrive together. The DMA's buffer holds two of these stripes. */
#ifndef WSTAC_CAMERA_STRIPE_ROWS
#define WSTAC_CAMERA_STRIPE_ROWS 8u
#endif

/* Starts the camera and the line. `model` is null, or a .wsm file aligned to four bytes that stays where it is. */
void wstac_camera_start(DCMI_HandleTypeDef *dcmi, UART_HandleTypeDef *uart, const uint8_t *model, size_t model_bytes);

/* Takes what has arrived, and sends what was found. Call it again at least once per stripe. */
void wstac_camera_poll(void);

#endif
