/* A stub: not Arduino's header. It has what the sketch uses. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stdint.h>

struct SerialPort {
    void begin(unsigned long baud);
    int printf(const char *format, ...) __attribute__((format(printf, 2, 3)));
};
extern SerialPort Serial;

void delay(uint32_t ms);
void setup();
void loop();

#endif
