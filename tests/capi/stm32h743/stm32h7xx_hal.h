/*
 * This is not ST's header. It declares the names of ST's HAL that the example uses, as ST's public headers do, so that
 * the example is compiled and run where those are not at hand. hal.c models what is behind the names.
 */
#ifndef STM32H7XX_HAL_H
#define STM32H7XX_HAL_H

#include <stdint.h>

typedef enum { HAL_OK = 0, HAL_ERROR = 1, HAL_BUSY = 2, HAL_TIMEOUT = 3 } HAL_StatusTypeDef;

typedef struct {
    volatile uint32_t IER;
} DCMI_TypeDef;

typedef struct {
    volatile uint32_t NDTR;
} DMA_Stream_TypeDef;

typedef struct __DMA_HandleTypeDef {
    DMA_Stream_TypeDef *Instance;
    void (*XferCpltCallback)(struct __DMA_HandleTypeDef *hdma);
    void (*XferHalfCpltCallback)(struct __DMA_HandleTypeDef *hdma);
} DMA_HandleTypeDef;

typedef struct {
    DCMI_TypeDef *Instance;
    DMA_HandleTypeDef *DMA_Handle;
} DCMI_HandleTypeDef;

typedef struct {
    uint32_t ErrorCode;
} UART_HandleTypeDef;

#define DCMI_MODE_CONTINUOUS 0u
#define DCMI_IT_FRAME 1u
#define __HAL_DMA_GET_COUNTER(handle) ((handle)->Instance->NDTR)
#define __HAL_DCMI_ENABLE_IT(handle, interrupt) ((handle)->Instance->IER |= (interrupt))

HAL_StatusTypeDef HAL_DCMI_Start_DMA(DCMI_HandleTypeDef *hdcmi, uint32_t DCMI_Mode, uint32_t pData, uint32_t Length);
HAL_StatusTypeDef HAL_DCMI_Stop(DCMI_HandleTypeDef *hdcmi);
void HAL_DCMI_FrameEventCallback(DCMI_HandleTypeDef *hdcmi);
void HAL_DCMI_ErrorCallback(DCMI_HandleTypeDef *hdcmi);

HAL_StatusTypeDef HAL_UART_Transmit_IT(UART_HandleTypeDef *huart, const uint8_t *pData, uint16_t Size);
HAL_StatusTypeDef HAL_UART_Receive_IT(UART_HandleTypeDef *huart, uint8_t *pData, uint16_t Size);
void HAL_UART_TxCpltCallback(UART_HandleTypeDef *huart);
void HAL_UART_RxCpltCallback(UART_HandleTypeDef *huart);
void HAL_UART_ErrorCallback(UART_HandleTypeDef *huart);

uint32_t HAL_GetTick(void);
uint32_t HAL_GetUIDw0(void);
uint32_t HAL_GetUIDw1(void);
uint32_t HAL_GetUIDw2(void);
void SCB_InvalidateDCache_by_Addr(volatile void *addr, int32_t dsize);

#endif
