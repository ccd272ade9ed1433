/* Runs a sketch as its core does, with the standard output as its serial line. */
#include "Arduino.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

SerialPort Serial;

void SerialPort::begin(unsigned long) {}

int SerialPort::printf(const char *format, ...)
{
    va_list values;
    va_start(values, format);
    int length = vprintf(format, values);
    va_end(values);
    return length;
}

void delay(uint32_t)
{
    exit(3);
}

extern "C" void app_main(void)
{
    setup();
    for (;;)
        loop();
}
